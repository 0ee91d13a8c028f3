# SPDX-License-Identifier: MIT
"""Directive `headers`: the reference of C++ or C headers, one section for each.

    ```{headers}
    ehsid/reset.hpp
    ehsid/forgetting/*.hpp
    ```

A line is a path below cpp/include; with a star it stands for every header there. A section has the
`#include` line, the comment at the head of the file, and what the file declares, which Breathe
takes from the XML of Doxygen.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

from docutils import nodes
from header_comments import declares, for_doxygen, head_comment
from plain_text import as_markdown
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

INCLUDE = Path(__file__).resolve().parents[2] / "cpp" / "include"
DOXYFILE = Path(__file__).resolve().parents[1] / "Doxyfile"


class Headers(SphinxDirective):
    """Lists the declarations of headers, file by file."""

    has_content = True

    def run(self) -> list[nodes.Node]:
        """Returns the sections of the headers."""
        lines: list[str] = []
        for pattern in self.content:
            paths = sorted(INCLUDE.glob(pattern))
            if not paths:
                raise self.error(f"no header below cpp/include has the name {pattern}")
            for path in paths:
                name = path.relative_to(INCLUDE).as_posix()
                lines += section_of(name)
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def section_of(name: str) -> list[str]:
    """Returns the section of one header as MyST."""
    source = (INCLUDE / name).read_text(encoding="utf-8")
    lines = [f"({label_of(name)})=", f"## `{name}`", "", *as_markdown(head_comment(source)), ""]
    if declares(source):
        lines += [
            "````{eval-rst}",
            f".. doxygengroup:: {label_of(name)}",
            "   :content-only:",
            "   :members:",
            "   :undoc-members:",
            "````",
            "",
        ]
    return lines


def label_of(name: str) -> str:
    """Returns the label of the section of a header, e.g. header-ehsid-rls-hpp."""
    return "header-" + name.replace("/", "-").replace(".", "-").replace("_", "-")


def read_headers(app: Sphinx) -> None:
    """Runs Doxygen on the headers, before a page is read."""
    out = Path(app.doctreedir).parent / "doxygen"
    for path in (*INCLUDE.rglob("*.hpp"), *INCLUDE.rglob("*.h")):
        name = path.relative_to(INCLUDE)
        copy = out / "headers" / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        text = path.read_text(encoding="utf-8")
        copy.write_text(for_doxygen(text, label_of(name.as_posix())), encoding="utf-8")
    try:
        done = subprocess.run(
            ["doxygen", str(DOXYFILE)], cwd=out, capture_output=True, text=True, check=False
        )
    except FileNotFoundError as error:
        raise ExtensionError(
            "doxygen, which reads the headers, is not installed; install it with: "
            "apt-get install doxygen"
        ) from error
    if done.returncode:
        raise ExtensionError(f"doxygen refuses comments of the headers:\n{done.stderr}")
    for path in (out / "xml").glob("*.xml"):
        xml = path.read_text(encoding="utf-8")
        path.write_text(for_breathe(xml), encoding="utf-8")
    app.config.breathe_projects = {"ehsid": str(out / "xml")}


def for_breathe(xml: str) -> str:
    """Returns the XML of Doxygen with the names of namespaces, which Breathe leaves out in groups.

    The classes that are derived from a class go: some are named twice, some have no entry.
    """
    xml = re.sub(r" *<derivedcompoundref .*\n", "", xml)
    xml = re.sub(r"(?s)<verbatim>.*?</verbatim>", without_slashes, xml)
    if 'kind="group"' not in xml:
        return xml
    return re.sub(
        r"<name>[^<]+</name>(\s*<qualifiedname>([^<]+)</qualifiedname>)", r"<name>\2</name>\1", xml
    )


def without_slashes(code: re.Match[str]) -> str:
    """Returns code in a comment without the slashes of the comment, which Doxygen leaves there."""
    return re.sub(r"(?m)(?:^|(?<=<verbatim>)) */// {0,3}| *///\s*(?=</verbatim>)", "", code[0])


def setup(app: Sphinx) -> dict[str, bool]:
    """Adds the directive."""
    app.add_directive("headers", Headers)
    app.connect("builder-inited", read_headers, priority=100)  # before Breathe looks for the XML
    return {"parallel_read_safe": True, "parallel_write_safe": True}

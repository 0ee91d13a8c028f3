# SPDX-License-Identifier: MIT
"""Directive `files`: files of the repository as downloads, each with the comment at its head.

Its argument is a pattern, such as examples/rigs/*.toml.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from docutils import nodes
from plain_text import as_markdown
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).resolve().parents[2]
# The comment or docstring at the head of a file, behind the line with the licence.
HEAD = re.compile(r"\A(?:(?:#|//) SPDX.*\n)?((?:(?:#|//) (?!SPDX).*\n)+|\"{3}[^\"]*\"{3})")


class Files(SphinxDirective):
    """Lists the files that fit a pattern."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Returns the list."""
        pattern = self.arguments[0]
        paths = sorted(path for path in ROOT.glob(pattern) if path.is_file())
        if not paths:
            raise self.error(f"no file of the repository fits {pattern}")
        folder = posixpath.dirname(f"docs/{self.env.docname}")
        lines = []
        for path in paths:
            name = path.relative_to(ROOT).as_posix()
            words = " ".join(as_markdown(first_sentence(path.read_text(encoding="utf-8"))))
            about = f": {words}" if words else ""
            lines.append(f"- [`{path.name}`]({posixpath.relpath(name, folder)}){about}")
        return self.parse_text_to_nodes("\n".join(lines))


def first_sentence(text: str) -> str:
    """Returns the first sentence of the comment at the head of a file, "" without one."""
    found = HEAD.match(text)
    if not found:
        return ""
    words = " ".join(re.sub(r"^(#|//) ?|\"\"\"", "", found[1], flags=re.MULTILINE).split())
    return re.split(r"(?<=[a-z)]{4})\. ", words)[0].rstrip(".") + "."


def setup(app: Sphinx) -> dict[str, bool]:
    """Adds the directive."""
    app.add_directive("files", Files)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

# SPDX-License-Identifier: MIT
"""Gives the compiled module the signatures of its stub, python/ehsid/_core.pyi.

pybind11 writes signatures with every type that it converts from, which nobody can read. The stub
has the types as a user thinks of them, and a test compares it with the module.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

from plain_text import PAGE, page_exists
from sphinx.application import Sphinx
from sphinx.util.inspect import signature_from_str

import ehsid

STUB = Path(__file__).resolve().parents[2] / "python" / "ehsid" / "_core.pyi"
# Names of the stub itself, for what numpy calls them.
ALIASES = {"_Array": "npt.NDArray[np.float64]", "_Samples": "npt.NDArray"}


def signatures() -> dict[str, tuple[str, str | None]]:
    """Returns parameters and type of each function of the stub, and the type of each property."""
    found: dict[str, tuple[str, str | None]] = {}
    for node in ast.parse(STUB.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            found[f"ehsid.{node.name}"] = of_function(node, bound=False)
        elif isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, ast.FunctionDef):
                    decorators = [ast.unparse(one) for one in member.decorator_list]
                    signature = of_function(member, bound="staticmethod" not in decorators)
                    if member.name == "__init__":
                        found[f"ehsid.{node.name}"] = (signature[0], None)
                    found[f"ehsid.{node.name}.{member.name}"] = signature
    return found


def of_function(node: ast.FunctionDef, *, bound: bool) -> tuple[str, str | None]:
    """Returns the parameters of a function without `self`, and the type of what it returns."""
    if bound:
        del node.args.args[0]
    words = [ast.unparse(node.args), ast.unparse(node.returns) if node.returns else ""]
    for alias, meant in ALIASES.items():
        words = [re.sub(rf"\b{alias}\b", meant, one) for one in words]
    return f"({words[0]})", words[1] or None


def of_classes(app: Sphinx) -> None:
    """Gives each class its signature, which pybind11 has in the docstring of `__init__` only."""
    for name, (parameters, _) in app.config.compiled_signatures.items():
        of = getattr(ehsid, name.removeprefix("ehsid."), None)
        if isinstance(of, type):
            of.__signature__ = signature_from_str(parameters)  # type: ignore[attr-defined]


def in_signature(
    app: Sphinx, what: str, name: str, _of: Any, _options: Any, given: str | None, returns: str
) -> tuple[str | None, str | None] | None:
    """Answers Sphinx with the signature in the stub, or with names of types as they are."""
    if what not in ("function", "method"):
        return None
    plain = re.sub(r"TypeAliasForwardRef\('([\w.]+)'\)", r"\1", given or "")
    known: dict[str, tuple[str, str | None]] = app.config.compiled_signatures
    return known.get(name, (plain or given, returns))


def in_docstring(
    app: Sphinx, what: str, name: str, _of: Any, _options: Any, lines: list[str]
) -> None:
    """Shows a docstring as it is meant: bars are bars, and names of pages are links.

    The type of a property of the compiled module stands before its description. Without an empty
    line there, napoleon takes words before a colon for the type.
    """
    for at, line in enumerate(lines):
        if not line.lstrip().startswith((">>>", "...")):
            lines[at] = PAGE.sub(page_link, line.replace("|", "\\|"))
    if what in ("attribute", "property"):
        known = app.config.compiled_signatures.get(name)
        lines[:0] = [f"*{known[1]}*", ""] if known else [""]


def page_link(found: re.Match[str]) -> str:
    """Returns the name of a page as a link to it."""
    return f":doc:`/{found[1]}`" if page_exists(found[1]) else found[0]


def setup(app: Sphinx) -> dict[str, bool]:
    """Changes what autodoc finds."""
    app.add_config_value("compiled_signatures", signatures(), "")
    app.connect("builder-inited", of_classes)
    app.connect("autodoc-process-signature", in_signature)
    app.connect("autodoc-process-docstring", in_docstring, priority=400)  # before napoleon
    return {"parallel_read_safe": True, "parallel_write_safe": True}

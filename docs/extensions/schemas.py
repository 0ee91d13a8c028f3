# SPDX-License-Identifier: MIT
"""Directive `schema`: the keys of a JSON file, from its JSON Schema in docs/schemas.

Its argument is the name of the schema, such as diagnosis.json.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from docutils import nodes
from plain_text import as_markdown
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

SCHEMAS = Path(__file__).resolve().parents[1] / "schemas"


class Schema(SphinxDirective):
    """Lists the objects of a JSON file, each with a table of its keys."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Returns the tables."""
        name = self.arguments[0]
        path = SCHEMAS / name
        if not path.is_file():
            raise self.error(f"there is no schema docs/schemas/{name}")
        self.env.note_dependency(str(path))
        schema = json.loads(path.read_text(encoding="utf-8"))
        label = name.replace(".", "-").replace("_", "-")
        lines: list[str] = []
        for title, definition in schema["$defs"].items():
            lines += table_of(title, definition, label)
        return self.parse_text_to_nodes("\n".join(lines), allow_section_headings=True)


def table_of(title: str, definition: dict[str, Any], label: str) -> list[str]:
    """Returns an object of the file as MyST: what it is, and a row for each key."""
    described = definition.get("description", "").replace("\n    ", "\n")
    needed = definition.get("required", [])
    rows = [
        f"| `{key}` | {words_of(of, label)} | {presence(key in needed, of)} |"
        for key, of in definition.get("properties", {}).items()
    ]
    head = ["| key | value | |", "|---|---|---|"]
    anchor = f"({label}-{title.lower()})="
    table = [*head, *rows, ""] if rows else []
    return [anchor, f"### {title}", "", *as_markdown(described), "", *table]


def words_of(of: dict[str, Any], label: str) -> str:
    """Returns in words which values the schema of a key allows."""
    if "$ref" in of:
        title = of["$ref"].rsplit("/", 1)[-1]
        return f"[{title}](#{label}-{title.lower()})"
    if "anyOf" in of:
        return " or ".join(words_of(one, label) for one in of["anyOf"])
    if "enum" in of:
        return ", ".join(f"`{json.dumps(value)}`" for value in of["enum"])
    if "const" in of:
        return f"`{json.dumps(of['const'])}`"
    kind = of.get("type")
    if kind == "array":
        return words_of_array(of, label)
    if kind == "object":
        return f"object, each value: {words_of(of.get('additionalProperties') or {}, label)}"
    return str(kind) if kind else "any value"


def words_of_array(of: dict[str, Any], label: str) -> str:
    """Returns in words what an array holds."""
    if "prefixItems" in of:
        held = [words_of(one, label) for one in of["prefixItems"]]
        if len(set(held)) == 1:
            return f"array of {len(held)}, each: {held[0]}"
        return f"array of {len(held)}: " + "; ".join(held)
    items = of.get("items")
    return f"array, each: {words_of(items, label)}" if items else "array"


def presence(needed: bool, of: dict[str, Any]) -> str:
    """Returns whether a file must have the key, and what holds without it."""
    if needed:
        return "always there"
    return f"without it: `{json.dumps(of['default'])}`" if "default" in of else "may be left out"


def setup(app: Sphinx) -> dict[str, bool]:
    """Adds the directive."""
    app.add_directive("schema", Schema)
    return {"parallel_read_safe": True, "parallel_write_safe": True}

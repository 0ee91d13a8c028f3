# SPDX-License-Identifier: MIT
"""The interface of the files: fields of what is written, keys and columns of what is read."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from changes import Change, table_changes

from ehsid.harness.catalogue.channels import CHANNELS
from ehsid.harness.catalogue.parameters import parameter_keys

MAY_MISS = ", may be missing"
Schema = Mapping[str, Any]


def file_table(schemas: Path) -> dict[str, str]:
    """Fields of the files with a published schema, keys of the rig file, columns of records."""
    table = {f"rig file: {key}": "number" for key in parameter_keys()}
    table |= {f"record: {name}": "column" for name in CHANNELS}
    for path in sorted(schemas.glob("*.json")):
        table |= schema_table(path.name, json.loads(path.read_text(encoding="utf-8")))
    return table


def schema_table(name: str, schema: Schema) -> dict[str, str]:
    """Every field of a JSON Schema by its path, such as `which.effects[].id`, with its type."""
    definitions = schema.get("$defs", {})

    def fields(part: Schema, path: str, inside: tuple[str, ...]) -> Iterator[tuple[str, str]]:
        for option in _options(part, definitions):
            reference = option.get("title", "")
            if reference and reference in inside:  # a type that contains itself
                continue
            below = (*inside, reference)
            required = option.get("required", ())
            for key, value in option.get("properties", {}).items():
                where = f"{path}.{key}" if path else key
                yield where, _type(value, definitions) + ("" if key in required else MAY_MISS)
                yield from fields(value, where, below)
            for key, sign in (("items", "[]"), ("additionalProperties", "{}")):
                value = option.get(key)
                if isinstance(value, Mapping):
                    yield f"{path}{sign}", _type(value, definitions)
                    yield from fields(value, f"{path}{sign}", below)
            for value in option.get("enum", ()):
                yield f"{path} = {json.dumps(value)}", "value"

    return {f"{name}: {path}": kind for path, kind in fields(schema, "", ())}


def file_changes(before: dict[str, str], now: dict[str, str]) -> list[Change]:
    """Compares two tables. A field that is now always there breaks no reader."""
    return [
        Change("files", "added", change.symbol, change.was, change.now)
        if change.what == "changed" and change.was == change.now + MAY_MISS
        else change
        for change in table_changes("files", before, now)
    ]


def _options(part: Schema, definitions: Schema) -> Iterator[Schema]:
    """The schemas that a value may have, with references replaced by what they refer to."""
    if "$ref" in part:
        yield from _options(definitions[part["$ref"].rsplit("/", 1)[-1]], definitions)
    elif "anyOf" in part:
        for option in part["anyOf"]:
            yield from _options(option, definitions)
    else:
        yield part


def _type(part: Schema, definitions: Schema) -> str:
    """The types of JSON that a value may have."""
    kinds = set()
    for option in _options(part, definitions):
        if "const" in option:
            kinds.add(json.dumps(option["const"]))
        elif "enum" in option:
            kinds.add("one of the values below")
        else:
            named = option.get("type", "anything")
            kinds |= {named} if isinstance(named, str) else set(named)
    return " or ".join(sorted(kinds))

# SPDX-License-Identifier: MIT
"""The JSON Schemas in docs/schemas, applied by a library that is not ours."""

import json
from pathlib import Path
from typing import Any

import jsonschema
from sources import ROOT

FOLDER = ROOT / "docs" / "schemas"


def published(name: str) -> Any:
    return json.loads((FOLDER / name).read_text(encoding="utf-8"))


def check_file(path: Path) -> None:
    """Raises an error unless the file is as the schema of its name has it, key by key."""
    schema = published(path.name)
    for definition in schema["$defs"].values():
        definition.setdefault("additionalProperties", False)
    content = json.loads(path.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(content)

# SPDX-License-Identifier: MIT
"""The published JSON Schemas are those of the code."""

import json
import runpy

import jsonschema
import pytest
from published_schemas import FOLDER, published

SCHEMAS = runpy.run_path(str(FOLDER / "make.py"))["SCHEMAS"]


def test_every_published_schema_is_made() -> None:
    assert {path.name for path in FOLDER.glob("*.json")} == set(SCHEMAS)


@pytest.mark.parametrize("name", SCHEMAS)
def test_published_schemas_are_those_of_the_code(name: str) -> None:
    jsonschema.Draft202012Validator.check_schema(published(name))
    assert json.loads(json.dumps(SCHEMAS[name])) == published(name), (
        f"docs/schemas/{name} is of another version; write it again: python docs/schemas/make.py"
    )

# SPDX-License-Identifier: MIT
"""The reference of the site has each public name and each file; the built site is checked too."""

from __future__ import annotations

import re

from sources import ROOT

import ehsid
from ehsid import _core

REFERENCE = ROOT / "docs" / "reference"
NAME = re.compile(r"^\.\. (?:auto\w+|py:\w+):: (\w+)", re.MULTILINE)


def test_every_public_name_of_python_is_in_the_reference() -> None:
    pages = (REFERENCE / "python").glob("*.md")
    described = {name for page in pages for name in NAME.findall(page.read_text(encoding="utf-8"))}
    public = {name for name in (*dir(_core), *ehsid._LAZY) if not name.startswith("_")}
    assert len(public) > 40
    assert public - described == set()


def test_every_schema_is_in_the_reference() -> None:
    page = (REFERENCE / "files.md").read_text(encoding="utf-8")
    schemas = {path.name for path in (ROOT / "docs" / "schemas").glob("*.json")}
    assert set(re.findall(r"^```\{schema\} (\S+)", page, re.MULTILINE)) == schemas

# SPDX-License-Identifier: MIT
"""Version and licence stand in several files for others to read, and are the same everywhere."""

import json
import re
import tomllib
from typing import Any

import interface
import pytest
import yaml
from sources import ROOT

VERSION = str(interface.version())


def text(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def citation() -> dict[str, Any]:
    read: dict[str, Any] = yaml.safe_load(text("CITATION.cff"))
    return read


def test_versions_agree(citation: dict[str, Any]) -> None:
    assert citation["version"] == VERSION
    assert json.loads(text("library.json"))["version"] == VERSION
    project = tomllib.loads(text("pyproject.toml"))
    assert project["project"]["dynamic"] == ["version"]
    assert project["tool"]["scikit-build"]["metadata"]["version"]["input"].endswith("version.hpp")


def test_licences_agree(citation: dict[str, Any]) -> None:
    assert text("LICENSE").startswith("MIT License")
    assert citation["license"] == "MIT"
    assert json.loads(text("library.json"))["license"] == "MIT"
    assert tomllib.loads(text("pyproject.toml"))["project"]["license"] == "MIT"
    assert "MIT licence." in text("README.md")
    assert "SPDX-License-Identifier: MIT" in text("zephyr/module.yml")


def test_citation_has_what_its_format_asks_for(citation: dict[str, Any]) -> None:
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    assert citation["cff-version"] == "1.2.0"
    assert citation["authors"] == [{"name": "The ehsid developers"}]
    (paper,) = citation["references"]
    assert paper["type"] == "article"
    # The README ends with the same paper.
    said = " ".join(text("README.md").split())
    assert paper["title"] in said.replace("- ", "-")
    assert f"{paper['volume']}({paper['issue']}), {paper['year']}" in said
    assert f"pp. {paper['start']}-{paper['end']}" in said
    assert all(author["family-names"] in said for author in paper["authors"])


def test_the_changelog_has_the_groups_of_its_format() -> None:
    unreleased = text("CHANGELOG.md").split("\n## [")[1]
    assert unreleased.startswith("Unreleased]")
    groups = re.findall(r"^### (\w+)$", unreleased, flags=re.MULTILINE)
    assert groups == [name for name in ("Added", "Changed", "Fixed", "Removed") if name in groups]
    entries = re.findall(r"^- (.*(?:\n  .*)*)", unreleased, flags=re.MULTILINE)
    assert len(entries) > 10
    assert not [entry for entry in entries if not entry.rstrip(")").endswith((".", ".md"))]


@pytest.mark.parametrize(
    "page",
    ["CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md", "docs/deprecation.md", "docs/release.md"],
)
def test_what_a_page_refers_to_is_there(page: str) -> None:
    """Links, and names of files in code that begin with a folder of the project."""
    words = text(page)
    folder = (ROOT / page).parent
    links = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", words)
    assert links
    assert not [link for link in links if not (folder / link).exists()]
    named = re.findall(r"`((?:cpp|docs|python|script|tests|bindings)/[\w./]+)`", words)
    patterns = ("NAME", "PATH")
    assert not [
        name
        for name in named
        if not any(word in name for word in patterns) and not (ROOT / name).exists()
    ]

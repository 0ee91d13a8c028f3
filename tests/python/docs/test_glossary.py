# SPDX-License-Identifier: MIT
"""The glossary is in order, and links to its terms find them."""

from __future__ import annotations

import re
from pathlib import Path

from printed_pages import DOCS, text_of
from sources import ROOT

TERMS = re.findall(r"^### (.+)$", text_of(DOCS / "glossary.md"), flags=re.MULTILINE)
# Those that a reader of any page meets.
EXPECTED = {"Nats", "Noise floor", "Gap", "Calibrated", "Augmented", "Rig", "Effect", "Verdict"}


def anchor(term: str) -> str:
    """As code hosts and MyST make it of a heading."""
    return re.sub(r"[^\w -]", "", term.lower()).replace(" ", "-")


def pages() -> list[Path]:
    return [ROOT / "README.md", *DOCS.rglob("*.md"), *DOCS.glob("notebooks/*.ipynb")]


def test_terms_are_sorted_and_there() -> None:
    assert sorted(TERMS, key=str.lower) == TERMS
    assert set(TERMS) >= EXPECTED


def test_every_term_is_said_in_a_few_sentences() -> None:
    parts = re.split(r"^### .+$", text_of(DOCS / "glossary.md"), flags=re.MULTILINE)[1:]
    for term, part in zip(TERMS, parts, strict=True):
        words = len(part.split())
        assert 8 <= words <= 90, (term, words)


def test_links_to_terms_find_them() -> None:
    anchors = {anchor(term) for term in TERMS}
    linked = {
        (page.name, name)
        for page in pages()
        for name in re.findall(r"glossary\.md#([\w-]+)\)", text_of(page))
    }
    inside = set(re.findall(r"\]\(#([\w-]+)\)", text_of(DOCS / "glossary.md")))
    assert len(linked) > 30
    assert [(page, name) for page, name in linked if name not in anchors] == []
    assert inside <= anchors


def test_relative_links_of_new_pages_find_files() -> None:
    """Of the pages whose tests stand here, with the headings that they name."""
    found = 0
    folders = ("tutorials", "how_to", "explanation", "evidence", "notebooks")
    for page in [DOCS / "glossary.md", *(one for one in pages() if one.parent.name in folders)]:
        for file, heading in re.findall(r"\]\(([\w./]+)(?:#([\w-]+))?\)", text_of(page)):
            target = page.parent / file
            assert target.exists(), (page.name, file)
            if heading:
                heads = re.findall(r"^#+ (.+)$", text_of(target), flags=re.MULTILINE)
                assert heading in {anchor(head) for head in heads}, (page.name, file, heading)
            found += 1
    assert found > 60

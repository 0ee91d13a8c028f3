# SPDX-License-Identifier: MIT
"""The README is short, its links find files, and its lines of Python print what it says."""

from __future__ import annotations

import doctest
import re

import pytest
from printed_pages import text_of
from sources import ROOT

README = text_of(ROOT / "README.md")
MOST_WORDS = 900


def test_it_is_short_and_begins_with_what_it_is_and_for_whom() -> None:
    assert len(README.split()) <= MOST_WORDS
    assert README.count("![") == 1
    places = [README.index(word) for word in ("![", "**For whom.**", "**Not for**", "\n## ")]
    assert places == sorted(places)


def test_links_find_files() -> None:
    links = re.findall(r"\]\(([\w./]+)(?:#[\w-]+)?\)", README)
    assert len(links) > 15
    assert [link for link in links if not (ROOT / link).exists()] == []


@pytest.mark.thorough
def test_its_lines_of_python_print_what_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    (block,) = re.findall(r"```pycon\n(.*?)```", README, flags=re.DOTALL)
    told: list[str] = []
    test = doctest.DocTestParser().get_doctest(block, {}, "README", None, None)
    assert len(test.examples) == 5
    doctest.DocTestRunner(verbose=False).run(test, out=told.append)
    assert not told

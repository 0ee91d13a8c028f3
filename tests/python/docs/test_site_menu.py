# SPDX-License-Identifier: MIT
"""The menu leads to few words; evidence stands beside it, where the pages whose claims it supports
link to it.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path

from printed_pages import DOCS, text_of
from sources import ROOT

# What a person is led to. A page that is added takes the place of another one, or becomes evidence.
MOST_WORDS = 58_000
LINKS = ast.parse(text_of(DOCS / "extensions" / "repository_links.py"))
# The page of the site -> the file of the repository that it shows.
SHOWN = {
    page: ROOT / name
    for node in LINKS.body
    if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "PAGES"
    for name, page in ast.literal_eval(node.value).items()
    if name.endswith(".md")
}


def entries(page: Path) -> list[Path]:
    """Returns the pages in the menus of a page."""
    found = []
    for block in re.findall(r"```\{toctree\}\n(.*?)```", text_of(page), flags=re.DOTALL):
        for line in block.splitlines():
            name = re.sub(r".*<(.+)>$", r"\1", line.strip())
            if name and not name.startswith(":"):
                folder = DOCS if name.startswith("/") else page.parent
                found.append((folder / name.lstrip("/")).resolve())
    return found


def in_the_menu() -> dict[str, int]:
    """Returns the words of each page of Markdown that the menu reaches."""
    words: dict[str, int] = {}
    waiting = [DOCS / "index"]
    while waiting:
        page = waiting.pop()
        name = page.relative_to(DOCS).as_posix()
        file = page.with_suffix(".md")
        if name not in words and file.is_file():
            words[name] = len(text_of(SHOWN.get(name, file)).split())
            waiting += entries(file)
    return words


def test_the_menu_leads_to_few_words() -> None:
    words = in_the_menu()
    assert len(words) > 30
    assert {"readme", "choose", "gap", "reference/example_records"} <= words.keys()
    longest = sorted(words.items(), key=lambda item: -item[1])[:10]
    assert sum(words.values()) <= MOST_WORDS, (sum(words.values()), longest)


def test_evidence_is_not_in_the_menu_and_is_linked() -> None:
    evidence = entries(DOCS / "evidence" / "index.md")
    assert len(evidence) > 20
    menu = {DOCS / name for name in in_the_menu()}
    assert not menu & set(evidence)
    texts = "\n".join(text_of(page.with_suffix(".md")) for page in menu)
    assert "evidence/index.md" in texts
    assert [page.name for page in evidence if not page.with_suffix(".md").is_file()] == []

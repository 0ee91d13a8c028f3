# SPDX-License-Identifier: MIT
import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from offline_pages import read

import ehsid
from ehsid.harness.report.page import Page, Picture, Section, Table, render_page, write_page


def picture() -> Picture:
    figure = Figure()
    figure.subplots().plot([0, 1], [0, 1])
    return Picture(figure, "a line", 'rises from "left" to right')


@pytest.fixture
def page() -> Page:
    table = Table("2 < 3", ("order", "fit %"), [("2", "91.3"), ("3", "95.5")], marked=[1])
    section = Section("Results & more", ["a < b", table, picture()])
    return Page("Title", ["The lead."], [section], sources=["A. Author, 2011"])


def test_page_is_whole_and_fetches_nothing(page: Page) -> None:
    found = read(render_page(page))
    assert sorted(ref.split(",")[0] for ref in found.found) == [
        "#s1",
        "data:image/svg+xml;base64",
    ]
    words = " ".join(found.words)
    for text in ("Title", "The lead.", "Results & more", "a < b", "2 < 3", "95.5", "a line"):
        assert text in words
    assert f"ehsid {ehsid.__version__}" in words


def test_same_findings_give_the_same_bytes(page: Page) -> None:
    again = Page(
        page.title,
        page.lead,
        [Section("Results & more", [*page.sections[0].blocks[:2], picture()])],
        page.sources,
    )
    assert render_page(page) == render_page(again)


def test_marked_row_stands_out(page: Page) -> None:
    rows = re.findall(r"<tr( class=\"marked\")?><th scope=\"row\">(\d)", render_page(page))
    assert rows == [("", "2"), (' class="marked"', "3")]


def test_a_failed_page_leaves_the_old_one(page: Page, tmp_path: Path) -> None:
    target = tmp_path / "new" / "page.html"
    write_page(target, page)
    before = target.read_text(encoding="utf-8")
    broken = Page("Title", ["lead"], [Section("no blocks", [None])])  # type: ignore[list-item]
    with pytest.raises(Exception, match="figure"):
        write_page(target, broken)
    assert target.read_text(encoding="utf-8") == before
    assert [path.name for path in target.parent.iterdir()] == ["page.html"]

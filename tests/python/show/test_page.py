# SPDX-License-Identifier: MIT
import base64
import io
import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from offline_pages import read
from PIL import Image

import ehsid
from ehsid.harness.show.page import (
    Bar,
    Bars,
    Beside,
    Block,
    Card,
    Cell,
    Code,
    Column,
    Fact,
    Facts,
    Folded,
    Heading,
    Items,
    Link,
    Mark,
    Note,
    Page,
    Picture,
    Scale,
    Section,
    Table,
    Tagged,
    Timeline,
)
from ehsid.harness.show.rendering import markdown, moving, render_page, write_page


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
    head = r"<tr( class=\"marked\")?><th scope=\"row\" class=\"short\">(\d)"
    rows = re.findall(head, render_page(page))
    assert rows == [("", "2"), (' class="marked"', "3")]


def test_a_failed_page_leaves_the_old_one(page: Page, tmp_path: Path) -> None:
    target = tmp_path / "page.html"
    write_page(target, page)
    before = target.read_text(encoding="utf-8")
    broken = Page("Title", ["lead"], [Section("no blocks", [None])])  # type: ignore[list-item]
    with pytest.raises(Exception, match="has no attribute"):
        write_page(target, broken)
    assert target.read_text(encoding="utf-8") == before
    assert [path.name for path in target.parent.iterdir()] == ["page.html"]


def test_a_picture_with_frames_moves_and_ends_with_its_figure() -> None:
    figures = [Figure(figsize=(1.0, 1.0)) for _ in range(3)]
    for figure, colour in zip(figures, ("red", "lime", "blue"), strict=True):
        figure.set_facecolor(colour)
    moved = moving(Picture(figures[2], "", "", figures[:2]))
    shown = Image.open(io.BytesIO(base64.b64decode(moved.partition(",")[2])))
    colours = []
    for frame in range(shown.n_frames):
        shown.seek(frame)
        colours.append(shown.convert("RGB").getpixel((5, 5)))
    assert colours == [(255, 0, 0), (0, 255, 0), (0, 0, 255)]


def test_every_kind_of_block_is_on_the_page_with_its_texts() -> None:
    bar = Bar("valve", "30 %", 30.0, low=20.0, high=40.0, note="20 to 40 %")
    table = Table(
        "",
        ("value", "estimate", "share", Scale("-3", "0", "+3")),
        [(Tagged("mass", "moved", "load.mass_kg"), "131 kg", bar, Mark(60.0, 50.0, 70.0))],
    )
    blocks: list[Block] = [
        Heading("A heading"),
        Note("a note"),
        Code("ehsid gap"),
        Items(["first", Tagged("second", "serious")], numbered=True),
        Facts([Fact("How far", "93 %", "of the gap")]),
        Link("the report", "a%20b/report.html"),
        Bars("shares", [bar]),
        Timeline("run", "share over time", "0 s", "4 s", [Column(0.0, 50.0, 100.0, "0 to 2 s")]),
        Beside([["left"], [Card("A card", ["inside"])]]),
        table,
    ]
    found = read(render_page(Page("T", ["lead"], [Section("S", blocks)], summary=["summary"])))
    text = " ".join(found.words)
    for words in (
        *("A heading", "a note", "ehsid gap", "second", "serious", "93 %", "of the gap", "valve"),
        *("20 to 40 %", "run", "4 s", "left", "A card", "inside", "mass", "moved", "131 kg", "+3"),
        *("lead", "summary", "How far", "the report"),
    ):
        assert words in text
    assert "a%20b/report.html" in found.found


def test_folded_blocks_unfold_in_print() -> None:
    html = render_page(Page("T", [], [Section("S", [Folded("More", ["hidden"])])]))
    assert "<summary>More</summary>" in html
    assert "beforeprint" in html


@pytest.mark.parametrize(
    ("cell", "side"),
    [
        ("1.5", "number"),
        ("-0.2 %", "number"),
        ("≥ 97 %", "number"),
        ("1.2e-05", "number"),
        ("1,000", "number"),
        ("5 of 8", "number"),
        ("valve", "text"),
        ("26620c3de22da28e", "text"),
        ("2nd order", "text"),
        ("", "number"),
        (Tagged("valve", hint="valve"), "text"),
        (Link("press 7", "press%207/report.html"), "text"),
        (Tagged("1.5", "moved"), "number"),
        (Bar("", "30 %", 30.0), "number"),
    ],
)
def test_numbers_stand_to_the_right_and_words_to_the_left(cell: Cell, side: str) -> None:
    assert Table("", ("name", "value"), [("a", ""), ("b", cell)]).align(1) == side


def test_markdown_refuses_what_it_cannot_say() -> None:
    with pytest.raises(TypeError, match="Facts has no form in Markdown"):
        markdown(Page("T", [Facts([])], []), [])

# SPDX-License-Identifier: MIT
"""One table is shown as plain text, in a notebook, on a page and on a terminal."""

import msgspec
import pytest

from ehsid.harness.cli.console import Console, print_blocks
from ehsid.harness.show.page import (
    Code,
    Heading,
    Items,
    Note,
    Page,
    Section,
    Table,
    Tagged,
    Told,
    whole,
)
from ehsid.harness.show.rendering import html, notebook, render_page, text

TABLE = Table(
    "rig & more",
    ("value", "is", "why"),
    (("mass", "120 kg", Tagged("given", kind="good")), ("a\n<b>", "none", "a reason\x1b")),
    marked=[0],
    note="end",
)


def test_text_is_aligned() -> None:
    assert text([TABLE]).splitlines() == [
        "rig & more",
        "value       is  why",
        "------  ------  ------------",
        "mass *  120 kg  given",
        "a <b>     none  a reason\\x1b",
        "end",
    ]


def test_sentences_and_lists_stand_around_tables() -> None:
    blocks: list[Told] = ["before", TABLE, "after", Items(["one", Tagged("two")]), Note("small")]
    before, table, after = text(blocks).split("\n\n")
    assert (before, table) == ("before", text([TABLE]))
    assert after.splitlines() == ["after", "- one", "- two", "small"]


def test_a_notebook_escapes_texts_and_aligns_columns() -> None:
    shown = notebook(TABLE)
    assert "a\n&lt;b&gt;" in shown
    assert "<caption>rig &amp; more</caption>" in shown
    assert "\x1b" not in shown
    assert shown.count("<tr>") == 3
    assert shown.count("text-align:right") == 3
    assert shown.endswith("<p>end</p>")


def test_html_has_the_level_of_the_page_around_it() -> None:
    shown = html([Heading("A < B"), TABLE], heading=2)
    assert "<h2>A &lt; B</h2>" in shown
    assert '<tr class="marked"><th scope="row" class="short">mass</th>' in shown
    assert '<span class="good">given</span>' in shown
    assert '<p class="note">end</p>' in shown
    assert "\x1b" not in shown


def test_a_terminal_shows_marks_and_lines_between_rows_of_several_lines() -> None:
    console = Console(width=80)
    with console.capture() as captured:
        print_blocks(["before", TABLE], console)
    shown = captured.get()
    for words in ("before\n\n", "rig & more", "mass *", "120 kg", "a reason\\x1b", "end"):
        assert words in shown
    assert shown.count("├") == 1


@pytest.mark.parametrize("block", ["a", Heading("a"), Note("a"), Items(["a"]), TABLE])
def test_what_is_told_can_be_kept(block: Told) -> None:
    kept = msgspec.json.decode(msgspec.json.encode(block), type=Told)  # type: ignore[arg-type]
    assert html([kept]) == html([block])


def test_headings_and_sentences_keep_a_number_with_its_unit() -> None:
    page = Page(
        title="It removes 99 % of it",
        lead=["After 8 s, 505 N and 3 mm."],
        sections=[Section("At 25 Hz", [Heading("100 % of 12 bar"), Code("ehsid gap --dt 1 s")])],
    )
    shown = render_page(page)
    for kept in ("99 %", "8 s", "505 N", "3 mm", "25 Hz", "100 %", "12 bar"):
        assert kept.replace(" ", "\N{NO-BREAK SPACE}") in shown
    assert "--dt 1 s" in shown  # what is copied stays as it is
    assert whole("3 samples, 2 seconds, 4 mm/s") == "3 samples, 2 seconds, 4\N{NO-BREAK SPACE}mm/s"

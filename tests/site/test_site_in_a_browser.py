# SPDX-License-Identifier: MIT
"""The built documentation in a browser, wide and narrow: nothing is cut off or broken.

It is skipped without a browser; script/test installs one.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "build" / "site" / "html"
sys.path.insert(0, str(ROOT / "tests" / "app"))

WIDTHS = (1400, 1000, 390)
# Each has something wide: tables with many columns or long names, code, trees of folders.
PAGES = (
    "index",
    "commands",
    "layout",
    "rigs",
    "effects",
    "check/blind/README",
    "gap/development",
    "how_to/index",
    "reference/index",
    "tutorials/my_rig_in_twenty_minutes",
    "tutorials/estimator_on_my_controller",
)
# Their code is to be read as it is on a screen with both sidebars.
READ = ("index", "commands", "layout", *(page for page in PAGES if page.startswith("tutorials/")))

WIDER = """() => {
  const window_ = document.documentElement;
  return window_.scrollWidth > window_.clientWidth;
}"""
# Words that stand on two lines of a cell, of those that the site promises to keep whole.
BROKEN = r"""() => {
  const found = [];
  for (const cell of document.querySelectorAll(".bd-article table :is(td, th)")) {
    const texts = document.createTreeWalker(cell, NodeFilter.SHOW_TEXT);
    for (let text; (text = texts.nextNode());)
      for (const name of text.data.matchAll(/\S{2,24}(?!\S)/g)) {
        if (name.index && /\S/.test(text.data[name.index - 1])) continue;
        for (const word of name[0].matchAll(/[\p{L}\p{N}_]{2,}/gu)) {
          const range = document.createRange(), start = name.index + word.index;
          range.setStart(text, start);
          range.setEnd(text, start + word[0].length);
          const lines = [...range.getClientRects()].filter(at => at.width).map(at => at.top);
          if (Math.max(...lines) - Math.min(...lines) > 4) found.push(word[0]);
        }
      }
  }
  return found;
}"""
# Code and tables that go on beyond their box, and whether a reader sees that and can scroll.
BEYOND = """() => [...document.querySelectorAll(
    ".bd-article pre, .bd-article .pst-scrollable-table-container")]
  .filter(box => box.scrollWidth > box.clientWidth + 1)
  .map(box => [box.textContent.trim().slice(0, 40), box.matches(".more-right")
    && getComputedStyle(box).maskImage !== "none"
    && ["auto", "scroll"].includes(getComputedStyle(box).overflowX)])"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    from browsers import launched_browser

    with launched_browser() as made:
        yield made


@pytest.fixture
def window(browser: Any) -> Iterator[Any]:
    made = browser.new_page()
    yield made
    made.close()


def show(window: Any, page: str, width: int) -> None:
    path = SITE / f"{page}.html"
    assert path.is_file(), "the site is not built; run script/site first"
    window.set_viewport_size({"width": width, "height": 900})
    window.goto(path.as_uri())
    # What the page does at its start is drawn two frames later at the latest.
    window.evaluate("() => new Promise(f => requestAnimationFrame(() => requestAnimationFrame(f)))")


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("page", PAGES)
def test_a_page_fits_and_its_tables_break_no_words(window: Any, page: str, width: int) -> None:
    show(window, page, width)
    assert not window.evaluate(WIDER)
    assert window.evaluate(BROKEN) == []
    assert [words for words, shown in window.evaluate(BEYOND) if not shown] == []


@pytest.mark.parametrize("page", READ)
def test_code_is_whole_on_a_wide_screen(window: Any, page: str) -> None:
    show(window, page, 1400)
    assert window.evaluate(BEYOND) == []


def test_the_mark_of_what_goes_on_moves_with_it(window: Any) -> None:
    show(window, "tutorials/my_rig_in_twenty_minutes", 390)
    code = window.locator(".bd-article pre.more-right").first.element_handle()
    assert not code.evaluate("box => box.matches('.more-left')")
    code.evaluate("box => { box.scrollLeft = box.scrollWidth; }")
    window.wait_for_function("box => box.matches('.more-left:not(.more-right)')", arg=code)


def test_the_picture_of_the_first_page_is_shown_whole(window: Any) -> None:
    show(window, "index", 1400)
    shown, own = window.locator("img.picture").evaluate(
        "image => [image.width / image.height, image.naturalWidth / image.naturalHeight]"
    )
    assert shown == pytest.approx(own, rel=0.02)

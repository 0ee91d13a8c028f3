# SPDX-License-Identifier: MIT
"""Journeys through the page of a machine over months."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from urllib.error import HTTPError
from urllib.request import urlopen

import pytest
from dated_logs import write_machine
from made_history import made_history

COUNT = 3


@pytest.fixture
def history(page: Any) -> Any:
    """The page, reached as a user reaches it."""
    page.get_by_role("link", name="Machines").click()
    page.get_by_role("link", name="Begin a new history").click()
    page.get_by_role("button", name="Fit the new logs").wait_for()
    return page


def fill(page: Any, field: str, text: object) -> None:
    page.get_by_label(field).fill(str(text))
    page.get_by_label(field).press("Tab")


def test_logs_become_a_history_that_is_found_again(history: Any, tmp_path: Path) -> None:
    logs = write_machine(tmp_path / "press7", COUNT)  # it is told in a moment why none is fitted
    fill(history, "folder of dated logs", logs)
    history.get_by_role("button", name="Fit the new logs").click()
    words = f"{COUNT} of {COUNT} new logs fitted and kept."
    history.get_by_role("status").filter(has_text=words).wait_for()
    frame = history.frame_locator("iframe[title='History of press7']")
    frame.get_by_text("3 logs could not be used").first.wait_for()
    history.reload()
    assert history.get_by_label("folder of dated logs").input_value() == str(logs)
    history.get_by_role("button", name="Fit the new logs").click()
    history.get_by_role("status").filter(has_text="No log was new.").wait_for()
    history.get_by_role("link", name="Machines").click()
    history.get_by_role("link", name="press7").click()
    frame.get_by_text("3 logs could not be used").first.wait_for()


def test_what_is_missing_is_told(history: Any, tmp_path: Path) -> None:
    history.get_by_role("button", name="Fit the new logs").click()
    history.get_by_role("alert").filter(has_text="folder of dated logs: nothing is").wait_for()
    fill(history, "folder of dated logs", tmp_path)
    history.get_by_role("button", name="Fit the new logs").click()
    history.get_by_role("alert").filter(has_text="has no rig.toml").wait_for()
    history.get_by_role("button", name="Only show the history").click()
    history.get_by_role("alert").filter(has_text="folder of the history: nothing").wait_for()


@pytest.mark.parametrize("width", [390, 1400])
def test_an_earlier_history_is_shown(history: Any, served: Any, tmp_path: Path, width: int) -> None:
    made_history(tmp_path / "history")
    history.set_viewport_size({"width": width, "height": 900})
    fill(history, "folder of the history", tmp_path / "history")
    history.get_by_role("button", name="Only show the history").click()
    frame = history.frame_locator("iframe[title='History of press7']")
    frame.get_by_text("Something changed in press7.").wait_for()
    history.get_by_role("cell", name="valve dead band: overlap").first.wait_for()
    assert history.evaluate("document.documentElement.scrollWidth") <= width
    for field in ("folder of dated logs", "folder of the history"):
        box = history.get_by_label(field).bounding_box()
        assert box is not None
        assert box["x"] + box["width"] <= width
    # Nothing is served without the token, and nothing else of the folder.
    with pytest.raises(HTTPError, match="403"):
        urlopen(f"{served.root}/history-result/press7/watch.json")
    for path, status in (("press7/watch.json", 200), ("press8/watch.json", 404)):
        assert history.request.get(f"{served.root}/history-result/{path}").status == status
    outside = history.request.get(f"{served.root}/history-result/..%2Fmachine/watch.json")
    assert outside.status == 404

# SPDX-License-Identifier: MIT
"""Journeys through the page of all machines."""

from __future__ import annotations

import re
from typing import Any

import pytest
from app_diagnosed import diagnosed_session


@pytest.fixture
def machines(page: Any, served: Any) -> Any:
    """The page, with three machines: `machine` was begun by opening the workbench."""
    diagnosed_session(served.folder / "press", "effects")
    diagnosed_session(served.folder / "axis", "ambiguous")
    page.get_by_role("link", name="Machines").click()
    page.get_by_role("link", name="press").wait_for()
    return page


def names(page: Any) -> list[str]:
    return page.locator("td[data-label=machine]").all_text_contents()


def test_machines_are_sorted_by_a_click_and_opened(machines: Any) -> None:
    machines.locator("button.sort").first.click()
    assert names(machines) == ["axis", "machine", "press"]
    machines.locator("button.sort").first.press("Enter")
    assert names(machines) == ["press", "machine", "axis"]
    # What is not known stands last in both orders.
    for _ in range(2):
        machines.get_by_role("button", name="gap before").click()
        assert names(machines)[2] == "machine"
    machines.get_by_role("link", name="press").click()
    machines.wait_for_url(re.compile("session=press"))
    machines.get_by_role("heading", name="Next", level=1).wait_for()


def test_a_machine_is_renamed_and_the_order_stays(machines: Any, served: Any) -> None:
    machines.locator("button.sort").first.click()
    machines.get_by_label("machine", exact=True).select_option("press")
    machines.get_by_label("new name").fill("Achse 9")
    machines.get_by_label("new name").press("Tab")
    machines.get_by_role("button", name="Rename").click()
    machines.get_by_role("status").filter(has_text="press is now called Achse_9").wait_for()
    machines.get_by_role("link", name="Achse_9").wait_for()
    assert names(machines) == ["Achse_9", "axis", "machine"]
    assert (served.folder / "Achse_9" / "session.toml").exists()


def test_a_name_that_is_taken_is_refused_in_words(machines: Any, served: Any) -> None:
    machines.get_by_label("machine", exact=True).select_option("press")
    machines.get_by_label("new name").fill("axis")
    machines.get_by_label("new name").press("Tab")
    machines.get_by_role("button", name="Rename").click()
    machines.get_by_role("alert").filter(has_text="choose another name").wait_for()
    assert (served.folder / "press").is_dir()


def test_a_machine_is_removed_after_one_question_and_nothing_is_lost(
    machines: Any, served: Any
) -> None:
    machines.get_by_label("machine", exact=True).select_option("press")
    machines.get_by_role("button", name="Remove", exact=True).click()
    machines.get_by_role("button", name="Keep it").click()
    machines.get_by_role("button", name="Remove", exact=True).click()
    machines.get_by_role("button", name="Yes, remove it").click()
    machines.get_by_role("status").filter(has_text="press is removed").wait_for()
    machines.get_by_role("link", name="press").wait_for(state="detached")
    assert (served.folder / "removed" / "press" / "gap" / "report.html").exists()


def test_a_machine_that_has_gone_is_told(machines: Any, served: Any) -> None:
    machines.get_by_label("machine", exact=True).select_option("press")
    machines.get_by_role("button", name="Remove", exact=True).click()
    (served.folder / "press").rename(served.folder / ".press")
    machines.get_by_role("button", name="Yes, remove it").click()
    machines.get_by_text("there is no such machine any more").wait_for()


def test_a_machine_that_cannot_be_opened_is_told_beside_the_others(page: Any, served: Any) -> None:
    (served.folder / "later").mkdir()
    (served.folder / "later" / "session.toml").write_text("version = 99\n")
    page.goto(f"{served.root}/?session=later")
    page.get_by_role("alert").get_by_text("has version 99").wait_for()
    page.get_by_role("link", name="machine", exact=True).wait_for()


@pytest.mark.parametrize("width", [390, 1400])
def test_the_table_is_not_wider_than_the_window(machines: Any, width: int) -> None:
    machines.set_viewport_size({"width": width, "height": 844})
    machines.wait_for_timeout(300)
    assert machines.evaluate("document.documentElement.scrollWidth") <= width
    box = machines.get_by_role("link", name="press").bounding_box()
    assert box is not None
    assert box["x"] + box["width"] <= width

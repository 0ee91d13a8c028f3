# SPDX-License-Identifier: MIT
"""Journeys through the playground: effects that are seen, and one that is hidden."""

from __future__ import annotations

import os
import re
import signal
from typing import Any

import pytest
from app_diagnosed import diagnosed_session
from app_sessions import BENCH
from served_workbench import children

from ehsid.harness.rigs import read_rig
from ehsid.workbench.lesson import candidates, truth


@pytest.fixture
def playground(page: Any) -> Any:
    page.get_by_role("link", name="Playground").click()
    page.get_by_role("heading", name="Playground", level=1).wait_for()
    page.get_by_text("Switch an effect on").wait_for()
    return page


def switch(page: Any, effect: str) -> Any:
    box = page.get_by_role("checkbox", name=effect, exact=True)
    box.check()
    return box


def test_an_effect_is_switched_on_and_moved_by_keyboard(playground: Any) -> None:
    box = switch(playground, "Valve dead band")
    playground.get_by_text("overlap: 0.03 (0 to 0.3)").wait_for()
    playground.get_by_text(re.compile(r"4 s of motion, simulated in \d+ ms")).wait_for()
    playground.locator(".noUi-handle").nth(1).focus()
    playground.keyboard.press("ArrowRight")
    playground.get_by_text("overlap: 0.0375 (0 to 0.3)").wait_for()
    box.uncheck()
    playground.get_by_text("Switch an effect on").wait_for()
    assert playground.get_by_text("overlap:").count() == 0


def test_another_rig_has_the_effects_of_its_plant(playground: Any) -> None:
    assert playground.get_by_role("checkbox", name="Valve lag").count() == 1
    playground.get_by_label("rig").select_option("a motor-driven axis of usual size")
    playground.get_by_role("checkbox", name="Valve lag").wait_for(state="detached")
    switch(playground, "Coulomb friction")
    playground.get_by_text(re.compile("simulated in")).wait_for()


def test_sizes_that_contradict_each_other_are_told_in_words(playground: Any) -> None:
    switch(playground, "Stribeck friction")
    playground.get_by_text("force at rest: 600 N").wait_for()
    playground.locator(".noUi-handle").nth(2).focus()
    playground.keyboard.press("Home")
    playground.get_by_role("alert").filter(has_text="static").wait_for()
    playground.keyboard.press("End")
    playground.get_by_role("alert").wait_for(state="detached")


def test_a_rig_file_that_is_damaged_is_told_and_the_page_stays(page: Any, served: Any) -> None:
    (served.folder / "machine" / "rig.toml").write_text("plant = 'none'")
    page.goto(f"{served.root}/playground?theme=light")
    page.get_by_label("rig").select_option("rig of machine")
    page.get_by_role("alert").filter(has_text="plant").wait_for()
    page.get_by_label("rig").select_option("a servo of usual size")
    page.get_by_role("alert").wait_for(state="detached")
    assert "Traceback" not in page.content()


def test_a_lesson_that_is_damaged_is_told_and_the_rest_works(page: Any, served: Any) -> None:
    folder = served.folder / "lesson"
    folder.mkdir()
    (folder / "lesson.json").write_text('{"seed": 7}')
    (folder / "session.toml").write_text("records = 3")
    page.goto(f"{served.root}/playground?theme=light")
    page.get_by_role("alert").filter(has_text="not the file of a session").wait_for()
    switch(page, "Load force")
    page.get_by_text(re.compile("simulated in")).wait_for()


def hide(page: Any) -> None:
    page.get_by_role("button", name="Hide an effect").click()
    page.get_by_role("button", name="Guess, and start the diagnosis").wait_for(timeout=120_000)


def test_an_effect_is_hidden_guessed_and_its_diagnosis_is_cancelled(
    playground: Any, served: Any
) -> None:
    hide(playground)
    told = playground.get_by_text("an effect is hidden in this machine")
    folder = served.folder / told.locator("b").inner_text()
    assert len(list((folder / "records").glob("*.parquet"))) == 3
    options = playground.get_by_label("your guess").locator("option").all_text_contents()
    assert len(options) == 1 + len(candidates(read_rig(folder / "rig.toml")))
    playground.get_by_label("your guess").select_option("Load force")
    playground.get_by_role("button", name="Guess, and start the diagnosis").click()
    playground.get_by_role("button", name="Cancel").click()
    playground.get_by_text("Cancelled. Earlier results are unchanged.").wait_for()
    playground.get_by_role("button", name="Start the diagnosis again").wait_for()
    assert '"guess": "load_force"' in (folder / "lesson.json").read_text()
    # Its records are seen as those of any machine.
    with playground.context.expect_page() as opened:
        playground.get_by_role("link", name="Look at its records").click()
    opened.value.get_by_role("heading", name="Map", level=1).wait_for()


def test_guess_diagnosis_and_truth_are_shown_after_a_reload(page: Any, served: Any) -> None:
    session = diagnosed_session(served.folder / "lesson", "effects")
    effect = truth(read_rig(BENCH), 7)[0]
    (session.folder / "lesson.json").write_text(f'{{"seed": 7, "guess": "{effect}"}}')
    page.goto(f"{served.root}/playground?theme=light")
    page.get_by_text("Seed of this lesson: 7.").wait_for()
    page.get_by_role("rowheader", name="the truth").wait_for()
    page.get_by_role("cell", name=re.compile("^✓ ")).first.wait_for()


def test_a_worker_that_is_lost_while_it_hides_is_told(playground: Any, served: Any) -> None:
    playground.get_by_role("button", name="Hide an effect").click()
    playground.get_by_text("hiding an effect:").wait_for()
    for pid in children(served.process.pid):
        os.kill(pid, signal.SIGKILL)
    playground.get_by_text("the process that did the work has ended").wait_for()
    assert playground.get_by_role("button", name="Hide an effect").is_enabled()


@pytest.mark.parametrize("width", [390, 1400])
def test_the_playground_fits_the_window(playground: Any, width: int) -> None:
    playground.set_viewport_size({"width": width, "height": 844})
    switch(playground, "Line resonance")
    playground.get_by_text("volume: ").wait_for()
    assert playground.evaluate("document.documentElement.scrollWidth") <= width
    if width == 1400:  # plots and controls side by side
        assert playground.evaluate("document.documentElement.scrollHeight") <= 844

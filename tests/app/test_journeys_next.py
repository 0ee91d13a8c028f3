# SPDX-License-Identifier: MIT
"""Journeys through the step Next: experiment, rig, firmware header, archive."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path
from typing import Any

import pytest
from app_diagnosed import diagnosed_session
from app_sessions import BENCH
from browsers import press, see
from page_checks import SCROLLS
from playwright.sync_api import expect

from ehsid.workbench.session import Session


@pytest.fixture
def session(page: Any, served: Any) -> Session:
    """The session that the page shows, at the step Next."""
    made = diagnosed_session(served.folder / "press", seconds=3.0)
    page.goto(f"{served.root}/?session=press&step=next&theme=light")
    page.get_by_role("heading", name="Next", level=1).wait_for()
    return made


def downloaded(page: Any, link: str) -> bytes:
    with page.expect_download() as waiting:
        page.get_by_role("link", name=link).click()
    return Path(waiting.value.path()).read_bytes()


def test_the_experiment_is_told_drawn_and_downloaded(page: Any, session: Session) -> None:
    see(page, "What to do now")
    see(page, re.compile("It is made to separate Coulomb friction from"))
    see(page, re.compile("keep the emergency stop at hand"))
    page.locator("canvas").first.wait_for()
    content = downloaded(page, "Download next_experiment.csv")
    assert content == (session.folder / "gap" / "next_experiment.csv").read_bytes()
    assert content.startswith(b"time_s,command_v")


def test_the_rig_that_was_found_becomes_that_of_the_machine(page: Any, session: Session) -> None:
    press(page, "The rig as found")
    page.get_by_role("rowheader", name="Coulomb friction: force").wait_for()
    found = downloaded(page, "Download rig.augmented.toml")
    press(page, "Use it as the rig of this machine")
    see(page, "the one before is kept as rig.before.toml")
    page.get_by_role("heading", name="Rig", level=1).wait_for()
    assert session.rig_file.read_bytes() == found
    assert (session.folder / "rig.before.toml").read_bytes() == BENCH.read_bytes()
    assert page.get_by_role("button", name="7 Next").is_disabled()


def test_a_new_machine_begins_with_the_rig_that_was_found(page: Any, session: Session) -> None:
    press(page, "The rig as found")
    press(page, "Begin a new machine with it")
    page.get_by_role("link", name="Open it").click()
    page.wait_for_url(re.compile("session=press_found"))
    see(page, "there is no record yet")
    assert session.rig_file.read_bytes() == BENCH.read_bytes()


def test_a_header_is_made_and_a_name_that_is_none_is_refused(page: Any, session: Session) -> None:
    press(page, "Firmware")
    name = page.get_by_label("namespace in C++, prefix in C")
    name.fill("7 of 9")
    name.press("Tab")
    press(page, "Make the header")
    page.get_by_role("alert").filter(has_text="expected").wait_for()
    name.fill("press_7")
    name.press("Tab")
    page.get_by_label("language").select_option("C99")
    press(page, "Make the header")
    preview = page.get_by_label("Preview of the header")
    preview.filter(has_text="press_7").wait_for()
    assert page.evaluate(SCROLLS) == []
    content = downloaded(page, "Download servo_configuration.h").decode()
    assert content.strip() == preview.text_content().strip()
    page.get_by_text("The command and the Python that do the same").click()
    see(page, "--identify --name press_7 --c")


def test_a_record_that_gives_no_model_is_told_in_words(page: Any, session: Session) -> None:
    session.record_of(session.settings.records[0]).write_bytes(b"PAR1")
    press(page, "Firmware")
    press(page, "Make the header")
    page.get_by_role("alert").filter(has_text="run.parquet").wait_for()
    assert "Traceback" not in page.content()
    assert page.get_by_role("button", name="Make the header").is_enabled()


def test_everything_is_packed_and_downloaded(page: Any, session: Session, tmp_path: Path) -> None:
    press(page, "Report and archive")
    press(page, "Pack everything into one archive")
    content = downloaded(page, "Download press.zip")
    archive = tmp_path / "all.zip"
    archive.write_bytes(content)
    with zipfile.ZipFile(archive) as opened:
        assert opened.testzip() is None
        assert {"press/session.toml", "press/gap/report.html"} <= set(opened.namelist())


def test_next_stays_closed_without_a_diagnosis(page: Any, served: Any) -> None:
    made = diagnosed_session(served.folder / "press")
    (made.folder / "gap" / "diagnosis.json").unlink()
    page.goto(f"{served.root}/?session=press&step=next&theme=light")
    page.get_by_role("heading", name="Gap", level=1).wait_for()
    assert page.get_by_role("button", name="7 Next").is_disabled()
    see(page, "Next opens when this step holds: it was not run yet.")


def test_the_controller_gets_tables_and_gains_from_calm_to_fast(
    page: Any, session: Session
) -> None:
    press(page, "Controller")
    calm = page.get_by_role("row", name=re.compile("^P ")).inner_text()
    handle = page.locator(".noUi-handle").first
    handle.focus()
    handle.press("ArrowRight")
    expect(page.get_by_role("row", name=re.compile("^P "))).not_to_have_text(calm)
    press(page, "Make the files for the controller")
    assert downloaded(page, "apply_twincat.st").startswith(b"// Made by ehsid")
    assert (session.folder / "apply" / "apply.html").is_file()


@pytest.mark.parametrize("width", [390, 1400])
def test_each_sheet_fits_the_window(page: Any, session: Session, width: int) -> None:
    assert session.rig_file.exists()
    page.set_viewport_size({"width": width, "height": 900})
    for sheet in ("The rig as found", "Controller", "Firmware", "Report and archive", "What to do"):
        press(page, sheet)
        page.locator("body:not(.busy)").wait_for()
        page.wait_for_timeout(300)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, sheet
        assert width < 1400 or page.evaluate(SCROLLS) == [], sheet

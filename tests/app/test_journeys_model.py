# SPDX-License-Identifier: MIT
"""Journeys through the step Model. One workbench serves all, each with a session of its own."""

from __future__ import annotations

import os
import re
import shutil
import signal
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from app_sessions import BENCH, german_log, read_session
from browsers import press, see, sound_page
from page_checks import SCROLLS
from served_workbench import Served, children

from ehsid.harness.records import make_record, write_record
from ehsid.workbench.jobs import check_task
from ehsid.workbench.session import Session

MANY = ("2-50", "1-60")  # orders and delays whose search takes minutes


def checked(session: Session) -> Session:
    """Return the session with a rig and a check that holds."""
    session.rig_file.write_bytes(BENCH.read_bytes())
    session.save()
    check_task(session.folder, report=lambda share: None)
    session.settings.made_of["check"] = session.digest(rig=True)
    session.save()
    return session


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory, browser: Any) -> Iterator[Served]:
    top = tmp_path_factory.mktemp("journeys_model")
    checked(read_session(top / "made", german_log(top / "run.csv", 3.0)))
    (top / "machines").mkdir()
    made = Served(top / "machines")
    yield made
    made.stop()
    assert "Traceback" not in made.log.read_text()


@pytest.fixture
def machine(served: Served) -> Session:
    """A session in which the step Model is open."""
    name = f"press_{len(list(served.folder.iterdir()))}"
    shutil.copytree(served.folder.parent / "made", served.folder / name)
    return Session(served.folder / name)


@pytest.fixture
def page(served: Served, browser: Any, machine: Session) -> Iterator[Any]:
    with sound_page(browser) as made:
        made.goto(served.address)
        made.get_by_role("link", name="colours").wait_for()
        reach(made, served, machine)
        yield made
    assert not (machine.folder / "errors.log").exists()


def reach(page: Any, served: Served, machine: Session, step: str = "model") -> None:
    page.goto(f"{served.root}/?theme=light&session={machine.name}&step={step}")
    page.get_by_role("heading", name=step.capitalize(), level=1).wait_for()


def fill(page: Any, label: str, text: str) -> None:
    field = page.get_by_label(label, exact=True)
    field.fill(text)
    field.press("Tab")


def kept(machine: Session) -> Any:
    """Return the choices as they are in the file."""
    return Session(machine.folder).settings.model


# Of a linear model, each with what it shows.
SHEETS = {
    "Servo": "Velocity gain",
    "Frequencies": "Frequency response",
    "Residual": "Ljung-Box",
    "Orders": "Orders tried",
    "Reasons": "Why this one",
    "Poles": "Poles and zeros",
}


def test_a_model_is_identified_and_the_estimator_takes_its_orders(
    page: Any, machine: Session
) -> None:
    press(page, "Identify")
    see(page, re.compile(r"na = nb = \d, nk = \d, offset; on the validation half"))
    for sheet, words in SHEETS.items():
        press(page, sheet)
        see(page, words)
    page.get_by_role("button", name="5 Model ✓").wait_for()
    page.get_by_role("button", name="Next: Gap").wait_for()
    found = page.locator(".verdict").first.inner_text()
    order, delay = re.findall(r"nb = (\d+), nk = (\d+)", found)[0]
    choice = kept(machine)
    assert (choice.na, choice.nb, choice.nk) == (int(order), int(order), int(delay))
    assert page.get_by_label("nk", exact=True).input_value() == delay
    fetch = "async (path) => (await fetch(path)).status"
    for name in ("identify.json", "identify.png", "identify_bode.png"):
        assert page.evaluate(fetch, f"/result/{machine.name}/model/{name}") == 200


def test_the_step_may_be_left_out(page: Any, served: Served, machine: Session) -> None:
    reach(page, served, machine, "check")
    press(page, "Next: Gap, without Model")
    page.get_by_role("heading", name="Gap", level=1).wait_for()
    press(page, "5 Model")
    press(page, "Next: Gap")
    page.get_by_role("heading", name="Gap", level=1).wait_for()


def test_the_estimate_follows_a_slider_and_the_choice_stays(page: Any, machine: Session) -> None:
    press(page, "Recursive")
    figures = page.get_by_text(re.compile(r"RMSE \d"))
    handle = page.get_by_role("slider").first
    for shown in ("0.985", "0.98", "0.97"):
        before = figures.inner_text()
        handle.press("ArrowLeft")
        see(page, f"lambda0: {shown}")
        page.get_by_text(before).wait_for(state="detached")
    changed = figures.inner_text()
    page.reload()
    press(page, "Recursive")
    see(page, "lambda0: 0.97")
    see(page, changed)
    assert kept(machine).settings == {"lambda0": 0.97}


def test_a_recursion_offers_only_the_policies_that_it_takes(page: Any, machine: Session) -> None:
    press(page, "Recursive")
    page.get_by_label("forgetting policy").select_option("f-ratio")
    see(page, "critical_ratio: 3.3")
    see(page, "forgets where recent errors")
    page.get_by_label("recursion").select_option("riv: instrumental variables")
    see(page, "riv is right with noise of the position sensor")
    see(page, "lambda_initial: 0.95")
    offered = page.get_by_label("forgetting policy").locator("option").all_inner_texts()
    assert offered == ["constant", "exponential"]
    press(page, "Remarks")
    see(page, "offset")
    assert (kept(machine).method, kept(machine).policy) == ("riv", "exponential")


def test_the_files_of_an_estimate_are_written_as_the_command_shows(
    page: Any, machine: Session
) -> None:
    press(page, "Recursive")
    page.get_by_label("reset", exact=True).select_option("never")
    page.get_by_label("na", exact=True).select_option("2")
    see(page, "What would help on this record is tried")
    press(page, "At the end")
    press(page, "Write estimate.json and its figure")
    page.get_by_role("link", name="estimate.json").wait_for()
    see(page, "What to try:")
    assert (machine.folder / "model" / "estimate.png").exists()
    page.get_by_text("The command and the Python that do the same").click()
    see(
        page,
        re.compile(r"ehsid estimate records/run.parquet .* --na 2 .* --no-reset .*--out model"),
    )


def test_orders_that_are_no_range_are_told_and_not_taken(page: Any, machine: Session) -> None:
    fill(page, "orders to try", "5-2")
    see(page, "expected a number or a range such as 2-5, at most 50")
    assert kept(machine).orders == "2-5"
    fill(page, "orders to try", "2-3")
    page.get_by_text("expected a number or a range").wait_for(state="detached")
    press(page, "Identify")
    see(page, re.compile(r"nb = [23], nk = \d, offset; on the validation half"))
    press(page, "Orders")
    three, five = (page.get_by_role("rowheader", name=re.compile(rf"^{n}( \*)?$")) for n in (3, 5))
    three.first.wait_for()
    assert five.count() == 0


# The names in the legends of all plots, which are drawn on canvases.
LEGENDS = """() => {
  const found = [];
  const walk = view => {
    if (view.model?.type === "Legend") found.push(...view.model.items.map(one => one.label.value));
    for (const child of view.children ? view.children() : []) walk(child);
  };
  for (const root of globalThis.Bokeh?.index.roots ?? []) walk(root);
  return found;
}"""


def test_models_that_were_found_are_compared(page: Any, served: Served, machine: Session) -> None:
    for order in ("2", "3"):
        fill(page, "orders to try", order)
        press(page, "Identify")
        see(page, re.compile(rf"na = nb = {order}, nk = \d, offset; on the validation half"))
    see(page, "Models found so far")
    assert "model 1" not in page.evaluate(LEGENDS)
    page.get_by_label("model 1", exact=True).check()
    drawn = f"({LEGENDS})().filter(name => name === 'model 1').length === 3"
    page.wait_for_function(drawn)  # over time, over the frequency, and in the z plane
    press(page, "Poles")
    see(page, "Poles and zeros of model 2")
    reach(page, served, machine)
    page.wait_for_function(drawn)
    assert page.get_by_label("model 1", exact=True).is_checked()
    assert page.evaluate("document.documentElement.scrollWidth") <= 1400
    page.get_by_label("model 1", exact=True).uncheck()
    page.wait_for_function(f"!({LEGENDS})().includes('model 1')")
    assert kept(machine).beside == []


def long_search(page: Any) -> None:
    fill(page, "orders to try", MANY[0])
    fill(page, "delays to try, in samples", MANY[1])
    press(page, "Identify")
    see(page, re.compile("identifying a model: .* so far"))


def test_an_identification_is_cancelled(page: Any, machine: Session) -> None:
    long_search(page)
    page.reload()
    see(page, re.compile("identifying a model: .* so far"))
    press(page, "Cancel")
    see(page, "Cancelled. Earlier results are unchanged.")
    assert page.get_by_role("button", name="Identify").is_enabled()
    assert not (machine.folder / "model" / "identify.json").exists()


def test_a_lost_worker_is_told_in_words(page: Any, served: Served) -> None:
    long_search(page)
    for pid in children(served.process.pid):
        os.kill(pid, signal.SIGKILL)
    see(page, "the process that did the work has ended")
    assert page.get_by_role("button", name="Identify").is_enabled()


def replaced(machine: Session, samples: int) -> None:
    """Put a record of white noise with so many samples in place of the record."""
    rng = np.random.default_rng(1)
    u = rng.normal(size=samples)
    columns = {
        "time_s": 1e-3 * np.arange(samples),
        "command_v": u,
        "position_m": 1e-5 * np.cumsum(u) + 1e-6 * rng.normal(size=samples),
    }
    write_record(make_record(columns), machine.record_of(machine.settings.records[0]))


def test_a_record_that_is_too_short_is_told(page: Any, served: Served, machine: Session) -> None:
    replaced(machine, 40)
    press(page, "Identify")
    see(page, re.compile("expected at least .* record longer"))
    press(page, "Recursive")
    page.get_by_label("na", exact=True).select_option("4")
    page.reload()
    press(page, "Recursive")
    see(page, re.compile("expected more than .* record longer, or take lower orders"))


@pytest.mark.parametrize("width", [390, 1400])
def test_each_sheet_fits_the_window(page: Any, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 900})
    press(page, "Identify")
    see(page, "on the validation half")
    for sheet in (*SHEETS, "Recursive", "Signals", "Remarks", "At the end"):
        press(page, sheet)
        page.locator("body:not(.busy)").wait_for()
        if sheet == "Recursive":
            page.get_by_label("recursion").select_option("riv: instrumental variables")
            see(page, "riv is right with")
        page.wait_for_timeout(300)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, sheet
        assert width < 1400 or page.evaluate(SCROLLS) == [], sheet

# SPDX-License-Identifier: MIT
"""Journeys through the page Live: runs on a target in Python, on none, and on the emulator."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import socket
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import hil_firmware
import pytest
from browsers import see, sound_page
from estimating_target import EstimatingTarget
from hil_target import FakeDevice
from served_workbench import Served, children, found_browser

from ehsid.hil.faults import Relay, relayed
from ehsid.workbench.live.watching import RingReader

Error = pytest.importorskip("playwright.sync_api").Error
BEGUN = "The run goes on. Target: fake"


@pytest.fixture(scope="module")
def live(tmp_path_factory: pytest.TempPathFactory, browser: Any) -> Iterator[Served]:
    """One workbench for all journeys of this file; each fills in what it needs."""
    made = Served(tmp_path_factory.mktemp("live") / "machines")
    yield made
    made.stop()
    assert "Traceback" not in made.log.read_text()


@pytest.fixture
def page(live: Served, browser: Any) -> Iterator[Any]:
    with sound_page(browser, 30_000) as made:
        made.goto(live.address)
        made.get_by_role("link", name="Live", exact=True).click()
        made.get_by_role("heading", name="Live", level=1).wait_for()
        yield made
        stop = made.get_by_role("button", name="Stop")
        with suppress(Error):  # the run ends by itself where its target has gone before
            if stop.is_visible():
                stop.click(timeout=2_000)
        made.get_by_role("button", name="Start", exact=True).or_(
            made.get_by_role("heading", name="Load", level=1)
        ).wait_for()


@pytest.fixture
def target() -> Iterator[Relay]:
    with relayed(FakeDevice(EstimatingTarget())) as relay:
        yield relay


def press(page: Any, name: str) -> None:
    page.get_by_role("button", name=name, exact=True).click()


def ordinary(page: Any, seconds: str = "200") -> None:
    """Fill in what makes sense, whatever was chosen before."""
    page.get_by_label("rig", exact=True).select_option("published experiment")
    page.get_by_label("loop", exact=True).select_option("open loop")
    page.get_by_label("duration in s").fill(seconds)
    page.get_by_label("sampling time in ms").fill("20")
    page.get_by_label("amplitude in V").fill("")


def start(page: Any, address: str, seconds: str = "200", *, real_time: bool = True) -> None:
    page.get_by_label("target", exact=True).select_option("serial port or address")
    page.get_by_label("serial port or address", exact=True).fill(address)
    ordinary(page, seconds)
    pace = "in real time" if real_time else "as fast as it goes"
    page.get_by_label("pace", exact=True).select_option(pace)
    press(page, "Start")


def newest(live: Served) -> Path:
    """Return the folder of the newest run."""
    runs = (live.folder / "_live").glob("run_*")
    return max(runs, key=lambda path: int(path.name.removeprefix("run_")))


def result(live: Served) -> dict[str, Any]:
    return json.loads((newest(live) / "hil" / "hil.json").read_text())


def test_one_click_moves_a_servo_and_its_sliders_are_heard(page: Any, live: Served) -> None:
    """The first journey: nothing was chosen before. All fits one screen, at rest and at work."""
    height = "document.documentElement.scrollHeight"
    assert page.evaluate(height) <= 900
    press(page, "Start")
    see(page, "The run goes on. Target: this computer")
    page.locator(".noUi-handle").first.focus()
    page.keyboard.press("End")
    see(page, "Valve dead band: overlap: 0.3 ")
    see(page, re.compile("The machine: valve dead band: overlap 30.% of rated command"))
    see(page, "Parameters of the estimated model")
    assert page.evaluate(height) <= 900
    other = page.context.new_page()  # begins with the machine as it is
    other.goto(page.url)
    see(other, "Valve dead band: overlap: 0.3 ")
    other.close()
    press(page, "Stop")
    see(page, "bit for bit those of this host")
    assert page.evaluate(height) <= 900
    settings = json.loads((newest(live) / "settings.json").read_text())
    assert (settings["target"], settings["effects"]) == ("here", "")


def test_a_run_to_its_end_and_a_machine_of_its_record(
    page: Any, live: Served, target: Relay
) -> None:
    start(page, target.port, "4", real_time=False)
    see(page, "200 samples. The estimates of the target are bit for bit those of this host.")
    names = {path.name for path in (newest(live) / "hil").iterdir()}
    assert {"record.csv", "estimates.csv", "hil.html", "hil.json"} <= names
    with page.expect_popup() as popup:
        page.get_by_role("link", name="hil.html").click()
    popup.value.get_by_text("Estimates on the target").first.wait_for()
    page.get_by_text("The command and the Python that do the same").click()
    see(page, f"ehsid hil --port {target.port}")
    press(page, "Make a machine of this record")
    page.wait_for_url(re.compile("session=machine"))
    see(page, "8 columns, 200 rows")
    see(page, "3 Rig ✓")


def test_a_run_survives_a_reload_and_every_page_shows_it(
    page: Any, live: Served, target: Relay
) -> None:
    start(page, target.port)
    see(page, BEGUN)
    page.reload()
    see(page, BEGUN)
    other = page.context.new_page()
    other.goto(page.url)
    see(other, BEGUN)
    see(other, "Parameters of the estimated model")
    press(other, "Stop")
    see(page, "bit for bit those of this host")
    other.close()
    assert 0 < result(live)["runs"][0]["samples"] < 10_000


def test_the_estimator_begins_anew_and_goes_on_from_a_snapshot(
    page: Any, live: Served, target: Relay
) -> None:
    start(page, target.port)
    press(page, "Store a snapshot")
    see(page, re.compile("The estimate is stored as snapshots/1_at_"))
    press(page, "Let the estimator begin anew")
    see(page, "The estimator begins anew.")
    press(page, "Go on from this snapshot")
    see(page, re.compile("The estimator goes on from 1_at_"))
    press(page, "Stop")
    see(page, "bit for bit those of this host")
    assert len(result(live)["runs"][0]["estimator_begun_before_samples"]) == 2
    (stored,) = (newest(live) / "snapshots").iterdir()
    assert page.get_by_role("link", name=stored.name).is_visible()


def test_faults_of_the_line_are_counted_and_corrected(
    page: Any, live: Served, target: Relay
) -> None:
    start(page, target.port)
    press(page, "Lose a frame")
    see(page, "Fault: Lose a frame, on the way to target.")
    page.get_by_label("where the fault comes").select_option("on the way to the host")
    press(page, "Damage a bit")
    see(page, "Fault: Damage a bit, on the way to host.")
    press(page, "Delay by 1 s")
    see(page, "Fault: Delay by 1 s, on the way to host.")
    assert not page.get_by_role("button", name="Reset the board").is_visible()
    press(page, "Stop")
    see(page, "bit for bit those of this host")
    line = result(live)["runs"][0]["line"]
    assert line["asked_again"] >= 3
    assert line["bad_frames"] == 1


def test_a_target_that_does_not_answer(page: Any) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        start(page, f"socket://127.0.0.1:{silent.getsockname()[1]}")
        see(page, "is the target powered and the firmware of examples/firmware/servo on it?")
    assert page.get_by_role("button", name="Start", exact=True).is_visible()


def test_a_run_is_stopped_while_it_waits_for_the_target(page: Any) -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        start(page, f"socket://127.0.0.1:{silent.getsockname()[1]}")
        see(page, "The target is asked who it is.")
        press(page, "Stop")
        see(page, "The run was stopped before its first sample.")


def test_a_target_that_goes_away_leaves_the_samples(page: Any, live: Served) -> None:
    with relayed(FakeDevice(EstimatingTarget())) as relay:
        start(page, relay.port)
        page.get_by_role("button", name="Store a snapshot").wait_for()
    see(page, re.compile(r"the line was closed.*holds the \d+ samples before"))
    see(page, "This run did not come to its end.")
    assert list((newest(live) / "hil").glob("unfinished_1/record.csv"))


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"serial port or address": "/dev/no-such-port"}, "there is no such port"),
        ({"duration in s": "soon"}, "duration: 'soon': expected a number above 0, in s"),
        ({"amplitude in V": "11"}, "amplitude 11: expected at most the rated command, 10 V"),
        ({"rig": "another rig file"}, "path of the rig file: nothing is given"),
    ],
)
def test_what_is_wrong_in_the_form_is_told(page: Any, fields: dict[str, str], says: str) -> None:
    ordinary(page, "4")
    page.get_by_label("target", exact=True).select_option("serial port or address")
    page.get_by_label("serial port or address", exact=True).fill("loop://")
    for name, text in fields.items():
        field = page.get_by_label(name, exact=True)
        if name == "rig":
            field.select_option(text)
            page.get_by_label("path of the rig file").fill("")
        else:
            field.fill(text)
    press(page, "Start")
    see(page, says)
    page.get_by_role("button", name="Start", exact=True).wait_for()


def test_an_image_that_is_none_is_told(page: Any, tmp_path: Path) -> None:
    image = tmp_path / "notes.elf"
    image.write_text("hello")
    ordinary(page)
    page.get_by_label("target", exact=True).select_option("firmware in QEMU")
    page.get_by_label("firmware image, an ELF file").fill(str(image))
    press(page, "Start")
    see(page, re.compile("not an ELF file for ARM|qemu-system-arm is not installed"))


def test_a_lost_worker_is_told_in_words(page: Any, live: Served, target: Relay) -> None:
    start(page, target.port)
    see(page, BEGUN)
    for pid in children(live.process.pid):
        os.kill(pid, signal.SIGKILL)
    see(page, "the process that did the work has ended")
    start(page, target.port, "2", real_time=False)
    see(page, "100 samples. The estimates of the target are bit for bit")


@pytest.mark.parametrize("width", [390, 1400])
def test_the_page_is_not_wider_than_the_window(page: Any, target: Relay, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 844})
    fits = f"document.documentElement.scrollWidth <= {width}"
    page.wait_for_function(fits)  # what was laid out for the window before takes a moment
    start(page, target.port)
    page.get_by_role("button", name="Store a snapshot").wait_for()
    see(page, "Parameters of the estimated model")
    page.wait_for_function(fits)


def test_only_results_of_runs_are_served(page: Any, target: Relay) -> None:
    start(page, target.port, "2", real_time=False)
    see(page, "100 samples.")
    fetch = "async (path) => (await fetch(path)).status"
    paths = ("run_1/settings.json", "run_1/hil/..%2Fstatus.json", "run_1/hil/.ehsid%2Fhil.json")
    for path in paths:
        assert page.evaluate(fetch, f"/live-result/{path}") == 404, path


def test_the_end_of_the_program_keeps_the_samples(tmp_path: Path, browser: Any) -> None:
    assert found_browser() is not None
    served = Served(tmp_path / "machines")
    with relayed(FakeDevice(EstimatingTarget())) as relay:
        page = browser.new_page()
        page.set_default_timeout(30_000)
        page.goto(served.address)
        page.get_by_role("link", name="Live", exact=True).click()
        start(page, relay.port)
        page.get_by_role("button", name="Store a snapshot").wait_for()
        workers = children(served.process.pid)
        page.close()
        served.stop()
    for pid in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    assert RingReader(newest(served) / "samples.npy").count > 0
    assert list((newest(served) / "hil").rglob("record.csv"))


def test_the_firmware_in_qemu_and_a_reset_of_its_board(page: Any, live: Served) -> None:
    if shutil.which("qemu-system-arm") is None:
        pytest.skip("no qemu-system-arm: the firmware is not run on the emulated Cortex-M")
    if not hil_firmware.ON_TARGET.exists():
        pytest.skip(
            "no firmware for the Cortex-M; build it: cmake --preset arm && "
            "cmake --build --preset arm"
        )
    page.get_by_label("target", exact=True).select_option("firmware in QEMU")
    page.get_by_label("firmware image, an ELF file").fill(str(hil_firmware.ON_TARGET))
    ordinary(page)
    press(page, "Start")
    see(page, "Target: mps2-an386")
    press(page, "Reset the board")
    see(page, "The board was reset.")
    press(page, "Store a snapshot")
    see(page, re.compile("The estimate is stored as snapshots/1_at_"))
    press(page, "Stop")
    see(page, "bit for bit those of this host")
    assert len(result(live)["runs"][0]["target_resets_before_samples"]) == 1


def test_a_run_by_keyboard_at_twice_the_size(page: Any, live: Served, target: Relay) -> None:
    """A window of half the width and height is what a page has left at 200 %."""
    page.set_viewport_size({"width": 700, "height": 450})
    page.get_by_label("target", exact=True).select_option("serial port or address")
    page.get_by_label("serial port or address", exact=True).fill(target.port)
    ordinary(page)

    def to_button(name: str) -> None:
        button = page.get_by_role("button", name=name, exact=True)
        for _ in range(60):  # more than there are on the page
            page.keyboard.press("Tab")
            if button.evaluate("one => one.getRootNode().activeElement === one"):
                return
        raise AssertionError(f"{name} is not reached by the Tab key")

    to_button("Start")
    page.keyboard.press("Enter")
    see(page, BEGUN)
    see(page, "Parameters of the estimated model")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    to_button("Stop")
    page.keyboard.press("Enter")
    see(page, "bit for bit those of this host")
    assert result(live)["runs"][0]["samples"] < 10_000

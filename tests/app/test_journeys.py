# SPDX-License-Identifier: MIT
"""Journeys through the workbench as a user takes them, in a real browser."""

from __future__ import annotations

import http.client
import os
import re
import signal
import socket
import time
import urllib.error
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from app_sessions import ANSWERS, BENCH, german_log
from browsers import press, see
from log_files import write_excel, write_mat_structure, write_mf4
from page_checks import SCROLLS
from playwright import sync_api as playwright
from served_workbench import Served, children

from ehsid.harness.rigs import read_rig
from ehsid.harness.rigs.questions import QUESTIONS
from ehsid.workbench.session import Session


def drop(page: Any, *files: Path) -> None:
    page.locator("input[type=file]").set_input_files([str(file) for file in files])


def fill_rig(page: Any, answers: dict[str, str] = ANSWERS) -> None:
    words = {one.name: one.words for one in QUESTIONS["ehs"]}
    for name, text in answers.items():
        field = page.get_by_label(words[name], exact=True)
        field.fill(text)
        field.press("Tab")


def session_of(served: Any, name: str = "machine") -> Session:
    return Session(served.folder / name)


def test_from_a_german_log_to_the_verdict(page: Any, served: Any, tmp_path: Path) -> None:
    """Six clicks, seven answers, and no file written by hand."""
    drop(page, german_log(tmp_path / "Prüfstand 7.csv", 2.5))
    press(page, "Next: Map")
    see(page, "Weg [mm]")
    see(page, "2500 samples")
    press(page, "Next: Rig")
    fill_rig(page)
    see(page, "Saved as rig.toml")
    press(page, "Next: Check")
    see(page, "Nothing in the records contradicts the rig.")
    page.locator("main canvas").nth(1).wait_for()  # the ratios, and the speeds
    press(page, "Next: Gap")
    press(page, "Start the diagnosis")
    see(page, "fitting the best effects at length")
    page.get_by_role("button", name="Sets tried").wait_for()
    assert page.evaluate(SCROLLS) == []
    see(page, "The gap is due to Coulomb friction")
    inside = page.frame_locator("iframe")
    inside.get_by_text("Measured and simulated").first.wait_for()
    press(page, "Pressure B")  # the signals, one output at a time
    page.locator("iframe").wait_for(state="hidden")
    page.locator("main canvas:visible").first.wait_for()
    assert page.evaluate(SCROLLS) == []
    assert page.get_by_role("button", name="Start the diagnosis again").is_enabled()
    assert session_of(served).settings.made_of.keys() == {"check", "gap"}


@pytest.mark.parametrize("write", [write_mf4, write_mat_structure, write_excel])
def test_a_log_of_another_kind_is_read(
    page: Any, tmp_path: Path, write: Callable[[Path], Path]
) -> None:
    path = write(tmp_path)
    drop(page, path)
    see(page, re.compile(r"\d columns, \d+ rows"))
    press(page, "Next: Map")
    see(page, re.compile(r"\d+ samples, every 1 ms|\d+ samples"))


def test_a_held_out_record_judges(page: Any, served: Any, tmp_path: Path) -> None:
    logs = [german_log(tmp_path / f"run{i}.csv", 0.5, float(i)) for i in (1, 2)]
    drop(page, *logs)
    press(page, "Next: Map")
    see(page, "500 samples")
    box = page.get_by_label("hold this record out")
    box.check()
    page.get_by_label("record", exact=True).select_option("run2")
    page.locator("input[type=checkbox]:not(:checked)").wait_for()
    box.check()
    see(page, "every record is held out; at least one has to be fitted")
    box.uncheck()
    page.get_by_role("button", name="Next: Rig").wait_for()
    assert [one.held_out for one in session_of(served).settings.records] == [True, False]


def test_a_result_counts_until_records_change(page: Any, tmp_path: Path) -> None:
    drop(page, german_log(tmp_path / "run.csv", 2.0), BENCH)
    page.get_by_role("button", name="Next: Map").wait_for()
    press(page, "3 Rig")
    press(page, "Next: Check")
    page.get_by_role("button", name="Next: Gap").wait_for()
    press(page, "1 Load")
    drop(page, german_log(tmp_path / "more.csv", 2.0, 1.0))
    page.locator("button:disabled", has_text="Gap").wait_for()
    press(page, "4 Check")
    page.get_by_label("record", exact=True).select_option("more")
    page.get_by_role("button", name="Next: Gap").wait_for()


def test_a_wrong_file_is_told_and_can_be_removed(page: Any, tmp_path: Path) -> None:
    wrong = tmp_path / "photo.mat"
    wrong.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(500))
    drop(page, wrong)
    see(page, "To fix it")
    press(page, "Remove photo")
    page.get_by_text("To fix it").wait_for(state="detached")
    see(page, "there is no record yet")
    assert page.get_by_role("button", name="2 Map").is_disabled()


def test_a_file_without_a_kind_is_told(page: Any, tmp_path: Path) -> None:
    odd = tmp_path / "notes"
    odd.write_text("hello")
    drop(page, odd)
    page.get_by_role("alert").wait_for()
    assert "Traceback" not in page.content()


def test_hostile_names_of_files_and_columns_are_only_text(
    page: Any, served: Any, tmp_path: Path
) -> None:
    evil = "<img src=x onerror=alert(1)>"
    log = tmp_path / f"{evil}.csv"
    rows = "\n".join(f"{i / 1000},{np.sin(i / 9)},{i % 5},{i % 3}" for i in range(200))
    log.write_text(f"time_s,command_v,position_m,{evil}\n{rows}\n")
    page.on("dialog", lambda dialog: pytest.fail("a script of the file ran"))
    drop(page, log)
    press(page, "Next: Map")
    see(page, "200 samples")
    assert page.locator("img[src=x]").count() == 0
    inside = [path.name for path in (served.folder / "machine" / "logs").iterdir()]
    assert len(inside) == 1
    assert "<" not in inside[0]


def test_a_path_is_added_without_a_copy(page: Any, served: Any, tmp_path: Path) -> None:
    log = german_log(tmp_path / "far.csv", 0.5)
    field = page.get_by_label("or the path of a log, a folder or a rig file on this machine")
    field.fill(str(log))
    press(page, "Add")
    page.get_by_role("button", name="Next: Map").wait_for()
    assert session_of(served).settings.records[0].file == str(log)
    field.fill(str(tmp_path / "nothing.csv"))
    press(page, "Add")
    see(page, "there is no such file or folder")


def test_a_folder_adds_its_logs(page: Any, tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    folder.mkdir()
    for number in (1, 2):
        german_log(folder / f"run{number}.csv", 0.5, number)
    (folder / "readme.pdf").write_bytes(b"%PDF")
    page.get_by_label("or the path of a log, a folder or a rig file on this machine").fill(
        str(folder)
    )
    press(page, "Add")
    see(page, "run2.csv")
    page.get_by_role("button", name="Next: Map").wait_for()
    assert page.get_by_text("readme").count() == 0


def test_a_column_is_corrected(page: Any, served: Any, tmp_path: Path) -> None:
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    press(page, "Next: Map")
    page.get_by_label("pressure A", exact=True).select_option("Druck B [bar]")
    remark = page.get_by_text("'Druck B [bar]' was named for 'pressure_a_pa'")
    remark.wait_for()
    page.get_by_label("pressure A", exact=True).select_option("as guessed")
    remark.wait_for(state="detached")
    page.get_by_role("button", name="Next: Rig").wait_for()
    assert session_of(served).settings.records[0].maps == {}


def test_a_column_is_dragged_to_its_signal(page: Any, served: Any, tmp_path: Path) -> None:
    drop(page, *(german_log(tmp_path / f"run{i}.csv", 0.5) for i in (1, 2)))
    press(page, "Next: Map")
    see(page, "It holds for run2 too")
    see(page, "500 samples")
    signal = page.locator(".target").filter(has_text="Druck A")
    page.locator(".chips li", has_text="Druck B").drag_to(signal)
    see(page, "'Druck B [bar]' was named for 'pressure_a_pa'")
    told = {"pressure_a_pa": "Druck B [bar]"}
    assert [one.maps for one in session_of(served).settings.records] == [told, told]


def test_a_sampling_time_that_is_none_is_refused(page: Any, tmp_path: Path) -> None:
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    press(page, "Next: Map")
    field = page.get_by_label("sampling time in ms (empty: as in the log)")
    field.fill("soon")
    field.press("Enter")
    see(page, "expected a number of milliseconds")
    field.fill("2")
    field.press("Enter")
    see(page, "every 2 ms")


def test_a_rig_says_what_is_missing_and_what_is_wrong(page: Any, tmp_path: Path) -> None:
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    press(page, "Next: Map")
    press(page, "Next: Rig")
    see(page, "Still needed: diameter of the piston")
    fill_rig(page, ANSWERS | {"rod": "35 bar"})
    see(page, "does not convert into m")
    assert page.get_by_role("button", name="4 Check").is_disabled()
    fill_rig(page, {"rod": "35 mm"})
    see(page, "Saved as rig.toml")


def test_a_command_in_per_cent_has_a_rated_command(page: Any, served: Any, tmp_path: Path) -> None:
    path = german_log(tmp_path / "run.csv", 0.5)
    path.write_text(path.read_text("utf-8").replace("[V]", "[%]"), encoding="utf-8")
    drop(page, path)
    press(page, "Next: Map")
    press(page, "Next: Rig")
    field = page.get_by_label("command at full opening", exact=True)
    playwright.expect(field).to_have_value("100 %")
    fill_rig(page)
    see(page, "Saved as rig.toml")
    assert read_rig(session_of(served).rig_file).values["valve.rated_command_v"] == 100.0


def test_a_rig_file_is_dropped(page: Any, served: Any, tmp_path: Path) -> None:
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    page.get_by_role("button", name="Next: Map").wait_for()
    drop(page, BENCH)
    press(page, "3 Rig")
    see(page, "is used as it is")
    assert session_of(served).rig_file.read_bytes() == BENCH.read_bytes()


def ready_for_the_gap(page: Any, tmp_path: Path) -> None:
    """A diagnosis at work: the log is long, so that it goes on for a while."""
    drop(page, german_log(tmp_path / "run.csv", 20.0), BENCH)
    page.get_by_role("button", name="Next: Map").wait_for()
    press(page, "3 Rig")
    press(page, "Next: Check")
    press(page, "Next: Gap")
    press(page, "Start the diagnosis")
    see(page, re.compile("diagnosing machine: .* so far"))


def test_a_diagnosis_survives_a_reload_and_is_cancelled(
    page: Any, served: Any, tmp_path: Path
) -> None:
    ready_for_the_gap(page, tmp_path)
    page.reload()
    see(page, re.compile("diagnosing machine: .* so far"))
    press(page, "Cancel")
    see(page, "Cancelled. Earlier results are unchanged.")
    assert not (served.folder / "machine" / "gap" / "diagnosis.json").exists()
    assert page.get_by_role("button", name="Start the diagnosis").is_enabled()


def test_a_lost_worker_is_told_in_words(page: Any, served: Any, tmp_path: Path) -> None:
    ready_for_the_gap(page, tmp_path)
    for pid in children(served.process.pid):
        os.kill(pid, signal.SIGKILL)
    see(page, "the process that did the work has ended")
    assert page.get_by_role("button", name="Start the diagnosis").is_enabled()


def test_the_end_of_the_program_ends_its_workers(page: Any, served: Any, tmp_path: Path) -> None:
    ready_for_the_gap(page, tmp_path)
    workers = children(served.process.pid)
    served.stop()
    for pid in workers:
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)


def test_two_tabs_show_the_same_session_and_do_not_disturb_each_other(
    page: Any, tmp_path: Path
) -> None:
    other = page.context.new_page()
    other.goto(page.url)
    see(other, "Drop logs here")
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    press(page, "Next: Map")
    see(other, "run.csv")
    page.get_by_role("heading", name="Map", level=1).wait_for()
    assert other.get_by_role("heading", name="Load", level=1).is_visible()


def test_machines_are_side_by_side(page: Any, served: Any, tmp_path: Path) -> None:
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    page.get_by_role("button", name="Next: Map").wait_for()
    page.get_by_role("combobox").first.select_option("+ new machine")
    page.wait_for_url(re.compile("session=machine_2"))
    see(page, "there is no record yet")
    page.get_by_role("combobox").first.select_option("machine")
    see(page, "Still needed: diameter of the piston")


def test_a_session_opens_again_in_a_new_program(
    page: Any, served: Any, tmp_path: Path, browser: Any
) -> None:
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    press(page, "Next: Map")
    see(page, "500 samples")
    served.stop()
    again = Served(served.folder)
    try:
        fresh = browser.new_context().new_page()
        fresh.goto(again.address)
        see(fresh, "Still needed")
        press(fresh, "2 Map")
        see(fresh, "500 samples")
        fresh.context.close()
    finally:
        again.stop()


def test_dark_colours_stay_over_a_reload(page: Any) -> None:
    page.get_by_text("dark colours").click()
    see(page, "light colours")
    page.reload()
    see(page, "light colours")
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert sum(map(int, re.findall(r"\d+", ground))) < 150


SHEETS = {
    "Load": ("Numbers", "Plots"),
    "Map": ("Signals that are not logged",),
    "Check": ("To be known",),
}


def test_each_step_fits_the_window(page: Any, tmp_path: Path) -> None:
    """A phone, and a window of 1400 px magnified by 200, 150, 125 and 100 %."""
    logs = [german_log(tmp_path / f"{name}.csv", 2.0, i) for i, name in enumerate(("run", "b"))]
    drop(page, *logs, BENCH)
    page.get_by_role("button", name="Next: Map").wait_for()
    for step in ("Load", "Map", "Rig", "Check"):
        page.get_by_role("button", name=re.compile(rf"\d  ?{step}")).click()
        page.get_by_role("heading", name=step, level=1).wait_for()
        for width in (390, 700, 933, 1120, 1400):
            page.set_viewport_size({"width": width, "height": 844})
            page.wait_for_timeout(300)
            assert page.evaluate("document.documentElement.scrollWidth") <= width, (step, width)
        # A wide window has the whole step.
        assert page.evaluate("document.documentElement.scrollHeight") <= 844, step
        page.set_viewport_size({"width": 1400, "height": 900})
        for sheet in ("", *SHEETS.get(step, ())):
            if sheet:
                press(page, sheet)
                page.locator("body:not(.busy)").wait_for()
            page.wait_for_timeout(300)
            assert page.evaluate(SCROLLS) == [], (step, sheet)


PRESS = """button => { button.click(); return document.body.classList.contains("busy")
  && getComputedStyle(document.getElementById("busy")).visibility === "visible"
  && getComputedStyle(document.querySelector("main")).pointerEvents === "none"; }"""


def test_a_click_is_answered_at_once_and_takes_no_other_until_it_is_done(
    page: Any, tmp_path: Path
) -> None:
    drop(page, german_log(tmp_path / "log.csv"))
    onward = page.get_by_role("button", name="Next: Map")
    onward.wait_for()
    # In the same turn of the page, before anything is sent to the server.
    assert onward.evaluate(PRESS)
    page.locator("body:not(.busy)").wait_for()
    page.get_by_role("heading", name="Map", level=1).wait_for()
    assert page.get_by_role("button", name="Next: Map").count() == 0
    assert not page.locator("#busy").is_visible()


def test_steps_are_reached_by_keyboard(page: Any, tmp_path: Path) -> None:
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    page.get_by_role("button", name="Next: Map").wait_for()
    page.get_by_role("button", name="2 Map").focus()
    page.keyboard.press("Enter")
    page.get_by_role("heading", name="Map", level=1).wait_for()
    page.wait_for_url(re.compile("step=map"))
    page.get_by_role("button", name="1 Load").click()
    page.wait_for_url(re.compile("step=load"))
    page.reload()
    page.get_by_role("heading", name="Load", level=1).wait_for()


def test_each_step_shows_its_command(page: Any, tmp_path: Path) -> None:
    drop(page, german_log(tmp_path / "run.csv", 0.5))
    press(page, "Next: Map")
    see(page, "500 samples")
    press(page, "The command and the Python that do the same")
    see(page, "ehsid import logs/run.csv --out records/run.parquet")


def refused(request: urllib.request.Request | str) -> int:
    with pytest.raises(urllib.error.HTTPError) as error:
        urllib.request.urlopen(request)
    error.value.close()
    return error.value.code


def test_without_the_token_nothing_is_served(served: Any) -> None:
    assert refused(served.root + "/") == 403
    assert refused(served.root + "/login?token=guess") == 403
    assert refused(served.root + "/result/machine/rig.toml") == 403
    upload = urllib.request.Request(
        served.root + "/upload/machine", b"x", {"X-Ehsid": "upload", "X-Name": "a.csv"}
    )
    assert refused(upload) == 403
    assert not list(served.folder.glob("*/logs/*"))


def test_only_results_are_served_and_only_those_of_the_session(page: Any, served: Any) -> None:
    (served.folder / "secret.txt").write_text("secret")
    fetch = "async (path) => (await fetch(path)).status"
    for path in ("session.toml", "errors.log", "..%2Fsecret.txt", "check/..%2F..%2Fsecret.txt"):
        assert page.evaluate(fetch, f"/result/machine/{path}") == 404, path
    assert page.evaluate(fetch, "/result/nobody/rig.toml") == 404


def test_an_upload_without_the_header_of_the_page_is_refused(page: Any, served: Any) -> None:
    send = "async () => (await fetch('/upload/machine', {method: 'POST', body: 'x'})).status"
    assert page.evaluate(send) == 403
    assert not list(served.folder.glob("machine/logs/*"))


def test_an_upload_that_breaks_off_leaves_nothing(page: Any, served: Any) -> None:
    cookies = "; ".join(f"{one['name']}={one['value']}" for one in page.context.cookies())
    host, _, port = served.root.rpartition("/")[2].partition(":")
    with socket.create_connection((host, int(port))) as line:
        head = (
            f"POST /upload/machine HTTP/1.1\r\nHost: {host}:{port}\r\nCookie: {cookies}\r\n"
            "X-Ehsid: upload\r\nX-Name: cut.csv\r\nContent-Length: 1000000\r\n\r\n"
        )
        line.sendall(head.encode() + b"time_s,command_v\n" * 100)
        logs = served.folder / "machine" / "logs"
        until(lambda: list(logs.glob(".*.part")))
    until(lambda: not list(logs.iterdir()))
    assert session_of(served).settings.records == []


def test_a_file_that_is_too_large_is_refused_before_it_is_sent(page: Any, served: Any) -> None:
    cookies = "; ".join(f"{one['name']}={one['value']}" for one in page.context.cookies())
    connection = http.client.HTTPConnection(served.root.rpartition("/")[2])
    connection.putrequest("POST", "/upload/machine")
    size = str(3 * 1024**3)
    for name, value in {"Cookie": cookies, "X-Ehsid": "upload", "Content-Length": size}.items():
        connection.putheader(name, value)
    connection.endheaders()
    assert connection.getresponse().status == 413
    connection.close()


def until(condition: Callable[[], object]) -> None:
    end = time.monotonic() + 30.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)

# SPDX-License-Identifier: MIT
"""A run on a target in Python, in a worker process: requests, results, and what is left of it."""

from __future__ import annotations

import json
import multiprocessing
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from app_sessions import BENCH
from estimating_target import EstimatingTarget
from hil_target import FakeDevice

from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.harness.records import read_record
from ehsid.harness.rigs.new import published_rig
from ehsid.hil.faults import Relay, relayed
from ehsid.hil.messages import Stopped
from ehsid.workbench.jobs import Job, State
from ehsid.workbench.live.runs import SERVED, LiveRuns, Requests, Target
from ehsid.workbench.live.settings import LINE, LiveSettings, read_settings
from ehsid.workbench.live.watching import COLUMNS, RING, RingReader, RunStatus, read_status
from ehsid.workbench.workbench import Workbench


@pytest.fixture
def runs(tmp_path: Path) -> Iterator[LiveRuns]:
    workbench = Workbench(tmp_path / "machines")
    made = LiveRuns(workbench)
    yield made
    made.close()
    workbench.close()


@pytest.fixture
def target() -> Iterator[Relay]:
    with relayed(FakeDevice(EstimatingTarget())) as relay:
        yield relay


def started(runs: LiveRuns, settings: LiveSettings) -> tuple[Job, Path]:
    runs.start(settings)
    folder = runs.latest()
    assert runs.job is not None
    assert folder is not None
    return runs.job, folder


def until(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + 60.0
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def samples(folder: Path) -> int:
    ring = folder / RING
    return RingReader(ring).count if ring.exists() else 0


@pytest.mark.slow
def test_a_run_writes_what_the_command_writes(runs: LiveRuns, target: Relay) -> None:
    settings = LiveSettings(
        target=LINE, port=target.port, rig=str(BENCH), duration_s="5", real_time=False
    )
    job, folder = started(runs, settings)
    job.wait(60.0)
    assert (job.state, job.message) == (State.done, "")
    found = json.loads((folder / "hil" / "hil.json").read_text())
    assert found["equal_to_host"]
    assert found["runs"][0]["samples"] == samples(folder) == 250
    assert found["provenance"]["line"] == target.port
    assert read_record(folder / "hil" / "record.csv").column("position_m").size == 250
    assert not list((folder / "hil").glob("unfinished*"))
    newest = RingReader(folder / RING).newest(1)[0]
    assert newest[COLUMNS.index("agrees")] == 1.0
    assert newest[COLUMNS.index("sent")] >= 253  # hello, configure, start
    status = read_status(folder)
    assert (status.board, status.faults, status.board_reset) == ("fake", True, False)
    assert runs.settings() == settings
    assert runs.workbench.names() == []  # a run is no machine, until one is made of it
    assert runs.workbench.opened("_live").folder != runs.folder
    session = runs.make_machine()
    assert session.rig_file.read_bytes() == BENCH.read_bytes()
    assert [entry.file for entry in session.settings.records] == ["logs/run_1.csv"]


@pytest.mark.slow
def test_requests_are_carried_out_and_the_run_stopped(runs: LiveRuns, target: Relay) -> None:
    job, folder = started(
        runs, LiveSettings(target=LINE, port=target.port, duration_s="200", dt_ms="10")
    )
    until(lambda: samples(folder) > 20)
    runs.start(LiveSettings(target=LINE, port=target.port))  # nothing happens while one goes on
    assert runs.job is job
    runs.request("snapshot")
    until(lambda: bool(read_status(folder).snapshots))
    (name,) = read_status(folder).snapshots
    runs.request("reset")
    runs.request("restore", name)
    runs.request("restore", "none")
    runs.request("fault", "drop", "to target")
    runs.request("reset board")  # there is none
    until(lambda: len(read_status(folder).events) >= 5)
    runs.stop(begun=True)
    job.wait(60.0)
    assert (job.state, job.message) == (State.done, "")
    words = " ".join(words for _, words in read_status(folder).events)
    assert "The estimator begins anew." in words
    assert f"The estimator goes on from {name}." in words
    assert "cannot be read" in words
    assert "Fault: Lose a frame" in words
    assert "board" not in words
    (run,) = json.loads((folder / "hil" / "hil.json").read_text())["runs"]
    assert run["equal_to_host"]
    assert run["estimator_begun_before_samples"]
    assert run["line"]["asked_again"] >= 1


OVERLAP = "effects.valve_dead_band.overlap"
LEAK = "effects.internal_leakage.coefficient_m3_s_pa"


class Beginnings:
    """In the place of a Watch: what the estimator began with."""

    time_s = 0.0

    def __init__(self) -> None:
        self.seen: list[object] = []

    def begin(self, configuration: object) -> None:
        self.seen.append(configuration)


def requests_of(folder: Path, there: Any, watch: Any) -> Requests:
    plan = read_settings(LiveSettings(duration_s="5")).run.plan(published_rig())
    return Requests(folder, there, RunStatus(), watch, plan, Target())


def test_a_stop_behind_a_reset_waits_until_it_is_carried_out(tmp_path: Path) -> None:
    """A slow host finds both before one sample."""
    here, there = multiprocessing.Pipe()
    watch = Beginnings()
    requests = requests_of(tmp_path, there, watch)
    here.send(("reset",))
    here.send(("stop",))
    start = requests(20)
    with pytest.raises(Stopped):
        requests(21)
    assert isinstance(start, EstimatorConfiguration)
    assert watch.seen == [start]
    assert [words for _, words in read_status(tmp_path).events] == ["The estimator begins anew."]


def test_a_machine_that_cannot_be_is_told_and_the_run_goes_on(tmp_path: Path) -> None:
    here, there = multiprocessing.Pipe()
    requests = requests_of(tmp_path, there, Beginnings())
    here.send(("machine", {OVERLAP: 7.0}))
    here.send(("machine", {OVERLAP: 0.06}))
    assert requests(0) == {OVERLAP: 0.06}
    status = read_status(tmp_path)
    assert "expected" in status.events[0][1]
    assert status.events[1][1].startswith("The machine: valve dead band: overlap 6")
    assert status.machine == {OVERLAP: 0.06}


@pytest.mark.slow
def test_without_hardware_an_effect_is_moved_while_the_run_goes_on(runs: LiveRuns) -> None:
    job, folder = started(runs, LiveSettings(duration_s="200"))
    until(lambda: samples(folder) > 20)
    runs.request("machine", {OVERLAP: 0.06})
    until(lambda: bool(read_status(folder).events))
    at = samples(folder)
    until(lambda: samples(folder) > at + 20)
    runs.stop(begun=True)
    job.wait(60.0)
    assert (job.state, job.message) == (State.done, "")
    status = read_status(folder)
    assert (status.board, status.faults) == ("this computer", False)
    assert status.machine == {OVERLAP: 0.06}
    last = RingReader(folder / RING).newest(1)[0]
    assert last[COLUMNS.index("agrees")] == 1.0
    assert "the user changed the simulated machine" in (folder / "hil" / "hil.html").read_text()
    (run,) = json.loads((folder / "hil" / "hil.json").read_text())["runs"]
    (change,) = run["machine_changes"]
    assert change["values"] == {OVERLAP: 0.06}
    assert change["time_s"] == pytest.approx(change["before_sample"] * run["dt_s"])
    assert 20 <= change["before_sample"] <= at


@pytest.mark.thorough
def test_a_run_that_fails_says_where_its_samples_are(runs: LiveRuns) -> None:
    with relayed(FakeDevice(EstimatingTarget())) as relay:
        job, folder = started(runs, LiveSettings(target=LINE, port=relay.port))
        until(lambda: samples(folder) > 5)
    job.wait(60.0)
    assert job.state is State.failed
    assert relay.port in job.message  # the address that the user gave
    left = folder / "hil" / "unfinished_1"
    assert f"{left} holds the" in job.message
    assert (left / "record.csv").exists()
    with pytest.raises(ValueError, match="there is no record of a whole run"):
        runs.make_machine()


@pytest.mark.thorough
def test_only_the_newest_run_keeps_its_ring(runs: LiveRuns, target: Relay) -> None:
    settings = LiveSettings(target=LINE, port=target.port, duration_s="5", real_time=False)
    _, first = started(runs, settings)
    assert runs.job is not None
    runs.job.wait(60.0)
    job, second = started(runs, settings)
    job.wait(60.0)
    assert (first.name, second.name) == ("run_1", "run_2")
    assert not (first / RING).exists()
    assert (second / RING).exists()
    assert (first / "hil" / "record.csv").exists()


@pytest.mark.thorough
def test_the_end_of_the_program_ends_the_run(runs: LiveRuns, target: Relay) -> None:
    job, folder = started(runs, LiveSettings(target=LINE, port=target.port))
    until(lambda: samples(folder) > 5)
    runs.close()
    assert not job.running
    assert list((folder / "hil").rglob("record.csv"))


def test_what_makes_no_sense_begins_no_run(runs: LiveRuns) -> None:
    with pytest.raises(ValueError, match="duration"):
        runs.start(LiveSettings(target=LINE, port="loop://", duration_s="soon"))
    assert runs.latest() is None


@pytest.mark.parametrize(
    ("path", "served"),
    [
        ("run_1/hil/hil.html", True),
        ("run_12/snapshots/1_at_2.00_s.snapshot.json", True),
        ("run_1/settings.json", False),
        ("run_1/hil/.ehsid/hil.json", False),
        ("errors.log", False),
    ],
)
def test_only_results_are_served(path: str, served: bool) -> None:
    assert bool(SERVED.fullmatch(path)) is served

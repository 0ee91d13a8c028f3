# SPDX-License-Identifier: MIT
"""What a user requests during a run: another start of the estimator, a snapshot, the end."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from estimating_target import EstimatingTarget
from hil_target import FakeDevice
from sources import ROOT

import ehsid
from ehsid.harness.firmware.configuration import EstimatorConfiguration
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.new import published_rig
from ehsid.harness.signals.simulation.run import OUTPUTS_OF
from ehsid.harness.signals.simulation.settings import SignalOptions
from ehsid.hil.comparison import compare
from ehsid.hil.configuration import read_snapshot, restored, taken, write_snapshot
from ehsid.hil.faults import Relay, relayed
from ehsid.hil.frames import HilError
from ehsid.hil.messages import Stopped
from ehsid.hil.plan import LoopRun, Plan, with_machine
from ehsid.hil.recording import RECORD, Recording
from ehsid.hil.run import RunResult, run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import Line, open_line

RIG = published_rig()
AXIS = ROOT / "examples" / "rigs" / "axis.toml"


def plan_of(rig: Rig = RIG, *, position_control: bool = False) -> Plan:
    signal = SignalOptions("prbs", 2.0, 0.02, None, 0)
    orders = ArxOrders(3, 3, 1, offset=True)
    run = LoopRun(position_control, signal, None, ehsid.FRatio(), orders, True, {}, 60_000)
    return run.plan(rig)


@pytest.fixture
def bench() -> Iterator[tuple[Relay, Line]]:
    with relayed(FakeDevice(EstimatingTarget())) as relay, open_line(relay.port) as line:
        yield relay, line


def run(
    bench: tuple[Relay, Line],
    folder: Path,
    steer: Callable[[int], EstimatorConfiguration | None] | None = None,
) -> RunResult:
    plan = plan_of()
    orders = plan.configuration.estimator.orders
    with Recording(folder, OUTPUTS_OF[plan.rig.plant], orders) as recording:
        return run_plan(plan, Session(bench[1]), recording, steer=steer)


def test_an_estimator_that_begins_anew_is_that_of_the_host(
    bench: tuple[Relay, Line], tmp_path: Path
) -> None:
    estimator = plan_of().configuration.estimator
    result = run(bench, tmp_path, lambda k: estimator if k == 40 else None)
    assert len(result.results) == 100
    assert list(result.begun) == [40]
    assert compare(result).equal
    assert not compare(replace(result, begun={})).equal
    still = bench[0].device.target  # type: ignore[attr-defined]
    assert still.carried_out == list(range(100))
    assert result.results[40].status == int(ehsid.Status.filling)


def test_a_run_that_is_stopped_keeps_its_samples(bench: tuple[Relay, Line], tmp_path: Path) -> None:
    def steer(number: int) -> None:
        if number == 30:
            raise Stopped

    result = run(bench, tmp_path, steer)
    assert len(result.results) == result.plan.samples == result.position_m.size == 30
    assert compare(result).equal
    assert (tmp_path / RECORD).read_text().count("\n") == 31
    assert bench[0].device.target.state == 1  # type: ignore[attr-defined] # the valve is closed


def test_a_run_that_is_stopped_at_once_says_so(bench: tuple[Relay, Line], tmp_path: Path) -> None:
    def steer(number: int) -> None:
        raise Stopped

    with pytest.raises(HilError, match="stopped before its first sample"):
        run(bench, tmp_path, steer)


def test_a_run_goes_on_from_a_snapshot(bench: tuple[Relay, Line], tmp_path: Path) -> None:
    first = run(bench, tmp_path / "first")
    configuration = first.plan.configuration.estimator
    estimator = configuration.estimator()
    for command, position in zip(first.command_v, first.position_m, strict=True):
        estimator.step(command, position)
    theta = first.results[-1].theta
    path = tmp_path / "a.snapshot.json"
    write_snapshot(path, taken(estimator, configuration, theta, rig=RIG.name, time_s=2.0))
    begin = restored(read_snapshot(path), configuration)
    second = run(bench, tmp_path / "second", lambda k: begin if k == 10 else None)
    assert compare(second).equal
    np.testing.assert_allclose(second.results[10].theta, theta)


def test_no_snapshot_where_target_and_host_differ() -> None:
    configuration = plan_of().configuration.estimator
    with pytest.raises(HilError, match="not those of this host"):
        taken(configuration.estimator(), configuration, (1.0,) * 7, rig="r", time_s=0.0)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"na": 2}, "expected"),
        ({"d": [-1.0] * 7}, "not one that an estimator can begin with"),
        ({"theta": [0.0] * 3}, "not one that an estimator can begin with"),
    ],
)
def test_a_snapshot_that_does_not_fit(
    bench: tuple[Relay, Line], tmp_path: Path, change: dict[str, object], says: str
) -> None:
    first = run(bench, tmp_path / "first")
    configuration = first.plan.configuration.estimator
    estimator = configuration.estimator()
    for command, position in zip(first.command_v, first.position_m, strict=True):
        estimator.step(command, position)
    path = tmp_path / "a.snapshot.json"
    made = taken(estimator, configuration, first.results[-1].theta, rig=RIG.name, time_s=2.0)
    write_snapshot(path, made)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(HilError, match=says):
        restored(read_snapshot(path), configuration)


def test_a_file_that_is_no_snapshot(tmp_path: Path) -> None:
    with pytest.raises(HilError, match="cannot be read"):
        read_snapshot(tmp_path / "none")
    (tmp_path / "other").write_text("{}")
    with pytest.raises(HilError, match="not the file of a snapshot"):
        read_snapshot(tmp_path / "other")


def test_position_control_follows_the_reference(tmp_path: Path) -> None:
    plan = plan_of(position_control=True)
    assert plan.configuration.controller.position_control
    assert np.ptp(plan.reference_m) > 0.0
    assert not plan.direct_v.any()


def test_another_machine_is_of_the_same_kind() -> None:
    with pytest.raises(ValueError, match='a plant "axis"'):
        with_machine(plan_of(), read_rig(AXIS))


def test_a_snapshot_can_be_taken_at_any_sample() -> None:
    """The covariance comes rounded to float32, and is then often not positive definite."""
    plan = plan_of()
    configuration = plan.configuration.estimator
    estimator = configuration.estimator()
    for k in range(60):
        estimator.step(plan.direct_v[k], 0.15 + 1e-3 * np.sin(k))
        theta = tuple(map(float, estimator.theta_hat))
        snapshot = taken(estimator, configuration, theta, rig=RIG.name, time_s=0.0)
        deviation = restored(snapshot, configuration).estimator().standard_deviation
        np.testing.assert_allclose(deviation, estimator.standard_deviation, rtol=1e-3)

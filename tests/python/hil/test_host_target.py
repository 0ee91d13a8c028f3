# SPDX-License-Identifier: MIT
"""A target in this process beside one on a line, and a machine that changes during a run."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from estimating_target import EstimatingTarget
from hil_target import FakeDevice
from numpy.polynomial.polynomial import polydiv

import ehsid
from ehsid.harness.base.encoding import from_json, to_plain
from ehsid.harness.firmware.servo import ServoSettings
from ehsid.harness.rigs.new import published_rig
from ehsid.harness.signals.simulation.run import OUTPUTS_OF
from ehsid.harness.signals.simulation.settings import SignalOptions
from ehsid.hil.comparison import compare
from ehsid.hil.faults import relayed
from ehsid.hil.host_target import HostTarget
from ehsid.hil.page import write_reports
from ehsid.hil.plan import THIRD_ORDER, LoopRun, Plan
from ehsid.hil.recording import Recording
from ehsid.hil.result_file import HilFile, MachineChange, Provenance
from ehsid.hil.run import RunResult, run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import open_line

OVERLAP = "effects.valve_dead_band.overlap"


def plan_of(*, retune: bool = False, seconds: float = 6.0, bandwidth_hz: float = 0.5) -> Plan:
    signal = SignalOptions("multisine", seconds, 0.02, None, 0)
    policy = ehsid.FRatio()
    run = LoopRun(True, signal, bandwidth_hz, policy, THIRD_ORDER, retune, {}, 60_000)
    return run.plan(published_rig())


def run(
    plan: Plan,
    session: Session,
    folder: Path,
    machines: Mapping[int, Mapping[str, float]] | None = None,
) -> RunResult:
    steer = (machines or {}).get
    with Recording(folder, OUTPUTS_OF[plan.rig.plant], THIRD_ORDER) as recording:
        return run_plan(plan, session, recording, steer=steer)


def test_it_answers_as_a_target_behind_a_line(tmp_path: Path) -> None:
    """The target of the tests has no feed-forward and a fixed gain."""
    plan = plan_of()
    settings = replace(plan.configuration.controller, feed_forward_v_s_m=0.0)
    plan = replace(plan, configuration=replace(plan.configuration, controller=settings))
    here = run(plan, HostTarget(), tmp_path / "here")
    with relayed(FakeDevice(EstimatingTarget())) as relay, open_line(relay.port) as line:
        there = run(plan, Session(line), tmp_path / "there")
    # The line rounds what it carries to float32.
    np.testing.assert_allclose(here.command_v, there.command_v, rtol=0.0, atol=1e-5)
    ours, theirs = (np.array(one.arx_results[-1].theta) for one in (here, there))
    np.testing.assert_allclose(ours[:6], theirs[:6], rtol=0.02)
    assert compare(here).equal


def test_its_gain_follows_an_estimate_that_has_settled_by_small_steps(tmp_path: Path) -> None:
    plan = plan_of(retune=True, seconds=60.0, bandwidth_hz=2.0)
    settings = plan.configuration.controller
    results = run(plan, HostTarget(), tmp_path).arx_results
    followed = [one for one in results if one.gain_estimated]
    assert followed
    gains = np.array([one.gain_v_m for one in results])
    assert np.all(gains[: results.index(followed[0])] == settings.fixed_gain_v_m)
    assert settings.gain_min_v_m <= gains.min()
    assert gains.max() <= settings.gain_max_v_m
    both = np.array([a.gain_estimated and b.gain_estimated for a, b in pairwise(results)])
    steps = np.abs(np.diff(gains))[both]
    assert 0.0 < steps.max() <= settings.gain_step * settings.fixed_gain_v_m * (1.0 + 1e-9)


def test_its_fit_is_that_of_the_formula(tmp_path: Path) -> None:
    """Until the window is full, every sample counts alike."""
    result = run(plan_of(), HostTarget(), tmp_path)
    status = [ehsid.Status(one.status) for one in result.arx_results]
    first = next(k for k, one in enumerate(status) if one is not ehsid.Status.filling)
    innovation = np.array([one.innovation_m for one in result.arx_results])[first:]
    wanted = 100.0 * (1.0 - np.sqrt(np.mean(innovation**2)) / np.std(result.position_m[first:]))
    assert result.arx_results[-1].fit_percent == pytest.approx(wanted, rel=1e-6)


def test_its_velocity_gain_is_that_of_the_model_without_its_integrator(tmp_path: Path) -> None:
    plan = plan_of()
    result = run(plan, HostTarget(), tmp_path).arx_results[-1]
    na, nb = THIRD_ORDER.na, THIRD_ORDER.nb
    # A(x) = (1 - x) C(x), and K = B(1) / (T C(1))
    without, _ = polydiv([1.0, *result.theta[:na]], [1.0, -1.0])
    wanted = sum(result.theta[na : na + nb]) / (plan.dt_s * float(np.sum(without)))
    assert wanted > 0.0
    assert result.velocity_gain_m_s_v == pytest.approx(wanted, rel=1e-9)


def test_a_servo_estimator_is_refused_in_words() -> None:
    plan = plan_of()
    wanted = replace(plan.configuration, servo=ServoSettings.chosen(plan.dt_s, {}))
    with pytest.raises(ValueError, match="no ServoEstimator"):
        HostTarget().configure(wanted)


def test_a_leak_during_a_run_takes_speed_from_the_estimate(tmp_path: Path) -> None:
    leak = {"effects.internal_leakage.coefficient_m3_s_pa": 1e-10}
    result = run(plan_of(seconds=40.0), HostTarget(), tmp_path, {1000: leak})
    path = ehsid.ServoEstimator(0.02).run(result.command_v, result.position_m).gain.value
    assert path[999] == pytest.approx(0.03, rel=0.2)
    assert path[-1] < 0.85 * path[999]


def test_a_machine_changes_in_the_middle_of_its_motion(tmp_path: Path) -> None:
    plan = plan_of()
    plain = run(plan, HostTarget(), tmp_path / "plain")
    changed = run(plan, HostTarget(), tmp_path / "changed", {150: {OVERLAP: 0.1}})
    same, other = plain.position_m, changed.position_m
    np.testing.assert_array_equal(same[:151], other[:151])
    assert abs(other[151] - same[151]) < 5e-4  # it goes on from where it was
    assert np.abs(other[151:] - same[151:]).max() > 1e-3
    assert changed.machines == {150: {OVERLAP: 0.1}}
    back = run(plan, HostTarget(), tmp_path / "back", {0: {OVERLAP: 0.1}, 1: {}})
    np.testing.assert_allclose(back.position_m, same, atol=5e-4)


def test_the_file_tells_when_the_user_changed_the_machine_and_into_what(tmp_path: Path) -> None:
    lag = {"effects.valve_lag.bandwidth_hz": 20.0, "effects.valve_lag.damping": 0.7}
    target = HostTarget()
    moved = run(plan_of(), target, tmp_path, {150: {OVERLAP: 0.1}, 200: lag, 250: {}})
    provenance = Provenance("0.1.0", "published", None, {}, "this computer", "position", 0, 1.0)
    runs = [("FRatio", moved, compare(moved))]
    write_reports(tmp_path, target.hello(), runs, provenance)
    file = from_json((tmp_path / "hil.json").read_bytes(), HilFile)
    assert file.runs[0].machine_changes == (
        MachineChange(150, 3.0, {OVERLAP: 0.1}),
        MachineChange(200, 4.0, lag),
        MachineChange(250, 5.0, {}),
    )
    before = to_plain(file)  # a file of an earlier version does not have the field
    del before["runs"][0]["machine_changes"]
    assert from_json(json.dumps(before).encode(), HilFile).runs[0].machine_changes == ()

# SPDX-License-Identifier: MIT
"""Cycles as a PLC has them: what the machine does in them, what the target knows of them."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from estimating_target import EstimatingTarget
from hil_firmware import on_host
from hil_runs import NEVER_MS, PATIENT, TIMEOUT_S, configuration
from hil_target import FakeDevice
from sources import ROOT

import ehsid
from ehsid.harness.firmware import ServoSettings
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import velocity_gain
from ehsid.harness.signals.simulation.run import OUTPUTS_OF, prepare
from ehsid.harness.signals.simulation.settings import SignalOptions
from ehsid.hil import comparison
from ehsid.hil.answers import ServoResult
from ehsid.hil.comparison import compare
from ehsid.hil.cycles import TICKS, CycleOptions
from ehsid.hil.faults import relayed
from ehsid.hil.frames import HilError
from ehsid.hil.messages import MOST_LOST, Sample
from ehsid.hil.plan import LoopRun, Plan, with_servo
from ehsid.hil.recording import Recording
from ehsid.hil.run import RunResult, run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import Line, open_line

RIG = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
ALL = CycleOptions(jitter=0.3, lost=0.02, overrun=0.02)


def plan_of(cycles: CycleOptions | None, seconds: float, dt_s: float, *, position: bool) -> Plan:
    signal = SignalOptions("multisine", seconds, dt_s, None, 4)
    orders = ArxOrders(3, 3, 1, offset=True)
    return LoopRun(position, signal, None, ehsid.FRatio(), orders, True, {}, NEVER_MS, cycles).plan(
        RIG
    )


def run(line: Line, plan: Plan, folder: Path) -> RunResult:
    configured = plan.configuration
    orders = configured.estimator.orders if configured.servo is None else None
    session = Session(line, timeout_s=TIMEOUT_S, attempts=PATIENT)
    with Recording(folder, OUTPUTS_OF[RIG.plant], orders, plan.cycles) as recording:
        return run_plan(plan, session, recording)


@pytest.fixture(scope="module")
def firmware() -> Iterator[Line]:
    with relayed(on_host()) as relay, open_line(relay.port) as line:
        yield line


def test_cycles_are_drawn_as_asked() -> None:
    count = 40_000
    one, again = (ALL.draw(count, 0.005, np.random.default_rng(1)) for _ in range(2))
    assert all(np.array_equal(getattr(one, n), getattr(again, n)) for n in ("ticks", "overrun"))
    assert one.ticks.min() == 0.7 * TICKS
    assert one.ticks.max() == 1.3 * TICKS
    # A uniform whole number in -30 to 30 has the variance (61^2 - 1) / 12; five deviations of it.
    sigma = math.sqrt((61**2 - 1) / 12.0)
    assert abs(one.ticks.mean() - TICKS) < 5.0 * sigma / math.sqrt(count)
    for events in (one.lost, one.overrun):
        assert abs(events.mean() - 0.02) < 5.0 * math.sqrt(0.02 * 0.98 / count)
    assert not np.any(one.lost & one.overrun)
    most = CycleOptions(lost=0.5).draw(2, 0.005, np.random.default_rng(1))
    assert not most.lost.any()  # the first and the last


def test_the_machine_moves_on_by_the_true_time_on_the_command_that_acts(tmp_path: Path) -> None:
    options = CycleOptions(jitter=0.4, lost=0.2, overrun=0.3)
    plan = plan_of(options, 2.0, 0.01, position=False)
    plan = replace(plan, noise=np.zeros_like(plan.noise))
    assert plan.cycles is not None
    with relayed(FakeDevice(EstimatingTarget())) as relay, open_line(relay.port) as line:
        result = run(line, plan, tmp_path)
    # The command at each cycle, by the words of the document.
    ran, command = plan.direct_v.astype(np.float32).astype(float), np.zeros(plan.samples)
    last = 0.0
    for k in range(plan.samples):
        if plan.cycles.lost[k]:
            command[k] = last
        else:
            command[k], last = (last if plan.cycles.overrun[k] else ran[k]), ran[k]
    fine = prepare(RIG, dt_s=plan.dt_s / TICKS, substeps=1, position0_m=plan.position0_m).plant()
    position = fine.run(np.repeat(command, plan.cycles.ticks))[:, 0]
    at = (np.cumsum(plan.cycles.ticks) - plan.cycles.ticks)[~plan.cycles.lost]
    np.testing.assert_array_equal(result.position_m, position[at].astype(np.float32))
    np.testing.assert_allclose(plan.times_s[result.numbers], at * plan.dt_s / TICKS, rtol=1e-12)
    assert compare(result).equal


@pytest.fixture(scope="module")
def irregular(firmware: Line, tmp_path_factory: pytest.TempPathFactory) -> RunResult:
    plan = with_servo(plan_of(ALL, 10.0, 0.005, position=True), {})
    return run(firmware, plan, tmp_path_factory.mktemp("irregular"))


@pytest.mark.slow
def test_estimator_and_controller_stay_sane(
    firmware: Line, irregular: RunResult, tmp_path: Path
) -> None:
    plan = with_servo(plan_of(None, 10.0, 0.005, position=True), {})
    results = irregular.servo_results, run(firmware, plan, tmp_path)
    assert len(irregular.results) == plan.samples - np.sum(irregular.plan.cycles.lost)  # type: ignore[union-attr]
    told = np.array([result.tracked for result in results[0]])
    begun = int(np.argmax(np.isfinite(told).all(axis=(1, 2))))
    assert begun < 100  # half a second
    assert np.isfinite(told[begun:]).all()

    def rms(one: RunResult) -> float:
        reference = one.plan.reference_m[one.numbers]
        return float(np.sqrt(np.mean(np.square(reference - one.position_m))))

    # The reference goes on by the cycle: in one of 0.7 of the sampling time it moves 1 / 0.7 times
    # as fast, and so much larger is the error of a loop that follows with a lag.
    assert rms(irregular) < rms(results[1]) / 0.7
    # Trusted: the 90 % interval is narrower than 10 % of K. So K is within 10 % for nine tenths of
    # the time, and 3.3 deviations, twice the half width, are seldom left.
    trusted = told[:, 0, 2] == 0
    error = np.abs(told[trusted, 0, 0] / velocity_gain(RIG) - 1.0)
    assert trusted.mean() > 0.5
    assert np.quantile(error, 0.9) < 0.1
    assert error.max() < 0.2


@pytest.mark.slow
def test_the_replay_forgets_where_the_target_does(
    irregular: RunResult, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert compare(irregular).equal
    lost = comparison.lost_before(irregular)
    assert lost.sum() == np.sum(irregular.plan.cycles.lost)  # type: ignore[union-attr]
    monkeypatch.setattr(comparison, "lost_before", lambda _: np.zeros_like(lost))
    first = irregular.numbers[np.flatnonzero(lost)[0]]
    assert compare(irregular).different[0] >= first


@pytest.mark.parametrize("servo", [None, ServoSettings(0.001)], ids=["arx", "servo"])
def test_no_number_of_a_sample_makes_an_answer_that_is_not_finite(
    firmware: Line, servo: ServoSettings | None
) -> None:
    """An answer is that of the module, which forgets where the number jumps, or a refusal."""
    rng = np.random.default_rng(7)
    made = replace(configuration(), servo=servo)
    session = Session(firmware, timeout_s=TIMEOUT_S, attempts=PATIENT)
    expected = 2**32 - 900  # goes round
    session.hello()
    session.configure(made)
    session.start(expected)
    here: ehsid.ArxEstimator | ehsid.ServoEstimator = (servo or made.estimator).estimator()
    jumps: list[Callable[[], int]] = [
        lambda: 0,
        partial(rng.integers, 0, 4),
        lambda: int(rng.choice([1, MOST_LOST, MOST_LOST + 1, -1, 2**31, -(2**31)])),
        partial(rng.integers, -(2**31), 2**31),
    ]
    accepted = refused = 0
    for _ in range(600):
        jump = int(jumps[rng.choice(4, p=(0.6, 0.2, 0.1, 0.1))]())
        number = (expected + jump) % 2**32
        position = float(np.float32(rng.normal(0.0, 0.01)))
        sample = Sample(number, position, float(rng.normal(0.0, 0.01)))
        if jump % 2**32 > MOST_LOST:
            with pytest.raises(HilError, match=f"sample {number}: it waits for sample {expected}"):
                session.exchange(sample)
            refused += 1
            continue
        result = session.exchange(sample)
        if jump:
            here.step(math.nan, math.nan)
        assert result.status == here.step(result.command_v, position)
        assert math.isfinite(result.command_v)
        if isinstance(here, ehsid.ServoEstimator):
            assert isinstance(result, ServoResult)
            now = here.servo()
            ours = [(v.value, v.half_width, int(v.reason)) for v in (now.gain, now.omega_n, now.xi)]
            np.testing.assert_array_equal(result.tracked, ours)
        else:
            assert result.theta == tuple(here.theta_hat)  # type: ignore[union-attr]
        accepted, expected = accepted + 1, (number + 1) % 2**32
    assert accepted > 400
    assert refused > 50
    session.stop()

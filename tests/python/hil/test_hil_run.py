# SPDX-License-Identifier: MIT
"""Whole runs with the firmware of this host: what is recorded, and whose estimates they are."""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hil_firmware import on_host
from hil_line import Seeded
from hil_runs import PATIENT, TIMEOUT_S
from hil_target import FakeDevice, Target

import ehsid
from ehsid.harness.records import read_record
from ehsid.harness.rigs.new import published_rig
from ehsid.harness.signals.excitation import random_steps
from ehsid.harness.signals.simulation import draw_noise, simulate_closed_loop, suggested_controller
from ehsid.harness.signals.simulation.run import OUTPUTS, OUTPUTS_OF
from ehsid.hil.answers import Identity
from ehsid.hil.comparison import compare, rmse
from ehsid.hil.faults import TO_TARGET, Passing, Relay, relayed, undisturbed
from ehsid.hil.frames import HilError, decode
from ehsid.hil.messages import Kind
from ehsid.hil.page import lead
from ehsid.hil.plan import Plan, position_plan
from ehsid.hil.recording import ESTIMATES, RECORD, Recording
from ehsid.hil.run import MOST_RESTARTS, RunResult, run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import Line, open_line
from ehsid.lab.studies.on_target import experiment_plans
from ehsid.lab.studies.rig_records import DT_S, changed_record, rig_record

SAMPLES = 120
RIG = published_rig()
NEVER_MS = 60_000


@pytest.fixture(scope="module")
def bench() -> Iterator[tuple[Relay, Line]]:
    with relayed(on_host()) as relay, open_line(relay.port) as line:
        yield relay, line


@pytest.fixture(scope="module")
def plan() -> Plan:
    """The first seconds of the published experiment, with the varying forgetting factor."""
    plans = experiment_plans(RIG, suggested_controller(RIG, 0.5), seed=3, watchdog_ms=NEVER_MS)
    return shortened(next(iter(plans.values())))


def shortened(plan: Plan, samples: int = SAMPLES) -> Plan:
    return replace(
        plan,
        direct_v=plan.direct_v[:samples],
        reference_m=plan.reference_m[:samples],
        noise=plan.noise[:samples],
    )


def run(bench: tuple[Relay, Line], plan: Plan, folder: Path) -> RunResult:
    session = Session(bench[1], timeout_s=TIMEOUT_S, attempts=PATIENT)
    configuration = plan.configuration
    orders = configuration.estimator.orders if configuration.servo is None else None
    with Recording(folder, OUTPUTS_OF[plan.rig.plant], orders) as recording:
        return run_plan(plan, session, recording)


class Resetting:
    """Resets the target before a request of this kind is passed on: at these samples, or always."""

    def __init__(self, relay: Relay, kind: Kind, samples: Sequence[int] = ()) -> None:
        self.done = 0
        self._relay, self._kind, self._left = relay, kind, list(samples)

    def __call__(self, way: str, number: int, frame: bytes) -> Passing:
        packet = decode(frame)
        if way == TO_TARGET and packet.kind == self._kind and self._now(packet.body):
            self.done += 1
            self._relay.device.reset()
        return undisturbed(way, number, frame)

    def _now(self, body: bytes) -> bool:
        """By the number in the sample, not of the frame: a loaded machine asks again."""
        if self._kind is not Kind.SAMPLE:
            return self.done == 0
        if self._left and int.from_bytes(body[:4], "little") == self._left[0]:
            self._left.pop(0)
            return True
        return False


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_the_plans_of_the_experiment_are_its_records() -> None:
    plans = experiment_plans(RIG, suggested_controller(RIG), seed=3)
    record = rig_record(RIG, 3)
    for plan in plans.values():
        np.testing.assert_array_equal(plan.direct_v, record.column("command_v"))
    assert len({repr(plan.configuration.estimator.forgetting) for plan in plans.values()}) == 4
    assert [bool(plan.change) for plan in plans.values()] == [False] * 4 + [True] * 2
    resets = [plan.configuration.estimator.reset is not None for plan in plans.values()]
    assert resets == [False] * 5 + [True]


@pytest.mark.slow
def test_a_run_is_recorded_as_the_target_had_it(
    bench: tuple[Relay, Line], plan: Plan, tmp_path: Path
) -> None:
    bench[0].disturb(undisturbed)
    result = run(bench, plan, tmp_path)
    record = read_record(tmp_path / RECORD)
    np.testing.assert_array_equal(record.column("command_v"), result.command_v)
    np.testing.assert_array_equal(record.column("position_m"), result.position_m)
    np.testing.assert_array_equal(result.position_m, np.float32(result.position_m))
    np.testing.assert_array_equal(result.command_v, np.float32(plan.direct_v))
    # The simulated run on the command in double: the rounding of a float32 command, 6e-8 of it,
    # is an offset in speed of that share; over the run the rod moves less than its stroke. The
    # position itself is rounded to float32.
    before = rig_record(RIG, 3).column("position_m")[:SAMPLES]
    stroke = RIG.values["cylinder.stroke_m"]
    np.testing.assert_allclose(result.position_m, before, atol=4 * 6e-8 * stroke, rtol=0)
    estimates = rows(tmp_path / ESTIMATES)
    assert len(estimates) == SAMPLES
    for row, answer in zip(estimates, result.results, strict=True):
        assert float(row["a1"]) == answer.theta[0]
        assert float(row["innovation_m"]) == answer.innovation_m
        assert int(row["status"]) == answer.status


def test_estimates_are_the_hosts(bench: tuple[Relay, Line], plan: Plan, tmp_path: Path) -> None:
    bench[0].disturb(undisturbed)
    result = run(bench, plan, tmp_path)
    agreement = compare(result)
    assert agreement.equal
    assert "bit for bit" in agreement.sentence
    errors = [r.innovation_m for r in result.results if r.status in (0, 2, 4)]
    assert rmse(result) == pytest.approx(np.sqrt(np.mean(np.square(errors))))


@pytest.mark.parametrize("what", ["theta", "innovation_m", "status"])
def test_one_bit_is_seen(bench: tuple[Relay, Line], plan: Plan, tmp_path: Path, what: str) -> None:
    bench[0].disturb(undisturbed)
    result = run(bench, shortened(plan, 40), tmp_path)
    answers, at = list(result.results), 25
    match what:
        case "theta":
            last = float(np.nextafter(np.float32(answers[at].theta[6]), np.float32(1.0)))
            changed = replace(answers[at], theta=(*answers[at].theta[:6], last))
        case "innovation_m":
            changed = replace(answers[at], innovation_m=-answers[at].innovation_m)
        case _:
            changed = replace(answers[at], status=4)
    answers[at] = changed
    agreement = compare(replace(result, results=tuple(answers)))
    assert agreement.different.tolist() == [at]
    assert f"first at sample {at}" in agreement.sentence


@pytest.fixture(scope="module")
def observed() -> Plan:
    """The published experiment with a ServoEstimator, up to where K is trusted."""
    plans = experiment_plans(
        RIG, suggested_controller(RIG), seed=3, watchdog_ms=NEVER_MS, servo={"tolerance": 0.2}
    )
    assert list(plans) == ["servo", "changed"]
    assert plans["changed"].change
    return shortened(plans["servo"], 600)


@pytest.mark.slow
def test_a_servo_is_recorded_and_is_the_hosts(
    bench: tuple[Relay, Line], observed: Plan, tmp_path: Path
) -> None:
    bench[0].disturb(undisturbed)
    result = run(bench, observed, tmp_path)
    agreement = compare(result)
    assert agreement.equal
    assert agreement.largest == 0.0
    estimates = rows(tmp_path / ESTIMATES)
    assert len(estimates) == len(result.servo_results) == 600
    for row, answer in zip(estimates, result.servo_results, strict=True):
        np.testing.assert_equal(float(row["velocity_gain_m_s_v"]), answer.velocity_gain_m_s_v)
        assert int(row["xi_reason"]) == answer.xi_reason
    here = ehsid.ServoEstimator(DT_S, tolerance=0.2)
    told = here.run(np.float32(result.command_v), np.float32(result.position_m))
    assert agreement.servo is not None
    for ours, value in zip((told.gain, told.omega_n, told.xi), agreement.servo, strict=True):
        np.testing.assert_array_equal(value.path, ours.value)
        np.testing.assert_array_equal(value.half_path, ours.half_width)
        np.testing.assert_array_equal(value.trusted_path, ours.trusted)
    assert agreement.servo.gain.trusted_path.any()
    assert agreement.servo.resets == here.resets
    identity = Identity(3, (0, 2, 0), frozenset(), frozenset(), "host")
    said = " ".join(lead(identity, [("servo", result, agreement)]))
    assert "bit for bit" in said
    assert f"servo: K {agreement.servo.gain.path[agreement.servo.gain.at]:.4g}" in said


@pytest.mark.parametrize("what", ["xi_half_width", "omega_n_reason", "status"])
def test_one_bit_of_a_servo_is_seen(
    bench: tuple[Relay, Line], observed: Plan, tmp_path: Path, what: str
) -> None:
    bench[0].disturb(undisturbed)
    result = run(bench, shortened(observed, 200), tmp_path)
    answers, at = list(result.results), 180
    before = getattr(answers[at], what)
    one_bit = float(np.nextafter(np.float32(before), np.float32(9.0)))
    answers[at] = replace(answers[at], **{what: before + 1 if what != "xi_half_width" else one_bit})
    agreement = compare(replace(result, results=tuple(answers)))
    assert agreement.different.tolist() == [at]
    assert (agreement.largest > 0.0) == (what == "xi_half_width")


def test_a_servo_begins_anew_where_the_target_was_reset(
    bench: tuple[Relay, Line], observed: Plan, tmp_path: Path
) -> None:
    bench[0].disturb(Resetting(bench[0], Kind.SAMPLE, [149]))
    result = run(bench, shortened(observed, 300), tmp_path)
    assert result.restarts == (149,)
    assert compare(result).equal
    assert not compare(replace(result, restarts=())).equal


def test_a_command_at_its_limit_is_said(
    bench: tuple[Relay, Line], plan: Plan, tmp_path: Path
) -> None:
    bench[0].disturb(undisturbed)
    result = run(bench, shortened(plan, 40), tmp_path)
    limited = replace(result, results=tuple(replace(r, limited=True) for r in result.results))
    identity = Identity(1, (0, 1, 0), frozenset(), frozenset(), "host")
    said = [lead(identity, [("run", one, compare(one))]) for one in (result, limited)]
    assert not any("at its limit" in sentence for sentence in said[0])
    assert any("at its limit for 100\N{NO-BREAK SPACE}%" in sentence for sentence in said[1])


@pytest.mark.slow
def test_faults_change_no_byte_of_the_record(
    bench: tuple[Relay, Line], plan: Plan, tmp_path: Path
) -> None:
    bench[0].disturb(undisturbed)
    run(bench, plan, tmp_path / "sound")
    faults = Seeded(11, probability=0.1, hold_s=1.5 * TIMEOUT_S)
    bench[0].disturb(faults)
    result = run(bench, plan, tmp_path / "disturbed")
    assert faults.made
    assert result.counters.asked_again > 0
    sound, disturbed = (tmp_path / name / RECORD for name in ("sound", "disturbed"))
    assert sound.read_bytes() == disturbed.read_bytes()
    assert compare(result).equal


def test_a_reset_in_mid_run_is_got_over(
    bench: tuple[Relay, Line], plan: Plan, tmp_path: Path
) -> None:
    bench[0].disturb(Resetting(bench[0], Kind.SAMPLE, [49]))
    result = run(bench, plan, tmp_path)
    assert result.restarts == (49,)
    assert len(result.results) == SAMPLES
    # The simulated machine stood still meanwhile, so the record is that of an undisturbed run.
    np.testing.assert_array_equal(result.command_v, np.float32(plan.direct_v))
    assert compare(result).equal
    assert not compare(replace(result, restarts=())).equal
    assert rows(tmp_path / ESTIMATES)[-1]["restarts"] == "1"


def test_a_target_that_is_reset_again_and_again_ends_the_run(
    bench: tuple[Relay, Line], plan: Plan, tmp_path: Path
) -> None:
    relay = bench[0]
    relay.disturb(Resetting(relay, Kind.SAMPLE, [20, 40, 60, 80]))
    with pytest.raises(HilError, match=f"was reset {MOST_RESTARTS + 1} times"):
        run(bench, plan, tmp_path)
    assert len(rows(tmp_path / RECORD)) == 80
    relay.disturb(undisturbed)
    assert compare(run(bench, plan, tmp_path)).equal  # the next one runs


def test_position_control_with_the_fixed_gain_is_that_of_the_simulator(
    bench: tuple[Relay, Line], tmp_path: Path
) -> None:
    bench[0].disturb(undisturbed)
    controller, dt_s = suggested_controller(RIG, 0.3), 0.02
    time = np.arange(200) * dt_s
    reference = 0.12 + 0.01 * np.sin(2 * np.pi * 0.5 * time)
    noise = draw_noise(RIG, reference.size, np.random.default_rng(5))
    plan = position_plan(
        RIG, reference, controller, dt_s=dt_s, noise=noise, retune=False, watchdog_ms=NEVER_MS
    )
    result = run(bench, plan, tmp_path)
    here = simulate_closed_loop(RIG, reference, controller, dt_s=dt_s, noise=noise).run.record
    assert compare(result).equal
    assert not any(answer.gain_estimated for answer in result.results)
    # Rounding of reference and position to float32, half a unit in the last place of 0.16 m each
    # (7.5e-9 m), times the gain, and as much again for the product and the sum; the loop is stable
    # and keeps the errors from adding up beyond its own time constant of 0.5 s, 26 samples.
    bound = 26 * 4 * 7.5e-9 * controller.gain_v_m
    np.testing.assert_allclose(result.command_v, here.column("command_v"), rtol=0, atol=bound)
    assert bound < 1e-3 * np.ptp(result.command_v)


def test_a_reset_at_the_very_end_loses_nothing(
    bench: tuple[Relay, Line], plan: Plan, tmp_path: Path
) -> None:
    resetting = Resetting(bench[0], Kind.STOP)
    bench[0].disturb(resetting)
    result = run(bench, shortened(plan, 30), tmp_path)
    assert resetting.done == 1
    assert len(result.results) == 30
    assert compare(result).equal


@pytest.mark.slow
def test_a_change_of_the_plant_is_that_of_the_experiment(
    bench: tuple[Relay, Line], tmp_path: Path
) -> None:
    bench[0].disturb(undisturbed)
    plans = experiment_plans(RIG, suggested_controller(RIG), seed=3, watchdog_ms=NEVER_MS)
    plan = plans["changed_reset"]
    result = run(bench, replace(plan, noise=np.zeros_like(plan.noise)), tmp_path)
    mass = 2.0 * RIG.values["load.mass_kg"]
    expected = changed_record(RIG, {"load.mass_kg": mass}, 3)
    speed = np.abs(expected.column("velocity_m_s")).max()
    # The spool that begins at null lacks, until it has followed, 2 damping / omega of the way; the
    # other record has the noise of the sensor, of which 2000 samples stay below five deviations.
    lag = 2.0 * 0.85 / (2.0 * np.pi * 70.0) * speed
    noise = 5.0 * RIG.sensors["position_noise_m"]
    difference = np.abs(result.position_m - expected.column("position_m"))
    assert difference[:1000].max() < noise
    assert difference.max() < lag + noise
    unchanged = rig_record(RIG, 3).column("position_m")
    assert np.abs(result.position_m - unchanged).max() > 10.0 * (lag + noise)
    assert compare(result).equal
    assert result.results[-1].resets >= 1


def test_an_estimate_of_another_size_ends_the_run(tmp_path: Path) -> None:
    """The target of the document answers with three parameters, whatever it was configured for."""
    plan = position_plan(
        RIG,
        np.full(10, 0.15),
        suggested_controller(RIG, 0.3),
        dt_s=0.05,
        noise=np.zeros((10, len(OUTPUTS))),
        watchdog_ms=NEVER_MS,
    )
    with (
        relayed(FakeDevice(Target())) as relay,
        open_line(relay.port) as line,
        pytest.raises(HilError, match=r"an estimate of 3 parameters: expected the \d"),
    ):
        run((relay, line), plan, tmp_path)
    assert not tmp_path.exists()  # no sample, no file


def test_the_gain_follows_the_estimate_within_its_bounds(
    bench: tuple[Relay, Line], tmp_path: Path
) -> None:
    """A machine with a third of the pressure that the controller was tuned for."""
    bench[0].disturb(undisturbed)
    rng = np.random.default_rng(1)
    reference = 0.15 + random_steps(600, amplitude=0.03, hold=(10, 60), rng=rng)
    plan = position_plan(
        RIG,
        reference,
        suggested_controller(RIG, 0.3),
        dt_s=0.05,
        noise=draw_noise(RIG, reference.size, rng),
        watchdog_ms=NEVER_MS,
    )
    weak = replace(plan, rig=RIG.with_values({"supply.pressure_pa": 4e6}))
    result = run(bench, weak, tmp_path)
    told = plan.configuration.controller
    gains = np.array([answer.gain_v_m for answer in result.results])
    followed = np.array([answer.gain_estimated for answer in result.results])
    assert followed.any()
    assert np.all(gains[~followed] == np.float32(told.fixed_gain_v_m))
    # Rounding of float32 on both sides.
    assert gains.max() <= told.gain_max_v_m * (1.0 + 1e-6)
    assert gains.min() >= told.gain_min_v_m * (1.0 - 1e-6)
    both = followed[1:] & followed[:-1]
    steps = np.abs(np.diff(gains))[both]
    assert steps.max() <= told.gain_step * told.fixed_gain_v_m * (1.0 + 1e-4)
    # The machine is slower than told, so the gain has to grow.
    assert gains[followed].max() > 1.2 * told.fixed_gain_v_m
    assert compare(result).equal

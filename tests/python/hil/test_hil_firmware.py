# SPDX-License-Identifier: MIT
"""The firmware itself over a line that goes wrong, and its estimates beside those of the module."""

import random
import shutil
from collections.abc import Iterator
from dataclasses import replace

import hil_firmware
import numpy as np
import pytest
from hil_firmware import ON_TARGET, on_host
from hil_line import Seeded
from hil_runs import (
    CONTROLLER,
    NEVER_MS,
    PATIENT,
    TIMEOUT_S,
    configuration,
    estimates,
    run,
    sample,
    wait_until,
)

import ehsid
from ehsid.harness.firmware import Seed, ServoSettings
from ehsid.hil.answers import Result, Safe, ServoResult
from ehsid.hil.configuration import Configuration
from ehsid.hil.faults import TO_TARGET, Device, Passing, Relay, relayed, undisturbed
from ehsid.hil.frames import HilError, TargetReset, decode
from ehsid.hil.messages import Sample
from ehsid.hil.session import Session
from ehsid.hil.transport import EmulatedDevice, Line, open_line

SAMPLES = 40


def emulated() -> Device:
    if shutil.which("qemu-system-arm") is None:
        pytest.skip("no qemu-system-arm: the firmware is not run on the emulated Cortex-M4F")
    if not hil_firmware.ON_TARGET.exists():
        pytest.skip(
            "no firmware for the Cortex-M4F; build it: cmake --preset arm && "
            "cmake --build --preset arm"
        )
    return EmulatedDevice(ON_TARGET)


@pytest.fixture(
    scope="module",
    params=[on_host, pytest.param(emulated, marks=pytest.mark.thorough)],
    ids=["host", "qemu"],
)
def bench(request: pytest.FixtureRequest) -> Iterator[tuple[Relay, Line]]:
    with relayed(request.param()) as relay, open_line(relay.port) as line:
        yield relay, line


def session_on(bench: tuple[Relay, Line]) -> Session:
    relay, line = bench
    relay.disturb(undisturbed)
    return Session(line, timeout_s=TIMEOUT_S, attempts=PATIENT)


@pytest.fixture(scope="module")
def sound(bench: tuple[Relay, Line]) -> list[Result]:
    return estimates(run(session_on(bench), SAMPLES))


def run_with(session: Session, made: Configuration, samples: list[Sample]) -> list[Result]:
    session.hello()
    session.configure(made)
    session.start()
    return [session.exchange(one) for one in samples]


@pytest.mark.parametrize("seeded", [False, True], ids=["from zero", "from an estimate"])
def test_estimates_are_those_of_the_module_to_the_bit(
    bench: tuple[Relay, Line], seeded: bool
) -> None:
    made = configuration()
    if seeded:
        u = np.eye(6) + np.triu(np.arange(36.0).reshape(6, 6) / 100, 1)
        theta = np.array([-0.9, 0.1, -0.05, 0.002, 0.003, 0.001])
        start = Seed(theta, u, np.arange(1.0, 7.0), 1e-6)
        made = replace(made, estimator=replace(made.estimator, seed=start))
    results = run_with(session_on(bench), made, [sample(number) for number in range(SAMPLES)])
    here = made.estimator.estimator()
    for number, result in enumerate(results):
        status = here.step(result.command_v, sample(number).position_m)
        there = (result.status, result.innovation_m, result.forgetting_factor, result.resets)
        assert there == (status, here.innovation, here.forgetting_factor, here.resets), number
        assert result.residual_variance_m2 == here.residual_variance
        assert result.excitation == here.excitation
        assert result.converged == here.converged
        assert result.theta == tuple(here.theta_hat), number
    assert any(result.theta != results[0].theta for result in results)


def test_a_servo_is_told_as_by_the_module_to_the_bit(bench: tuple[Relay, Line]) -> None:
    """In a loop with the target, with settings of its own."""
    dt_s, session, chance = 0.02, session_on(bench), random.Random(2)
    controller = replace(CONTROLLER, fixed_gain_v_m=60.0, gain_max_v_m=90.0)
    servo = ServoSettings(dt_s, 2, 0.05, 0.25)
    session.hello()
    session.configure(replace(configuration(), controller=controller, servo=servo))
    session.start()
    here = ehsid.ServoEstimator(dt_s, delay=2, drift=0.05, tolerance=0.25)
    position = velocity = acceleration = command = reference = 0.0
    trusted = 0
    for number in range(500):
        if number % 20 == 0:
            reference = chance.choice((-0.02, 0.0, 0.02))
        shown = float(np.float32(position + chance.gauss(0.0, 5e-6)))
        result = session.exchange(Sample(number, shown, reference))
        status = here.step(result.command_v, shown)
        ours = [
            (one.value, one.half_width, int(one.reason))
            for one in (here.servo().gain, here.servo().omega_n, here.servo().xi)
        ]
        assert isinstance(result, ServoResult)
        assert result.status == status
        np.testing.assert_array_equal(result.tracked, ours)  # NaN where both have none yet
        trusted += result.velocity_gain_reason == 0
        for _ in range(20):  # 12 rad/s and 0.5, with one more sample of delay than by itself
            acceleration += dt_s / 20 * (144.0 * (0.05 * command - velocity) - 12.0 * acceleration)
            velocity += dt_s / 20 * acceleration
            position += dt_s / 20 * velocity
        command = result.command_v
    assert 0 < trusted < 500


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_faults_change_nothing(bench: tuple[Relay, Line], sound: list[Result], seed: int) -> None:
    session, faults = session_on(bench), Seeded(seed, hold_s=1.5 * TIMEOUT_S)
    bench[0].disturb(faults)
    results = run(session, SAMPLES)
    assert estimates(results) == sound
    assert faults.made


def test_the_target_counts_what_it_sees(bench: tuple[Relay, Line]) -> None:
    session = session_on(bench)
    session.hello()
    session.configure(configuration())
    session.start()
    before = session.exchange(sample(0))

    def disturb(way: str, number: int, frame: bytes) -> Passing:
        kind = decode(frame).kind
        if kind == 0x04 and number == 0:
            return Passing(b"\7nonsense\0" + frame + b"\0" + frame + b"\0")
        return undisturbed(way, number, frame)

    bench[0].disturb(disturb)
    session.exchange(sample(1))
    after = session.exchange(sample(2))
    assert after.bad_frames >= before.bad_frames + 1
    assert after.repeated >= before.repeated + 1


@pytest.mark.slow
def test_a_line_that_stands_still_trips_the_watchdog_and_the_run_goes_on(
    bench: tuple[Relay, Line], sound: list[Result]
) -> None:
    session = session_on(bench)
    held: list[int] = []

    def hold(way: str, number: int, frame: bytes) -> Passing:
        if way == TO_TARGET and decode(frame).kind == 0x04 and number == 10:
            held.append(number)
            return Passing(frame + b"\0", 1.0)  # several times the watchdog's
        return undisturbed(way, number, frame)

    bench[0].disturb(hold)
    results = run(session, SAMPLES, watchdog_ms=200)
    assert held
    assert session.counters.resumed >= 1
    assert results[-1].trips >= 1
    assert estimates(results) == sound


@pytest.mark.slow
def test_a_host_that_falls_silent_leaves_a_closed_valve(bench: tuple[Relay, Line]) -> None:
    relay, _ = bench
    session = session_on(bench)
    session.hello()
    session.configure(configuration(watchdog_ms=200))
    session.start(first=1)
    notices: list[Safe] = []

    def listen(way: str, number: int, frame: bytes) -> Passing:
        packet = decode(frame)
        if packet.kind == 0x86:
            notices.append(Safe.parse(packet.body))
        return undisturbed(way, number, frame)

    relay.disturb(listen)
    result = session.exchange(sample(1))
    notices.clear()  # of a machine so loaded that it was late before
    assert result.command_v != 0.0
    wait_until(lambda: len(notices) >= 2)  # said again every second
    for notice in notices:
        assert notice.valve_command_v == 0.0
        assert notice.expected == 2
    assert session.exchange(sample(2)).trips == notices[-1].trips
    session.stop()


def test_a_reset_in_mid_run(bench: tuple[Relay, Line], sound: list[Result]) -> None:
    """Told at once, and what follows is a run that begins there."""
    relay, _ = bench
    session = session_on(bench)
    samples = [sample(number) for number in range(10)]
    results = run_with(session, configuration(), samples)
    assert estimates(results) == sound[:10]
    reset: list[int] = []

    def reset_before(way: str, number: int, frame: bytes) -> Passing:
        if way == TO_TARGET and not reset:
            reset.append(number)
            relay.device.reset()
        return undisturbed(way, number, frame)

    relay.disturb(reset_before)
    with pytest.raises(TargetReset):  # a sample or more later: the emulator takes its time
        results += [session.exchange(sample(number)) for number in range(10, SAMPLES)]
    session.hello()
    session.configure(configuration())
    session.start(first=10)
    again = [session.exchange(sample(number)) for number in range(10, SAMPLES)]
    assert [result.number for result in again] == list(range(10, SAMPLES))
    here = configuration().estimator.estimator()
    for result in again:
        here.step(result.command_v, sample(result.number).position_m)
    assert again[-1].theta == tuple(here.theta_hat)
    assert again[-1].trips == 0  # begun anew


def test_settings_of_the_controller_that_the_target_refuses(bench: tuple[Relay, Line]) -> None:
    session = session_on(bench)
    session.hello()
    made = configuration()
    with pytest.raises(HilError, match=r"refused the configuration: invalid argument in the set"):
        session.configure(replace(made, controller=replace(made.controller, gain_max_v_m=1.0)))


def test_a_configuration_that_the_firmware_does_not_hold(bench: tuple[Relay, Line]) -> None:
    session = session_on(bench)
    identity = session.hello()
    made = configuration(NEVER_MS)
    orders = next(
        replace(made.estimator.orders, na=na)
        for na in range(1, 7)
        if na + 3 not in identity.parameters
    )
    other = replace(made, estimator=replace(made.estimator, orders=orders))
    with pytest.raises(HilError, match="no estimator of"):
        session.configure(other)
    session.identity = None  # asks all the same: the target says it too
    with pytest.raises(HilError, match="has no estimator of this policy and number of parameters"):
        session.configure(other)

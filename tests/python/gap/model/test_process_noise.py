# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from scipy.signal import cont2discrete, dlsim
from servo_records import AXIS, RIG, made

from ehsid.harness.gap.model.case import Case, make_case
from ehsid.harness.gap.model.inverse_signals import all_values
from ehsid.harness.gap.model.linear_noise import linear_servo, position_covariance
from ehsid.harness.gap.model.process_noise import noise_needed

VALUES = all_values(RIG, {})
STEP_S = 5e-3
COUNT = 100


def case_of() -> Case:
    records = [made({}, columns=("position_m",), seed=seed) for seed in (1, 2)]
    return make_case(RIG, records[:1], records[1:])


CASE = case_of()


def test_covariance_is_that_of_simulated_noise() -> None:
    """The expected covariance is that of many runs of the disturbance with scipy."""
    state, entries = linear_servo(VALUES, "ehs", 0.2)
    (input_vector,) = entries["mechanics"]
    corner_hz = 5.0
    expected = position_covariance(state, input_vector, corner_hz, STEP_S, 20)
    augmented = np.zeros((7, 7))
    augmented[0, 0] = -2.0 * np.pi * corner_hz
    augmented[1:, 0], augmented[1:, 1:] = input_vector, state
    drive = np.zeros((7, 1))
    drive[0] = 1.0
    system = cont2discrete((augmented, drive, np.eye(7)[-1:], np.zeros((1, 1))), STEP_S / 4)
    rng = np.random.default_rng(0)
    runs = []
    for _ in range(400):
        _, y, _ = dlsim(system, rng.standard_normal(600 + 80))
        # The system is in its steady state before the position is reset.
        runs.append(y[603::4, 0] - y[599, 0])
    noise = np.cov(np.array(runs)[:, :20].T)
    noise *= 20 / np.trace(noise)
    # The standard error of a variance from 400 draws is 7 %; the tolerance is three of them.
    np.testing.assert_allclose(noise, expected, atol=0.21 * expected.max())


def test_the_linear_servo_has_the_poles_of_a_cylinder() -> None:
    state, _ = linear_servo(VALUES, "ehs", 0.2)
    poles = np.linalg.eigvals(state)
    assert np.sum(np.abs(poles) < 1e-6) == 1
    assert np.all(poles.real < 1e-9)
    # The oil spring of both chambers at mid-stroke has w^2 = beta (A_a^2 / V_a + A_b^2 / V_b) / m.
    v = RIG.values
    a = np.pi / 4 * v["cylinder.bore_m"] ** 2
    b = a - np.pi / 4 * v["cylinder.rod_m"] ** 2
    half_stroke = 0.5 * v["cylinder.stroke_m"]
    spring = v["fluid.bulk_modulus_pa"] * (
        a**2 / (v["cylinder.dead_volume_a_m3"] + a * half_stroke)
        + b**2 / (v["cylinder.dead_volume_b_m3"] + b * half_stroke)
    )
    oil = poles[np.abs(poles.imag) > 1.0]
    pole = np.min(np.abs(np.abs(oil) - np.sqrt(spring / v["load.mass_kg"])))
    # A damping ratio of 0.1 changes the frequency by less than 1 %.
    assert pole < 0.02 * np.sqrt(spring / v["load.mass_kg"])


def drawn_error(subsystem: str, seed: int, times: float = 50.0) -> np.ndarray:
    """Errors by noise in a subsystem, `times` the noise floor, drawn window by window."""
    problem = CASE.problem()
    (record,) = problem.records
    numbers = record.window[record.used]
    rng = np.random.default_rng(seed)
    state, entries = linear_servo(VALUES, "ehs", 0.2)
    if subsystem == "sensor":
        covariance = np.eye(COUNT)
    else:
        covariance = sum(
            position_covariance(state, b, 5.0, STEP_S, COUNT) for b in entries[subsystem]
        ) / len(entries[subsystem])
    factor = np.linalg.cholesky(covariance + 1e-9 * np.eye(COUNT))
    floor = problem.floors["position_m"]
    parts = []
    for number in range(int(numbers.max()) + 1):
        size = int(np.count_nonzero(numbers == number))
        slow = np.repeat(factor @ rng.standard_normal(COUNT), 5)[:size]
        window_error = times * floor * slow + floor * rng.standard_normal(size)
        parts.append(window_error - window_error.mean())
    return np.concatenate(parts)


@pytest.mark.parametrize("subsystem", ["valve", "hydraulics", "mechanics", "sensor"])
def test_the_noisy_subsystem_is_among_the_best(subsystem: str) -> None:
    noise = noise_needed(CASE.problem(), {}, drawn_error(subsystem, 1))
    assert noise is not None
    assert noise.deficit[subsystem] < 0.05
    assert noise.subsystem[subsystem] > 0.3
    assert sum(noise.subsystem.values()) == pytest.approx(1.0)
    # White noise differs most; disturbances by force and by flow are more similar.
    others = {"valve", "hydraulics", "mechanics"} if subsystem == "sensor" else {"sensor"}
    assert sum(noise.subsystem[name] for name in others) < 0.1


def test_the_sensor_noise_is_estimated() -> None:
    noise = noise_needed(CASE.problem(), {}, drawn_error("sensor", 2, times=20.0))
    assert noise is not None
    expected = 20.0 * CASE.problem().floors["position_m"]
    # The intensities on the grid differ by a factor of 1.4.
    assert noise.deviation["sensor"] == pytest.approx(expected, rel=0.25)


def test_an_axis_has_neither_valve_nor_oil() -> None:
    friction = {"effects.coulomb_friction.force_n": 40.0}
    records = [made(friction, rig=AXIS, columns=("position_m",), seed=seed) for seed in (1, 2)]
    problem = make_case(AXIS, records[:1], records[1:]).problem()
    error = problem.errors(problem.centre())["position_m"]
    noise = noise_needed(problem, {}, error)
    assert noise is not None
    assert set(noise.subsystem) == {"mechanics", "sensor", "timing"}


def test_sensor_noise_at_the_floor_needs_no_process_noise() -> None:
    noise = noise_needed(CASE.problem(), {}, drawn_error("sensor", 3, times=0.0))
    assert noise is not None
    assert noise.subsystem == {}

# SPDX-License-Identifier: MIT
"""Laws of wide machines against closed forms: friction, hysteresis, laps, supply, late samples."""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reality_runs import DT_S, drawn_case, own_run
from scipy.integrate import quad, solve_ivp

from ehsid.lab.blind.making import Answer
from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.case import start_state
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.variants import Variants, draw_variants, with_friction, with_variants

FloatArray = npt.NDArray[np.float64]
FORCE_N, BRISTLE_M = 700.0, 2e-5


def seals(static_n: float = FORCE_N, **law: float) -> Truth:
    machine = with_friction(Truth(100.0, 0.0, 1.0), FORCE_N, static_n, 0.02, BRISTLE_M)
    return machine._replace(**law)


def deflection(
    t: Truth,
    speed: Callable[[float], float],
    end: float,
    start: float = 0.0,
    max_step: float = math.inf,
) -> FloatArray:
    """Deflection of the bristles, m, at 2001 times from 0 to `end`, s, by scipy."""
    solution = solve_ivp(
        lambda time, z: [
            equations.bristle_rate(speed(time), z[0], equations.sliding_friction(speed(time), t), t)
        ],
        (0.0, end),
        [start],
        rtol=1e-10,
        atol=1e-16,
        max_step=max_step,
        t_eval=np.linspace(0.0, end, 2001),
    )
    return np.asarray(solution.y[0])


@pytest.mark.slow
@given(exponent=st.floats(1.0, 2.0), way=st.floats(0.1, 20.0))
def test_dahl_force_over_the_way(exponent: float, way: float) -> None:
    """Constant speed from rest: dF/dx = s0 (1 - F / F_s)^i has a closed solution."""
    t = seals(dahl_exponent=exponent)
    z = deflection(t, lambda _: 1e-3, way * BRISTLE_M / 1e-3)[-1]
    if exponent < 1.0 + 1e-6:
        left = math.exp(-way)
    else:
        left = (1.0 + (exponent - 1.0) * way) ** (-1.0 / (exponent - 1.0))
    force = equations.bristle_force(z, FORCE_N, t)
    assert force / FORCE_N == pytest.approx(1.0 - left, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(
    "amplitude", [1.0, *(pytest.param(one, marks=pytest.mark.thorough) for one in (0.3, 5.0))]
)
def test_area_of_the_loop_of_dahl(amplitude: float) -> None:
    """In a settled cycle with the exponent 1, friction takes 4 F_s^2 / s0 (a - tanh a)."""
    t = seals(dahl_exponent=1.0)
    omega, reach = 2.0 * math.pi, amplitude * BRISTLE_M
    cycles = 40.0 if amplitude < 1.0 else 8.0  # the first cycles depend on the start
    z = deflection(t, lambda time: reach * omega * math.cos(omega * time), cycles, 0.0, 0.01)
    z = deflection(t, lambda time: reach * omega * math.cos(omega * time), 1.0, float(z[-1]), 0.01)
    position = reach * np.sin(omega * np.linspace(0.0, 1.0, z.size))
    force = np.array([equations.bristle_force(one, FORCE_N, t) for one in z])
    area = np.trapezoid(force, position)
    expected = 4.0 * FORCE_N * BRISTLE_M * (amplitude - math.tanh(amplitude))
    # 2000 points a cycle: the trapezoidal rule has an error of (2 pi / 2000)^2 / 12 = 1e-6.
    assert area == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("power", [1.2, 2.0])
@pytest.mark.parametrize("sigma", [0.6, 1.0])
def test_bouc_wen_along_its_branches(power: float, sigma: float) -> None:
    """Way of a branch by quadrature: dx = zeta dw / (1 - w^n) and, in the other direction,
    dx = zeta dw / (1 + (2 sigma - 1) w^n).
    """
    t = seals(bouc_wen_power=power, bouc_wen_sigma=sigma)
    speed = 1e-3
    way, _ = quad(lambda w: 1.0 / (1.0 - w**power), 0.0, 0.8)
    z = deflection(t, lambda _: speed, way * BRISTLE_M / speed)[-1]
    assert z / BRISTLE_M == pytest.approx(0.8, abs=1e-6)
    back, _ = quad(lambda w: 1.0 / (1.0 + (2.0 * sigma - 1.0) * w**power), 0.1, 0.8)
    z = deflection(t, lambda _: -speed, back * BRISTLE_M / speed, z)[-1]
    assert z / BRISTLE_M == pytest.approx(0.1, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("law", [{"dahl_exponent": 1.4}, {"bouc_wen_power": 1.7}])
def test_sliding_force_of_the_other_laws(law: dict[str, float]) -> None:
    """Long after a start, friction is Coulomb's for Dahl, and Stribeck's curve for Bouc-Wen."""
    t = seals(FORCE_N if "dahl_exponent" in law else 1.8 * FORCE_N, **law)
    for speed in (2e-3, 0.02, 0.1):
        g = equations.sliding_friction(speed, t)
        z = deflection(t, lambda _, speed=speed: speed, 400.0 * BRISTLE_M / speed)[-1]  # type: ignore[misc]
        # With the exponent 1.4, (1 + 0.4 * 400)^(-1 / 0.4) = 3e-6 of the force is missing.
        assert equations.bristle_force(z, g, t) == pytest.approx(g, rel=1e-5)


@given(
    v=st.floats(-1.0, 1.0),
    share=st.floats(-1.0, 1.0),
    exponent=st.floats(1.0, 2.0),
    sigma=st.floats(0.5, 1.0),
)
def test_bristle_damping_takes_energy(
    v: float, share: float, exponent: float, sigma: float
) -> None:
    for law in (
        {"dahl_exponent": exponent},
        {"bouc_wen_power": exponent, "bouc_wen_sigma": sigma},
    ):
        t = seals(**law)
        assert equations.bristle_rate(v, share * BRISTLE_M, FORCE_N, t) * v >= -1e-12


def operator(seed: int, half_width: float) -> Truth:
    rng = np.random.default_rng(seed)
    variants = draw_variants(rng)
    while not variants.play_weights[0]:
        variants = draw_variants(rng)
    machine = drawn_case(5, "plain", effects=["valve_hysteresis"]).truth
    return with_variants(machine._replace(play=half_width), variants, ["valve_hysteresis"])


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_hysteresis_of_weighted_plays(seed: int) -> None:
    """A large loop is as wide as that of the play; small reversals give the initial curve twice."""
    half_width = 0.03
    t = operator(seed, half_width)
    widths, weights = np.array(t.play_half_widths), np.array(t.play_weights)
    assert 3 <= np.count_nonzero(weights) <= 5
    assert weights.sum() == pytest.approx(1.0)
    plays = np.zeros(5)
    top = equations.hysteresis(0.5, plays, t)
    assert top == pytest.approx(0.5 - half_width)
    for fall in (0.01, 0.05, 0.2):
        # Masing: after a turn, a play stands until the input has come back by its whole width.
        expected = top - float(weights @ np.maximum(fall - 2.0 * widths, 0.0))
        assert equations.hysteresis(0.5 - fall, plays, t) == pytest.approx(expected)
    assert equations.hysteresis(0.0, plays, t) == pytest.approx(half_width)
    assert equations.hysteresis(0.5, plays, t) == pytest.approx(top)  # the loop closes


def test_run_passes_the_command_through_the_operator() -> None:
    t = operator(1, 0.03)
    t = t._replace(amplifier_s=0.0, spool_rad_s=2.0 * math.pi * 400.0, spool_damping=1.0)
    start = start_state(t, 0.5 * t.stroke_m)
    out = own_run(t, start, np.concatenate((np.full(20, 0.3), np.full(20, -0.1))))
    # After 20 ms, a spool of 400 Hz is at its command to exp(-50).
    assert out[20, equations.OUT_X] == pytest.approx(0.27, abs=1e-9)
    assert out[40, equations.OUT_X] == pytest.approx(-0.07, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_unequal_ends_keep_the_width_of_the_dead_band(seed: int) -> None:
    machine = drawn_case(seed, "plain", effects=["valve_dead_band"]).truth
    changed = with_variants(machine, Variants(lap_difference=0.2), ["valve_dead_band"])
    laps = {name: getattr(changed, f"overlap_{name}") for name in ("pa", "at", "pb", "bt")}
    old = [getattr(machine, f"overlap_{name}") for name in laps]
    assert math.fsum(laps.values()) == pytest.approx(math.fsum(old))
    # Edges pa and bt open at positive commands.
    difference = laps["pa"] + laps["bt"] - laps["at"] - laps["pb"]
    equal = old[0] + old[3] - old[1] - old[2]
    assert difference - equal == pytest.approx(0.2 * math.fsum(old))
    # A null bias is added to the opening: it moves the middle of the dead band the other way.
    overlap = 0.25 * math.fsum(old)
    sizes = {"valve_dead_band": {"overlap": overlap}}
    told = Answer("one", "wide", "ehs", "", (), sizes, ("valve",), variants={"lap_difference": 0.2})
    assert told.null_bias == pytest.approx(-0.25 * (difference - equal))
    assert with_variants(machine, Variants(lap_difference=0.2), ["valve_lag"]) == machine


@pytest.mark.slow
@pytest.mark.parametrize("droops", [False, True])
@pytest.mark.parametrize("seed", range(6))
def test_relief_valve_holds_the_pressure_up_to_the_flow_of_the_pump(
    seed: int, droops: bool
) -> None:
    effects = ["supply_droop" if droops else "valve_lag"]
    machine = drawn_case(seed, "plain", effects=effects).truth
    relief = Variants(relief_flow=0.5, relief_loss=0.016)
    t = with_variants(machine, relief, effects)
    full = t.flow_gain * (0.5 * (t.source_pa - t.tank_pa)) ** t.flow_exponent

    def pressure_at(flow: float) -> float:
        low, high = 0.0, t.source_pa
        for _ in range(60):
            middle = 0.5 * (low + high)
            low, high = (
                (middle, high) if equations.supplied_flow(middle, t) > flow else (low, middle)
            )
        return low

    assert pressure_at(0.0) == pytest.approx(t.source_pa)
    slopes = [
        (pressure_at(share * full) - pressure_at((share + 0.1) * full)) for share in (0.2, 0.6)
    ]
    assert slopes[1] > 3.0 * slopes[0] > 0.0
    if droops:  # the loss at full flow is that of the catalogue's law
        loss = machine.source_resistance_pa_s_m3 * full
        assert t.source_pa - pressure_at(full) == pytest.approx(loss)
    else:  # the largest flow has the whole pressure over one edge
        assert t.source_pa - pressure_at(2.0**t.flow_exponent * full) < 0.02 * t.source_pa


@pytest.mark.parametrize("effect", ["coulomb_friction", "sensor_lag", "sensor_backlash"])
def test_late_samples_are_those_of_a_finer_run(effect: str) -> None:
    t = drawn_case(5, "plain", effects=[effect]).truth._replace(sensor_step_m=1e-12)
    start = start_state(t, 0.5 * t.stroke_m)
    n, fine, late = 60, 10, 2

    def outputs(samples: int, dt_s: float, late_s: float) -> FloatArray:
        quiet, forward = np.zeros(samples), np.full(samples, 0.6)
        lost = np.zeros(samples, dtype=np.bool_)
        late_by = np.full(samples, late_s)
        arguments = (start, dt_s, forward, quiet, 0.0, 1e-12, quiet, late_by, lost, 4)
        return np.asarray(equations.run(t, *arguments)[1])

    coarse = outputs(n, DT_S, late * DT_S / fine)
    exact = outputs(n * fine, DT_S / fine, 0.0)
    # The first sample precedes the first command. Both solutions are within 1e-4 of scipy's.
    for column in (equations.OUT_Y, equations.OUT_P_A, equations.OUT_P_B, equations.OUT_X):
        expected = exact[fine + late :: fine, column]
        assert np.ptp(expected) > 0.0
        np.testing.assert_allclose(coarse[1:, column], expected, atol=2e-4 * np.ptp(expected))

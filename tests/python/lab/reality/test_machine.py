# SPDX-License-Identifier: MIT
"""The solution of the blind machine is that of scipy, for single terms and whole runs."""

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reality_runs import DT_S, drawn_case, own_run
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.case import start_state
from ehsid.lab.reality.effects import CATALOGUE
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.unnamed import OUTSIDE, UNNAMED
from ehsid.lab.reality.variants import Variants, balance, with_variants

FloatArray = npt.NDArray[np.float64]


def oil(bulk: float = 1e9, slope: float = 5.0, gas: float = 1e-5) -> Truth:
    machine = Truth(1.0, 1.0, 1.0, bulk_modulus_0_pa=bulk, bulk_slope=slope, gas_fraction=gas)
    return machine._replace(balance_pa=balance(machine))


@given(
    log_p=st.floats(1.0, 7.7),
    bulk=st.floats(5e8, 2e9),
    slope=st.floats(1.0, 20.0),
    log_gas=st.floats(-6.0, -1.5),
)
def test_pressure_inverts_compression(
    log_p: float, bulk: float, slope: float, log_gas: float
) -> None:
    p = 10.0**log_p
    t = oil(bulk, slope, 10.0**log_gas)
    args = (t.bulk_slope, t.bulk_modulus_0_pa, t.gas_fraction)
    c = equations.compression(p, *args)
    assert equations.pressure(c, *args, t.balance_pa) == pytest.approx(p, rel=1e-9)
    root = brentq(lambda q: equations.compression(q, *args) - c, 0.5 * p, 2.0 * p, xtol=1e-9 * p)
    assert equations.pressure(c, *args, t.balance_pa) == pytest.approx(root, rel=1e-8)


@pytest.mark.parametrize("fraction", [1e-5, 5e-3, 3e-2])
@pytest.mark.parametrize("p", [5e5, 2e6, 1e7])
def test_air_softens_the_oil_as_the_catalogue_says(fraction: float, p: float) -> None:
    t = oil(gas=fraction)
    args = (t.bulk_slope, t.bulk_modulus_0_pa, t.gas_fraction)
    h = 1e-4 * p
    bulk = 2.0 * h / (equations.compression(p + h, *args) - equations.compression(p - h, *args))
    beta = t.bulk_modulus_0_pa + t.bulk_slope * p
    r = (101325.0 / p) ** (1.0 / 1.3)
    expected = beta * (1.0 + fraction * r) / (1.0 + fraction * r * beta / (1.3 * p))
    # The gas does not take volume from the oil in Murnaghan's law: the factor 1 + alpha r.
    assert bulk == pytest.approx(expected, rel=1.01 * fraction * r + 1e-6)


@given(
    drop=st.floats(-3e7, 3e7),
    exponent=st.floats(0.4, 0.7),
    transition=st.floats(1e3, 5e5),
)
def test_orifice_is_odd_increasing_and_meets_the_power_law(
    drop: float, exponent: float, transition: float
) -> None:
    q = equations.orifice(drop, exponent, transition)
    assert q == -equations.orifice(-drop, exponent, transition)
    assert equations.orifice(drop + 1e3, exponent, transition) > q
    if abs(drop) >= transition:
        assert abs(q) == pytest.approx(abs(drop) ** exponent, rel=1e-12)
    below = equations.orifice(transition * (1.0 - 1e-6), exponent, transition)
    above = equations.orifice(transition * (1.0 + 1e-6), exponent, transition)
    slope = (above - below) / (2e-6 * transition)
    assert slope == pytest.approx(exponent * transition ** (exponent - 1.0), rel=1e-5)


@given(s=st.floats(-0.1, 0.1), width=st.floats(1e-4, 2e-2))
def test_edge_is_between_sharp_and_a_quarter_of_its_width_more(s: float, width: float) -> None:
    sharp = max(s, 0.0)
    assert sharp <= equations.edge(s, width) <= sharp + 0.25 * width * (1.0 + 1e-12)
    # An edge opens by as much as the opposite edge closes.
    both = equations.edge(s, width) - equations.edge(-s, width)
    assert both == pytest.approx(s, abs=1e-15)


def spool_commands(t: Truth, times: FloatArray, commands: FloatArray) -> FloatArray:
    """Command after delay and play or stiction at the start of each interval."""
    spool_command = 0.0
    widths, weights = np.array(t.play_half_widths), np.array(t.play_weights)
    plays = np.zeros(widths.size)
    out = []
    for time in times:
        k = max(math.floor((time - t.delay_s) / DT_S + 1e-9), 0)
        u = commands[k]
        if t.stick > 0.0:
            spool_command = u if abs(u - spool_command) > t.stick else spool_command
        elif weights.any():
            plays = np.clip(plays, u - widths, u + widths)
            spool_command = float(weights @ plays)
        else:
            spool_command = float(np.clip(spool_command, u - t.play, u + t.play))
        out.append(spool_command)
    return np.array(out)


def scipy_run(t: Truth, start: FloatArray, commands: FloatArray) -> FloatArray:
    """States at the samples by LSODA; the play of the sensor from the steps of the solver."""
    grid = DT_S * np.arange(commands.size + 1)
    switches = np.unique(np.round(np.concatenate((grid, grid + t.delay_s % DT_S)), 12))
    switches = switches[switches <= grid[-1] + 1e-12]
    commands_of_spool = spool_commands(t, switches[:-1], commands)
    state, sensor_position = start.copy(), start[equations.Y]
    states = [np.append(state, sensor_position)]
    for begin, end, u in zip(switches[:-1], switches[1:], commands_of_spool, strict=True):

        def slope(
            time: float, s: FloatArray, u: float = u, sensor_position: float = sensor_position
        ) -> FloatArray:
            d = np.empty(equations.STATES)
            equations.slope_of(time, s, u, sensor_position, t, d)
            return d

        solution = solve_ivp(slope, (begin, end), state, method="LSODA", rtol=1e-8, atol=1e-13)
        state = solution.y[:, -1]
        for y in solution.y[equations.Y]:
            sensor_position = float(
                np.clip(sensor_position, y - t.sensor_play_m, y + t.sensor_play_m)
            )
        if np.abs(grid - end).min() < 1e-9:
            states.append(np.append(state, sensor_position))
    return np.array(states)


def wave(n: int) -> FloatArray:
    time = DT_S * np.arange(n)
    return np.asarray(0.5 * np.sin(2.0 * np.pi * 9.0 * time) + 0.2 * np.sign(np.sin(150.0 * time)))


OUTSIDE_EQUATIONS = [
    name
    for name in (*OUTSIDE, "heating_oil", "dissolving_air")
    if "sensor" not in name and "frames" not in name
]


UNNAMED_EQUATIONS = [name for name in UNNAMED if UNNAMED[name].adds_to not in ("sensor", "delay")]


@pytest.mark.slow
@pytest.mark.parametrize("effect", [*CATALOGUE, *OUTSIDE_EQUATIONS, *UNNAMED_EQUATIONS])
@pytest.mark.parametrize("grade", ["plain", pytest.param("hard", marks=pytest.mark.thorough)])
def test_run_agrees_with_scipy_for_each_effect(effect: str, grade: str) -> None:
    kind = "one" if effect in CATALOGUE else "open"
    t = drawn_case(5, grade, kind, [effect]).truth  # type: ignore[arg-type]
    assert_agrees_with_scipy(t)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "variants"),
    [
        ("coulomb_friction", Variants(seals="Dahl", dahl_exponent=1.6)),
        ("stribeck_friction", Variants(seals="Bouc-Wen", bouc_wen_power=1.8, bouc_wen_sigma=0.7)),
        ("supply_droop", Variants(relief_flow=0.5, relief_loss=0.01)),
        ("supply_ripple", Variants(relief_flow=0.5, relief_loss=0.01)),
        (
            "valve_hysteresis",
            Variants(play_shares=(0.4, 1.0, 1.6, 0.0, 0.0), play_weights=(0.3, 0.4, 0.3, 0.0, 0.0)),
        ),
        ("valve_hysteresis", Variants(spool_friction_way=0.3)),
        ("internal_leakage", Variants(worn=(0.01, 0.02, 0.03, 0.05))),
        ("valve_dead_band", Variants(lap_difference=-0.2)),
    ],
)
def test_run_agrees_with_scipy_for_each_law(effect: str, variants: Variants) -> None:
    kind = "one" if effect in CATALOGUE else "open"
    machine = drawn_case(5, "hard", kind, [effect]).truth  # type: ignore[arg-type]
    t = with_variants(machine, variants, [effect])
    assert t != machine
    assert_agrees_with_scipy(t)


def assert_agrees_with_scipy(t: Truth) -> None:
    start = start_state(t, 0.5 * t.stroke_m)
    commands = wave(60)
    outputs = own_run(t, start, commands)
    reference = scipy_run(t, start, commands)
    position = reference[:, equations.Y]
    pressures = np.array(
        [equations.chamber_pressures(k * DT_S, s[:-1].copy(), t) for k, s in enumerate(reference)]
    )
    read = position
    if t.sensor_lag_s > 0.0:
        read = reference[:, equations.M]
    elif t.sensor_play_m > 0.0:
        read = reference[:, -1]
    travel, pressure_range = np.ptp(position), np.ptp(pressures)
    # In a step the fastest oscillation turns by 1/6 rad, with an error of (1/6)^5 / 120 = 1e-6 of
    # its amplitude. It decays within a hundred steps. Friction and slew rate have no larger errors.
    tolerance = 1e-4
    np.testing.assert_allclose(outputs[:, equations.OUT_Y], read, atol=tolerance * travel)
    for column, p in ((equations.OUT_P_A, pressures[:, 0]), (equations.OUT_P_B, pressures[:, 1])):
        np.testing.assert_allclose(outputs[:, column], p, atol=tolerance * pressure_range)


def test_solution_is_of_fourth_order() -> None:
    t = drawn_case(5, "plain", "none").truth
    # All equations are smooth: no slew limit, and the edges are rounded over the whole travel.
    t = t._replace(spool_slew_1_s=1e9, round_width=2.0, hum_share=0.0, transition_pa=1e8)
    start = start_state(t, 0.5 * t.stroke_m)
    commands = 0.3 * np.sin(2.0 * np.pi * 9.0 * DT_S * np.arange(60))
    refinements = (1, 2, 4, 8)
    exact = own_run(t, start, commands, 64)[:, equations.OUT_P_A]
    errors = [
        np.abs(own_run(t, start, commands, refinement)[:, equations.OUT_P_A] - exact).max()
        for refinement in refinements
    ]
    steps = [
        math.ceil(DT_S * equations.steps_per_second(start, t, refinement))
        for refinement in refinements
    ]
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(4.0, abs=0.2)

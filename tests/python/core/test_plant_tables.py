# SPDX-License-Identifier: MIT
"""Laws by tables: each does what the effect of the catalogue does whose law it holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import plant_runs as runs
import pytest
from plant_reference import OUTPUTS, typical

import ehsid

COMMAND = runs.steps(7, 150, 15, 5.0)
STROKE_M = typical()["cylinder.stroke_m"]
LONG_S = [0.0, 10.0]
Table = tuple[str, str, Sequence[float]]


def simulated(
    values: Mapping[str, float],
    tables: Sequence[Table] = (),
    at_knots: Sequence[float] = (),
    plant: str = "ehs",
    substeps: int = 4,
    varied: Sequence[int] = (),
) -> tuple[np.ndarray, np.ndarray]:
    row = np.hstack([runs.vector(values), np.array(at_knots, dtype=float).reshape(1, -1)])
    outputs, slopes = ehsid.simulate_plant(
        plant, row, COMMAND, dt_s=runs.DT_S, substeps=substeps, varied=varied, tables=tables
    )
    return outputs[0], slopes[0]


def assert_alike(found: np.ndarray, expected: np.ndarray, share: float) -> None:
    """Differences as shares of the range of each output; the effects change them by far more."""
    plain, _ = simulated(typical())
    for j, name in enumerate(OUTPUTS):
        range_ = np.ptp(expected[:, j])
        assert np.max(np.abs(found[:, j] - expected[:, j])) <= share * range_, name
    assert np.max(np.abs(plain[:, 0] - expected[:, 0])) > 1e-3 * np.ptp(expected[:, 0])


@pytest.mark.parametrize(
    ("effect", "tables", "at_knots"),
    [
        ({"load_force.force_n": 900.0}, [("force", "time_s", LONG_S)], [900.0, 900.0]),
        (
            {"load_spring.stiffness_n_m": 8000.0, "load_spring.force_at_mid_stroke_n": 300.0},
            [("force", "position_m", [0.0, STROKE_M])],
            [300.0 - 4000.0 * STROKE_M, 300.0 + 4000.0 * STROKE_M],
        ),
        ({"valve_null_bias.offset": 0.02}, [("spool", "spool", [-1.0, 1.0])], [0.02, 0.02]),
        ({"transport_delay.delay_s": 0.0043}, [("delay", "time_s", LONG_S)], [0.0043, 0.0043]),
    ],
    ids=["load_force", "load_spring", "null_bias", "delay"],
)
def test_a_table_does_what_the_named_effect_does(
    effect: Mapping[str, float], tables: Sequence[Table], at_knots: Sequence[float]
) -> None:
    named = typical() | {f"effects.{name}": value for name, value in effect.items()}
    # The pressures in balance at the start do not know of a table.
    balance = dict.fromkeys(("initial.pressure_a_pa", "initial.pressure_b_pa"), 5000000.0)
    expected, _ = simulated(named | balance)
    found, _ = simulated(typical() | balance, tables, at_knots)
    assert_alike(found, expected, 1e-9)


def test_a_force_that_rises_with_the_velocity_is_viscous_friction() -> None:
    """As steep as ten times the damping that a leapfrog with explicit forces could take."""
    more = 20.0 * typical()["load.mass_kg"] / (runs.DT_S / 4.0)
    name = "load.viscous_friction_n_s_m"
    expected, _ = simulated(typical() | {name: typical()[name] + more})
    found, _ = simulated(typical(), [("force", "velocity_m_s", [-5.0, 5.0])], [-5 * more, 5 * more])
    assert_alike(found, expected, 1e-9)


def test_a_leakage_by_a_table_is_that_of_the_catalogue_as_steps_become_short() -> None:
    """A table is taken at the beginning of a step: an error of first order."""
    coefficient, tank = 3e-12, typical()["supply.tank_pressure_pa"]
    named = typical() | {"effects.external_leakage.coefficient_a_m3_s_pa": coefficient}
    knots = [0.0, 3e7]
    errors = []
    for substeps in (4, 16):
        expected, _ = simulated(named, substeps=substeps)
        found, _ = simulated(
            typical(),
            [("flow_a", "pressure_a_pa", knots)],
            [-coefficient * (knot - tank) for knot in knots],
            substeps=substeps,
        )
        errors.append(np.max(np.abs(found[:, 0] - expected[:, 0])) / np.ptp(expected[:, 0]))
    without, _ = simulated(typical())
    of_the_leakage = np.max(np.abs(without[:, 0] - expected[:, 0])) / np.ptp(expected[:, 0])
    assert errors[0] < 0.01 * of_the_leakage
    assert errors[1] < 0.35 * errors[0]


def test_the_sensor_reads_the_position_with_its_error() -> None:
    plain, _ = simulated(typical())
    knots, errors = np.linspace(0.0, STROKE_M, 9), 1e-4 * np.sin(np.arange(9.0))
    found, _ = simulated(typical(), [("sensor", "position_m", knots)], errors)
    position = plain[:, 0] - np.interp(plain[0, 0], knots, 0.0 * errors)
    np.testing.assert_allclose(
        found[:, 0], position + np.interp(position, knots, errors), rtol=1e-12
    )
    np.testing.assert_array_equal(found[:, 1:], plain[:, 1:])


def test_an_axis_has_forces_by_tables_too() -> None:
    values = typical() | {"effects.load_force.force_n": 30.0}
    expected, _ = simulated(values, plant="axis")
    found, _ = simulated(typical(), [("force", "time_s", LONG_S)], [30.0, 30.0], plant="axis")
    np.testing.assert_allclose(found[:, :2], expected[:, :2], rtol=1e-9, atol=1e-12)


TABLES: list[tuple[str, str, list[float], list[float]]] = [
    (
        "force",
        "velocity_m_s",
        [-0.1, -0.013, 0.004, 0.02, 0.2],
        [-200.0, -300.0, 0.0, 250.0, 150.0],
    ),
    ("force", "position_m", [0.0, 0.1, 0.2], [100.0, -50.0, 80.0]),
    ("flow_a", "spool", [-0.5, 0.0, 0.5], [-1e-6, 0.0, 3e-6]),
    ("flow_b", "pressure_b_pa", [1e6, 4e6, 8e6], [0.0, -2e-6, -5e-6]),
    ("spool", "time_s", [0.0, 0.1, 0.3], [0.0, 0.01, -0.01]),
    ("sensor", "position_m", [0.0, 0.15, 0.3], [1e-5, -2e-5, 3e-5]),
    ("delay", "time_s", [0.0, 0.3], [0.0031, 0.0047]),
    ("mass", "position_m", [0.0, 0.14, 0.155, 0.3], [40.0, -30.0, 60.0, 20.0]),
]


@pytest.mark.parametrize(("adds_to", "of", "knots", "at_knots"), TABLES)
def test_sensitivities_by_values_of_a_table_are_slopes_of_the_simulation(
    adds_to: str, of: str, knots: list[float], at_knots: list[float]
) -> None:
    first, tables = len(runs.NAMES), [(adds_to, of, knots)]
    varied = [first + i for i in range(len(knots))]
    _, slopes = simulated(typical(), tables, at_knots, varied=varied)
    size = max(np.max(np.abs(at_knots)), 1e-12)
    seen = 0
    for i in range(len(knots)):
        step = 1e-4 * size * np.eye(len(knots))[i]
        ends = [simulated(typical(), tables, at_knots + s * step)[0] for s in (-1.0, 1.0)]
        expected = (ends[1] - ends[0]) / (2e-4 * size)
        for j in range(1 if adds_to == "sensor" else 4):
            scale = np.max(np.abs(expected[:, j]))
            seen += scale > 0.0
            difference = np.abs(slopes[:, i, j] - expected[:, j])
            # A knot or a reversal between the shifted runs changes single samples.
            assert np.quantile(difference, 0.9) <= 1e-3 * scale, (i, OUTPUTS[j])
    assert seen > 0


def test_a_table_that_is_none_is_refused() -> None:
    values = runs.vector(typical())

    def run(table: Sequence[object], more: int = 2) -> None:
        row = np.hstack([values, np.zeros((1, more))])
        ehsid.simulate_plant("ehs", row, COMMAND, dt_s=runs.DT_S, tables=[tuple(table)])  # type: ignore[arg-type]

    with pytest.raises(ValueError, match=r"adds_to must be one of spool, .*, got 'power'"):
        run(("power", "time_s", LONG_S))
    with pytest.raises(ValueError, match=r"of must be one of velocity_m_s, .*, got 'colour'"):
        run(("force", "colour", LONG_S))
    with pytest.raises(ValueError, match="knots must be at least two finite numbers that rise"):
        run(("force", "time_s", [0.0, 0.0]))
    with pytest.raises(ValueError, match=r"expected \(adds_to, of, knots\)"):
        run(("force", "time_s"))
    with pytest.raises(ValueError, match="values"):
        run(("force", "time_s", LONG_S), more=3)
    equations, variables = ehsid.plant_tables()
    assert {"force", "delay"} <= {*equations}
    assert {"time_s", "position_m"} <= {*variables}

# SPDX-License-Identifier: MIT
"""Steady states, sensitivities, alignment, many runs at once, and wrong arguments."""

from typing import Any

import numpy as np
import plant_runs as runs
import pytest
from plant_reference import OUTPUTS, typical
from scipy.optimize import brentq

import ehsid

EFFECTS = {effect.id: effect for effect in ehsid.effects()}


def test_it_starts_in_equilibrium_and_stays_there() -> None:
    values = typical() | {"effects.load_force.force_n": 500.0}
    found = runs.simulate(values, np.zeros(50), 4)
    area_a = np.pi / 4 * values["cylinder.bore_m"] ** 2
    area_b = area_a - np.pi / 4 * values["cylinder.rod_m"] ** 2
    force = found["pressure_a_pa"][0] * area_a - found["pressure_b_pa"][0] * area_b
    # Forces of some 2e4 N that cancel, in double.
    assert force - 101325.0 * (area_a - area_b) == pytest.approx(500.0, abs=1e-9)
    # Closed, rounded edges leak: the rod creeps, but it does not jump.
    assert np.max(np.abs(found["position_m"] - values["initial.position_m"])) < 1e-4


@pytest.mark.parametrize("command_v", [-8.0, -2.0, 1.0, 5.0])
def test_steady_speed_is_that_of_orifices_and_forces(command_v: float) -> None:
    """Both edges in use, no rounding to speak of: q = K x sqrt(dp) on each side, and the forces."""
    values = typical() | {
        "nuisance.edge_rounding": 1e-6,
        "nuisance.laminar_pressure_pa": 1e2,
        "cylinder.stroke_m": 4.0,
        "initial.position_m": 2.0,
        "effects.load_force.force_n": 1500.0,
    }
    found = runs.simulate(values, np.full(3000, command_v), 8)
    gain = values["valve.rated_flow_m3_s"] / np.sqrt(values["valve.rated_pressure_drop_pa"])
    x = abs(command_v) / values["valve.rated_command_v"]
    area_a = np.pi / 4 * values["cylinder.bore_m"] ** 2
    area_b = area_a - np.pi / 4 * values["cylinder.rod_m"] ** 2
    p_s, p_t = values["supply.pressure_pa"], values["supply.tank_pressure_pa"]

    def pressures(v: float) -> tuple[float, float]:
        drops = [(area * v / (gain * x)) ** 2 for area in (area_a, area_b)]
        if command_v > 0:
            return p_s - drops[0], p_t + drops[1]
        return p_t + drops[0], p_s - drops[1]

    def surplus(v: float) -> float:
        p_a, p_b = pressures(v)
        force = p_a * area_a - p_b * area_b - 101325.0 * (area_a - area_b) - 1500.0
        return float(force - values["load.viscous_friction_n_s_m"] * v)

    # Faster than without load no opening lets it go.
    fastest = gain * x * np.sqrt(p_s) / area_b
    v = brentq(surplus, 0.0, np.sign(command_v) * fastest, xtol=1e-12)
    p_a, p_b = pressures(v)
    # Over the last 0.2 s, oscillation gone; the volumes still change, which costs about 1e-3.
    tail = slice(-100, None)
    assert np.mean(found["velocity_m_s"][tail]) == pytest.approx(v, rel=2e-3)
    assert np.mean(found["pressure_a_pa"][tail]) == pytest.approx(p_a, rel=5e-3)
    assert np.mean(found["pressure_b_pa"][tail]) == pytest.approx(p_b, rel=5e-3)


VARIED = [
    "cylinder.bore_m",
    "load.mass_kg",
    "load.viscous_friction_n_s_m",
    "valve.rated_flow_m3_s",
    "supply.pressure_pa",
    "fluid.bulk_modulus_pa",
    "nuisance.spool_bandwidth_hz",
    "nuisance.spool_damping",
    "nuisance.null_bias",
    "nuisance.edge_rounding",
    "nuisance.edge_rounding_direction",
    "nuisance.edge_rounding_sides",
    "nuisance.edge_rounding_tank",
    "nuisance.edge_closing",
    "nuisance.edge_overlap",
    "nuisance.edge_overlap_sides",
    "nuisance.edge_overlap_tank",
    "nuisance.edge_gain_direction",
    "nuisance.edge_gain_sides",
    "nuisance.edge_gain_tank",
    "nuisance.flow_exponent",
    "nuisance.laminar_pressure_pa",
    "nuisance.free_gas",
    "nuisance.bulk_slope",
    "nuisance.atmosphere",
    "nuisance.between_samples",
    "nuisance.presliding_m",
    "nuisance.sliding_onset_m_s",
    "initial.position_m",
    # A reading in steps has no slopes.
    *(
        f"effects.{effect.id}.{parameter.name}"
        for effect in EFFECTS.values()
        if effect.id != "sensor_quantisation"
        for parameter in effect.parameters
    ),
]
# Outputs that the effect of a sensor changes: nothing but its own readings.
READINGS = {
    "position_sensor_delay": [0],
    "pressure_sensor_gain.gain_a": [2],
    "pressure_sensor_gain.gain_b": [3],
    "pressure_sensor_offset.offset_a_pa": [2],
    "pressure_sensor_offset.offset_b_pa": [3],
    "pressure_sensor_lag": [2, 3],
    ".sensor_": [0],
}


# Of seals that slide, from a speed that the rod has for a while at each reversal.
SEALS = {"effects.coulomb_friction.force_n": 400.0, "nuisance.sliding_onset_m_s": 1e-3}
NEEDS = {
    "nuisance.presliding_m": SEALS,
    "nuisance.sliding_onset_m_s": SEALS,
    # Typically zero, and a share of its largest size, which is that of a press, is no small step.
    "effects.load_spring.force_at_mid_stroke_n": {
        "effects.load_spring.force_at_mid_stroke_n": 300.0
    },
}


def test_watched_outputs_have_the_sensitivities_of_all() -> None:
    values = runs.vector(typical())
    command = runs.steps(3, 60, 10, 6.0)
    varied = [runs.NAMES.index(name) for name in VARIED]
    _, everything = ehsid.simulate_plant("ehs", values, command, dt_s=runs.DT_S, varied=varied)
    places = [OUTPUTS.index(name) for name in ("pressure_b_pa", "position_m")]
    for threads in (1, 2):
        outputs, found = ehsid.simulate_plant(
            "ehs",
            values,
            command,
            dt_s=runs.DT_S,
            varied=varied,
            watched=places,
            threads=threads,
        )
        assert outputs.shape == (1, 60, len(OUTPUTS))
        assert found.shape == (1, 60, len(varied), 2)
        np.testing.assert_array_equal(found, everything[..., places])
        assert np.count_nonzero(found) > 0.5 * found.size


def test_a_watched_output_that_the_plant_does_not_have_is_refused() -> None:
    with pytest.raises(ValueError, match=r"watched: 6 is not below 6, the number of outputs"):
        ehsid.simulate_plant("ehs", runs.vector(typical()), np.zeros(3), dt_s=1e-3, watched=[6])


@pytest.mark.parametrize("name", VARIED)
def test_sensitivities_are_the_slopes_of_the_simulation(name: str) -> None:
    effect = name.split(".")[1] if name.startswith("effects.") else None
    values = typical() if effect is None else runs.with_effect(EFFECTS[effect])
    values |= NEEDS.get(name, {})
    if name.endswith("_delay.delay_s"):
        values[name] = 0.0043  # off the grid of steps, where the derivative has a corner
    if name in ("nuisance.between_samples", "nuisance.edge_closing"):
        values[name] = 0.4  # it is not below zero
    command = runs.steps(4, 60, 10, 6.0)
    index = runs.NAMES.index(name)
    _, partials = ehsid.simulate_plant(
        "ehs", runs.vector(values), command, dt_s=runs.DT_S, substeps=4, varied=[index]
    )
    # Fourth-order central differences, steps of 1e-4 of the value or of its typical size: their
    # own error is far below 1e-4 of the slope, rounding of the outputs / step about 1e-9.
    size = abs(values[name]) or ehsid.plant_parameters()[index].maximum
    # A larger step carries a poppet over an end of its lift.
    step = (1e-6 if "counterbalance" in name else 1e-4) * size
    shifted = [
        ehsid.simulate_plant(
            "ehs",
            runs.vector(values | {name: values[name] + k * step}),
            command,
            dt_s=runs.DT_S,
            substeps=4,
        )[0][0]
        for k in (-2, -1, 1, 2)
    ]
    slope = (shifted[0] - 8 * shifted[1] + 8 * shifted[2] - shifted[3]) / (12 * step)
    changed = next((those for part, those in READINGS.items() if part in name), [0, 1, 2, 3])
    assert set(np.flatnonzero(np.abs(partials[0, :, 0, :4]).max(axis=0))) == set(changed)
    for j in changed:
        scale = np.max(np.abs(slope[:, j]))
        assert scale > 0.0
        difference = np.abs(partials[0, :, 0, j] - slope[:, j])
        # Where a clamp or a reversal falls between the shifted runs single samples differ.
        assert np.quantile(difference, 0.9) < 1e-3 * scale, OUTPUTS[j]


@pytest.mark.parametrize("delay_s", [0.0, 0.003, 0.0045])
def test_a_delay_of_whole_steps_has_the_slope_towards_longer_ones(delay_s: float) -> None:
    """A fit that starts at such a delay, or steps onto one, must not take it for the best one.

    Steps of integration take a quarter of the sampling time.
    """
    name = "effects.transport_delay.delay_s"
    command = runs.steps(4, 60, 10, 6.0)
    index = runs.NAMES.index(name)

    def run(delay: float, **options: Any) -> Any:
        values = runs.vector(typical() | {name: delay})
        return ehsid.simulate_plant("ehs", values, command, dt_s=runs.DT_S, substeps=4, **options)

    outputs, partials = run(delay_s, varied=[index])
    # One-sided differences of second order; the outputs are smooth up to the next whole step.
    step = 1e-6
    here, near, far = (run(delay_s + k * step)[0][0] for k in (0, 1, 2))
    slope = (-3.0 * here + 4.0 * near - far) / (2.0 * step)
    np.testing.assert_allclose(outputs[0], here, rtol=1e-12, atol=1e-12)
    for j in range(4):
        scale = np.max(np.abs(slope[:, j]))
        assert scale > 0.0
        difference = np.abs(partials[0, :, 0, j] - slope[:, j])
        assert np.quantile(difference, 0.9) < 1e-3 * scale, OUTPUTS[j]


@pytest.mark.parametrize("plant", ["ehs", "axis"])
@pytest.mark.parametrize("delay_s", [0.0, 0.0013])
def test_between_samples_the_command_moves_on_by_the_stated_share(
    plant: str, delay_s: float
) -> None:
    """A record of every tenth sample of a command, and all of the command, in the same steps."""
    every, dt_s, share = 10, 1e-3, 0.7
    values = typical() | {"effects.transport_delay.delay_s": delay_s}
    slow = 0.5 * runs.steps(6, 40, 4, 6.0)
    within = np.arange(every) / every + 0.5 / every  # a step's mean is that of its middle
    rises = np.diff(slow, append=slow[-1])
    fast = (slow[:, np.newaxis] + share * rises[:, np.newaxis] * within).ravel()

    def run(command: runs.FloatArray, step_s: float, substeps: int, between: float) -> Any:
        vector = runs.vector(values | {"nuisance.between_samples": between})
        return ehsid.simulate_plant(plant, vector, command, dt_s=step_s, substeps=substeps)[0][0]

    expected = run(fast, dt_s, 4, 0.0)[::every]
    found, held = (run(slow, every * dt_s, 4 * every, b) for b in (share, 0.0))
    for j in range(2):
        error, of_held = (np.abs(each[:, j] - expected[:, j]).max() for each in (found, held))
        # Steps of a millisecond follow a rise within a sample to a twentieth of it, at least.
        assert error < 0.02 * of_held, OUTPUTS[j]


@pytest.mark.parametrize("count", [13, 18, 33, 40])
def test_sensitivities_in_one_call_are_those_one_by_one(count: int) -> None:
    """One thread computes so many of them in one pass or in several, as wide as the processor."""
    command = runs.steps(5, 50, 10, 6.0)
    of_rig = [i for i, name in enumerate(runs.NAMES) if not name.startswith("effects.")]
    varied = of_rig[:count]
    assert len(varied) == count
    values = runs.vector(typical())
    outputs, together = ehsid.simulate_plant(
        "ehs", values, command, dt_s=runs.DT_S, varied=varied, threads=1
    )
    plain, nothing = ehsid.simulate_plant("ehs", values, command, dt_s=runs.DT_S)
    assert nothing.shape == (1, 50, 0, 6)
    # The same operations in another order of compilation: rounding only.
    np.testing.assert_allclose(outputs, plain, rtol=1e-9, atol=1e-12)
    for i, index in enumerate(varied):
        _, alone = ehsid.simulate_plant("ehs", values, command, dt_s=runs.DT_S, varied=[index])
        scale = np.abs(alone).max(axis=(0, 1, 2))
        assert np.all(np.abs(together[:, :, i] - alone[:, :, 0]).max(axis=(0, 1)) <= 1e-9 * scale)


def test_sets_side_by_side_are_those_one_by_one() -> None:
    command = runs.steps(6, 80, 10, 6.0)
    sets = np.repeat(runs.vector(typical()), 7, axis=0)
    sets[:, runs.NAMES.index("load.mass_kg")] = np.linspace(50.0, 300.0, 7)
    together, _ = ehsid.simulate_plant("ehs", sets, command, dt_s=runs.DT_S, threads=3)
    for i in range(7):
        alone, _ = ehsid.simulate_plant("ehs", sets[i : i + 1], command, dt_s=runs.DT_S)
        np.testing.assert_array_equal(together[i], alone[0])


def test_alignment_moves_the_reading_and_nothing_else() -> None:
    values = typical() | {
        "effects.sensor_lag.time_constant_s": 0.01,
        "effects.sensor_backlash.half_width_m": 1e-4,
    }
    command = runs.steps(7, 100, 10, 5.0)
    aligned = np.full((100, 4), np.nan)
    aligned[[30, 60], 0] = 0.14, 0.16
    free = runs.simulate(values, command, 4)
    outputs, _ = ehsid.simulate_plant(
        "ehs", runs.vector(values), command, dt_s=runs.DT_S, substeps=4, aligned=aligned
    )
    assert outputs[0, 30, 0] == pytest.approx(0.14, abs=1e-15)
    assert outputs[0, 60, 0] == pytest.approx(0.16, abs=1e-15)
    np.testing.assert_array_equal(outputs[0, :30, 0], free["position_m"][:30])
    # A position a few millimetres away changes the volumes by per cents: speeds stay alike.
    assert np.corrcoef(outputs[0, :, 1], free["velocity_m_s"])[0, 1] > 0.99


def test_aligned_readings_of_pressures_are_those_of_their_sensors() -> None:
    """The pressures are then those for which the sensors give the aligned readings."""
    gains, offsets = (1.07, 0.94), (2e5, -3e5)
    command = runs.steps(7, 100, 10, 5.0)
    sensors = {
        f"effects.pressure_sensor_{what}.{what}_{side}{unit}": sizes[i]
        for what, sizes, unit in (("gain", gains, ""), ("offset", offsets, "_pa"))
        for i, side in enumerate("ab")
    }

    def run(values: dict[str, float], a: list[float], b: list[float]) -> Any:
        aligned = np.full((100, 4), np.nan)
        aligned[[0, 40], 2], aligned[[0, 60], 3] = a, b
        outputs, _ = ehsid.simulate_plant(
            "ehs", runs.vector(values), command, dt_s=runs.DT_S, substeps=4, aligned=aligned
        )
        return outputs[0]

    true = run(typical(), [5e6, 6e6], [6e6, 4e6])
    read = run(
        typical() | sensors,
        [gains[0] * p + offsets[0] for p in (5e6, 6e6)],
        [gains[1] * p + offsets[1] for p in (6e6, 4e6)],
    )
    for i, column in enumerate((2, 3)):
        np.testing.assert_allclose(read[:, column], gains[i] * true[:, column] + offsets[i], 1e-9)
    np.testing.assert_allclose(read[:, :2], true[:, :2], rtol=1e-9, atol=1e-12)
    # A gain that is not told is one, and a lag is told by what came before.
    one = {"effects.pressure_sensor_gain.gain_a": 1.07}
    half = run(typical() | one, [5e6 * 1.07, 6e6 * 1.07], [6e6, 4e6])
    np.testing.assert_allclose(half[:, 3], true[:, 3], rtol=1e-9)
    late = run(
        typical() | {"effects.pressure_sensor_lag.time_constant_s": 0.01}, [5e6, 6e6], [6e6, 4e6]
    )
    assert late[40, 2] == 6e6
    assert late[60, 3] == 4e6


def test_an_aligned_reading_goes_on_along_the_uneven_scale_of_its_sensor() -> None:
    """The rod is then where the curve gives the aligned reading, and the reading follows it."""
    amplitude, period = 8e-4, 0.012
    uneven = {
        "effects.sensor_nonlinearity.amplitude_m": amplitude,
        "effects.sensor_nonlinearity.period_m": period,
    }
    command = runs.steps(7, 100, 10, 5.0)
    index = runs.NAMES.index("effects.sensor_nonlinearity.amplitude_m")

    def curve(y: Any) -> Any:
        return y + amplitude * np.sin(2.0 * np.pi * y / period)

    def run(values: dict[str, float], positions: list[float]) -> Any:
        aligned = np.full((100, 4), np.nan)
        aligned[[0, 30, 60], 0] = positions
        return ehsid.simulate_plant(
            "ehs",
            runs.vector(values),
            command,
            dt_s=runs.DT_S,
            substeps=4,
            aligned=aligned,
            varied=[index],
        )

    readings = [0.1437, 0.151, 0.139]
    places = [brentq(lambda y, m=m: curve(y) - m, m - 1e-3, m + 1e-3, xtol=1e-16) for m in readings]
    outputs, slopes = run(typical() | uneven, readings)
    true, _ = run(typical(), places)
    np.testing.assert_allclose(outputs[0, :, 0], curve(true[0, :, 0]), rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(outputs[0, :, 1:], true[0, :, 1:], rtol=1e-9)
    # What is told does not depend on the sensor.
    np.testing.assert_allclose(slopes[0, [0, 30, 60], 0, 0], 0.0, atol=1e-15)


def test_end_stops_hold_the_rod() -> None:
    for command_v in (-10.0, 10.0):
        found = runs.simulate(typical(), np.full(2000, command_v), 4)
        assert found["position_m"].min() > -0.01
        assert found["position_m"].max() < 0.31
        assert abs(found["velocity_m_s"][-1]) < 1e-3
        assert found["pressure_a_pa"].min() > 0.0
        assert found["pressure_b_pa"].min() > 0.0


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"plant": "robot"}, "plant must be 'ehs', 'axis' or 'linear'"),
        ({"command": [0.0, float("nan")]}, "command must be finite, entry 1"),
        ({"command": "abc"}, "command must hold real numbers"),
        ({"values": np.zeros((1, 3))}, "values has shape"),
        ({"dt_s": 0.0}, "dt_s must be finite and > 0"),
        ({"substeps": 0}, "substeps must be in 1..1000"),
        ({"varied": [1000]}, "varied: 1000 is not below"),
        ({"aligned": [0.1]}, "aligned has shape"),
    ],
)
def test_wrong_arguments_are_named(change: dict[str, object], words: str) -> None:
    arguments: dict[str, object] = {
        "plant": "ehs",
        "values": runs.vector(typical()),
        "command": np.zeros(5),
        "dt_s": 1e-3,
    } | change
    with pytest.raises((ValueError, TypeError), match=words):
        ehsid.simulate_plant(**arguments)  # type: ignore[arg-type]


def test_a_chamber_that_parted_fills_again() -> None:
    """A heavy load stopped short pulls the cap side to the vapour pressure, and swings back."""
    values = typical() | {
        "load.mass_kg": 2000.0,
        "cylinder.stroke_m": 2.0,
        "initial.position_m": 1.0,
        "nuisance.free_gas": 0.0,
    }
    command = np.concatenate([np.full(150, 9.0), np.zeros(1000)])
    found = [runs.simulate(values, command, substeps) for substeps in (8, 16, 32)]
    p_a = found[0]["pressure_a_pa"]
    assert p_a.min() == 1e3
    # It swings for long: the chamber parts and fills several times.
    filled = np.flatnonzero((p_a[:-1] == 1e3) & (p_a[1:] > 1e3))
    assert filled.size >= 3
    assert p_a[filled[-1] :].max() > 1e6
    # No oil is lost or made in the cavity: the rod ends where finer steps put it, which come
    # together at second order (a ratio of four) or better.
    end = [run["position_m"][-1] for run in found]
    assert abs(end[2] - end[1]) < abs(end[1] - end[0]) / 3.0
    assert abs(end[1] - end[0]) < 1e-4 * np.ptp(found[0]["position_m"])


@pytest.mark.parametrize("presliding", [5e-5, 1e-5, 2e-6])
def test_friction_tends_to_its_sharp_form(presliding: float) -> None:
    """Sharp Coulomb friction alone stops a mass after v^2 m / (2 F); the bristle adds its give."""
    speed, mass, force, at_rest = 0.05, 95.0, 40.0, 0.1
    values = typical() | {
        "axis.mass_kg": mass,
        "axis.viscous_friction_n_s_m": 0.0,
        "effects.coulomb_friction.force_n": force,
        "nuisance.presliding_m": presliding,
        "initial.position_m": 0.0,
        "initial.velocity_m_s": speed,
    }
    found = runs.simulate(values, np.zeros(400), 64, "axis")
    sharp = speed**2 * mass / (2.0 * force)
    # Bent by d it holds the tenth that friction has at rest, so that it slides bent by 10 d. While
    # it bends, the force is between nothing and F, for its damping adds 0.1 v / 0.02 of F at first;
    # in the end it springs back by as much at most. Below the onset friction is a tenth or more.
    give = presliding / at_rest
    onset = values["nuisance.sliding_onset_m_s"]
    assert at_rest * speed / 0.02 < 1.0
    bound = 2.0 * give + mass * onset**2 / (2.0 * at_rest * force)
    assert abs(found["position_m"][-1] - sharp) < bound
    # The bent bristle holds F 10 d / 2, all there is to swing, and loses it with each swing.
    early, late = (
        np.max(np.abs(found["velocity_m_s"][part])) for part in (slice(200, 300), slice(300, 400))
    )
    assert late < early < np.sqrt(force * give / mass)


@pytest.mark.parametrize("lost", ["extending", "retracting"])
def test_friction_of_one_direction_stops_that_motion_only(lost: str) -> None:
    """The force in the other direction is zero: there the mass goes on at its speed."""
    speed, mass, force = 0.05, 95.0, 40.0
    values = typical() | {
        "axis.mass_kg": mass,
        "axis.viscous_friction_n_s_m": 0.0,
        f"effects.coulomb_friction_sides.force_{lost}_n": force,
        "nuisance.presliding_m": 2e-6,
        "initial.position_m": 0.0,
    }
    for sign in (1.0, -1.0):
        run = values | {"initial.velocity_m_s": sign * speed}
        found = runs.simulate(run, np.zeros(400), 64, "axis")
        position, velocity = found["position_m"], found["velocity_m_s"]
        if (sign > 0.0) == (lost == "extending"):
            # v^2 m / (2 F), and the give of the bristles, see above.
            sharp = sign * speed**2 * mass / (2.0 * force)
            assert position[-1] == pytest.approx(sharp, abs=1e-4)
        else:
            # But for the half step before the first, in which the bristles were at rest.
            assert np.ptp(velocity[1:]) < 1e-12
            assert velocity[-1] == pytest.approx(sign * speed, rel=1e-4)


def test_friction_that_falls_to_zero_along_the_stroke_takes_the_energy_under_it() -> None:
    """F (y) = 40 N - 1000 N/m y up to 0.04 m takes 0.8 J; from there on nothing brakes."""
    mass, speed = 95.0, 0.2
    values = typical() | {
        "axis.mass_kg": mass,
        "axis.viscous_friction_n_s_m": 0.0,
        "effects.position_friction.force_n": 40.0,
        "effects.position_friction.rise_n_m": -1000.0,
        "nuisance.presliding_m": 2e-6,
        "initial.position_m": 0.0,
        "initial.velocity_m_s": speed,
    }
    found = runs.simulate(values, np.zeros(400), 16, "axis")
    beyond = found["position_m"] > 0.04
    left = np.sqrt(speed**2 - 2.0 * 0.8 / mass)
    # The bristles bend over ten times 2 um first, and take less than 1e-3 J less.
    np.testing.assert_allclose(found["velocity_m_s"][beyond], left, rtol=1e-3)
    assert np.ptp(found["velocity_m_s"][beyond][1:]) < 1e-12


def test_sensitivities_stay_bounded_where_the_steps_cannot_follow_the_seals() -> None:
    """At rest, stiff seals would turn by 1.4 rad a step, and the sensitivities would reach 1e40.

    The force and the mass are those of a record at 50 Hz whose fits could not move. The seals that
    the steps can follow give nearly the same motion.
    """
    dt_s, substeps = 0.02, 36
    values = typical() | {
        "load.mass_kg": 70.0,
        "effects.coulomb_friction.force_n": 4500.0,
        "nuisance.presliding_m": 1e-6,
    }
    radians = np.sqrt(450.0 / values["nuisance.presliding_m"] / 70.0) * dt_s / substeps
    assert radians > 1.3
    command = runs.steps(5, 400, 3, 0.2)
    varied = [runs.NAMES.index(name) for name in ("load.mass_kg", "supply.pressure_pa")]
    outputs, slopes = ehsid.simulate_plant(
        "ehs", runs.vector(values), command, dt_s=dt_s, substeps=substeps, varied=varied
    )
    position = outputs[0, :, 0]
    assert np.ptp(position) > 0.003
    per_deviation = slopes[0, :, :, 0] * runs.vector(values)[0, varied]
    # A value that is doubled does not move the rod by ten strokes.
    assert np.abs(per_deviation).max() < 10.0 * values["cylinder.stroke_m"]
    finer, _ = ehsid.simulate_plant(
        "ehs", runs.vector(values), command, dt_s=dt_s, substeps=20 * substeps
    )
    assert np.abs(position - finer[0, :, 0]).max() < 0.05 * np.ptp(position)


def test_steps_are_recommended_for_the_seals_as_their_values_say() -> None:
    values = typical() | {"effects.coulomb_friction.force_n": 4500.0}
    counts = [
        ehsid.plant_substeps("ehs", runs.vector(values | {"nuisance.presliding_m": d})[0], 0.02)
        for d in (1e-4, 1e-5, 1e-6)
    ]
    # The squares of the steps are in proportion to the stiffness of oil and seals together.
    squares = np.square(counts, dtype=np.float64)
    assert (squares[2] - squares[1]) / (squares[1] - squares[0]) == pytest.approx(10.0, rel=0.05)


@pytest.mark.parametrize("speed", [3e-4, 1e-3, 1e-2])
def test_friction_comes_up_with_the_speed(speed: float) -> None:
    """A steady force moves the rod at the speed where friction and viscous force balance it."""
    onset, force, viscous = 1e-3, 40.0, 200.0
    values = typical() | {
        "axis.mass_kg": 20.0,
        "axis.viscous_friction_n_s_m": viscous,
        "effects.coulomb_friction.force_n": force,
        "nuisance.sliding_onset_m_s": onset,
        "nuisance.presliding_m": 2e-6,
        "initial.velocity_m_s": 2.0 * speed,
    }
    at_speed = force * (0.1 + 0.9 * speed / np.hypot(speed, onset))
    command = (at_speed + viscous * speed) / values["axis.force_per_volt"]
    found = runs.simulate(values, np.full(1000, command), 16, "axis")
    # 2 s: the slope of the forces over speed is 200 N s/m or more, 20 kg settle within 0.1 s.
    assert found["velocity_m_s"][-1] == pytest.approx(speed, rel=1e-6)


@pytest.mark.parametrize("rounding", [1e-2, 1e-3, 1e-4])
def test_dead_band_tends_to_its_sharp_form(rounding: float) -> None:
    """Inside a sharp dead band nothing flows; a rounded edge lets through as its width allows."""
    values = typical() | {
        "nuisance.edge_rounding": rounding,
        "effects.valve_dead_band.overlap": 0.05,
    }
    inside = runs.simulate(values, np.full(200, 0.2), 8)  # 0.02 of rated command
    # Edge 0.03 before it opens: area (sqrt(s^2 + r^2) - |s|) / 2 < r^2 / (4 |s|), at 12 MPa and a
    # rated flow for 3.5 MPa, over the smaller area, of two edges.
    leak = 2.0 * values["valve.rated_flow_m3_s"] * np.sqrt(12.0 / 3.5) * rounding**2 / (4.0 * 0.03)
    area_b = np.pi / 4 * (values["cylinder.bore_m"] ** 2 - values["cylinder.rod_m"] ** 2)
    moved = abs(inside["position_m"][-1] - inside["position_m"][0])
    # And the oil column gives as its pressures settle: a share of the rounding at most.
    assert moved < leak / area_b * 0.4 + 1e-3 * rounding


@pytest.mark.parametrize("dt_s", [1e-3, 0.05, 0.2])
def test_end_stops_hold_at_any_step(dt_s: float) -> None:
    """A soft oil spring asks for few steps; the stops must not ask for more than there are."""
    values = typical() | {
        "load.mass_kg": 3000.0,
        "fluid.bulk_modulus_pa": 4e8,
        "cylinder.dead_volume_a_m3": 4e-3,
        "cylinder.dead_volume_b_m3": 4e-3,
    }
    vector = runs.vector(values)
    substeps = ehsid.plant_substeps("ehs", vector[0], dt_s)
    command = np.repeat([10.0, -10.0, 10.0], round(5.0 / dt_s))
    outputs, _ = ehsid.simulate_plant("ehs", vector, command, dt_s=dt_s, substeps=substeps)
    # Stopped from full speed, some 0.4 m/s, by a spring of rate 0.5 / h: v / rate at most.
    give = 0.5 * max(1e-3, 2.0 * dt_s / substeps)
    assert outputs[0, :, 0].min() > -give
    assert outputs[0, :, 0].max() < 0.3 + give
    assert outputs[0, :, 0].max() > 0.3

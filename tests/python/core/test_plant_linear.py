# SPDX-License-Identifier: MIT
"""The linear plant against exact solutions of Eqs. (1)-(4) and against their sampled form (6)."""

import numpy as np
import plant_runs as runs
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plant_reference import typical
from scipy.signal import cont2discrete, dlsim, lfilter
from sources import ROOT

import ehsid
from ehsid.harness.rigs import RigError, parse_rig, read_rig
from ehsid.harness.signals.simulation import simulate

LINEAR = ROOT / "examples" / "rigs" / "linear.toml"


def exact(values: dict[str, float], command: np.ndarray) -> np.ndarray:
    """Position and velocity by the matrix exponential, the command held."""
    p = {name.removeprefix("linear."): value for name, value in values.items()}
    stiffness = 4.0 * p["bulk_modulus_pa"] / p["volume_m3"]
    loss = p["flow_pressure_m3_s_pa"] + p["leakage_m3_s_pa"]
    area, mass = p["area_m2"], p["mass_kg"]
    # State y, v, P_L; (3) and (4).
    a = np.array(
        [[0.0, 1.0, 0.0], [0.0, 0.0, area / mass], [0.0, -stiffness * area, -stiffness * loss]]
    )
    b = np.array([[0.0], [0.0], [stiffness * p["flow_gain_m3_s"] * p["spool_gain_1_v"]]])
    system = cont2discrete((a, b, np.eye(3)[:2], np.zeros((2, 1))), runs.DT_S)
    _, outputs, _ = dlsim(system, command)
    return np.asarray(outputs)


@settings(max_examples=20)
@given(seed=st.integers(0, 10_000))
def test_agrees_with_the_matrix_exponential_at_second_order(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = typical()
    for name in values:
        if name.startswith("linear."):
            values[name] *= rng.uniform(0.5, 2.0)
    values["initial.position_m"] = 0.0
    command = runs.steps(seed, 200, 10, 5.0)
    expected = exact(values, command)
    errors = []
    for substeps in (16, 32):
        found = runs.simulate(values, command, substeps, "linear")
        both = np.column_stack([found["position_m"], found["velocity_m_s"]])
        errors.append(np.max(np.abs(both - expected) / np.ptp(expected, axis=0)))
    # Leapfrog: relative error of the frequency (w h)^2 / 24, times w t of phase; w <= 890 rad/s
    # (typical 444, its parameters within factors 2), h = 2 ms / 32, t = 0.4 s.
    assert errors[1] < (890.0 * 2e-3 / 32) ** 2 / 24 * 890.0 * 0.4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.2)


def test_is_the_sampled_model_of_the_estimator() -> None:
    """Eq. (6): what the estimator would find is what the simulator does."""
    rig = read_rig(LINEAR)
    servo = runs.linear_servo(rig.values)
    command = runs.steps(3, 400, 20, 4.0)
    theta = ehsid.discretise(servo, 1e-3)
    expected = lfilter([0.0, *theta[3:]], [1.0, *theta[:3]], command)
    run = simulate(rig, command, dt_s=1e-3, substeps=32)
    found = run.record.column("position_m")
    assert np.max(np.abs(found - expected)) < 2.0 * run.error["position_m"] * np.ptp(expected)
    # As above, w = 444 rad/s.
    assert run.error["position_m"] < (444.0 * 1e-3 / 32) ** 2 / 24 * 444.0 * 0.4


def test_shares_valve_mechanics_and_timing() -> None:
    rig = read_rig(LINEAR)
    force = 500.0
    # At rest P_L carries the load; leakage lets the rod creep at loss P_L / A.
    run = simulate(rig, np.zeros(2000), dt_s=1e-3, values={"effects.load_force.force_n": force})
    p = rig.values
    loss = p["linear.flow_pressure_m3_s_pa"] + p["linear.leakage_m3_s_pa"]
    creep = -loss * force / p["linear.area_m2"] ** 2
    assert run.record.column("velocity_m_s")[-1] == pytest.approx(creep, rel=1e-3)

    # Inside its dead band, but for the rounding of the edges, nothing flows.
    def speed(command_v: float) -> float:
        run = simulate(
            rig,
            np.full(3000, command_v),  # xi w = 10 1/s: ringing is down to e^-30
            dt_s=1e-3,
            values={"effects.valve_dead_band.overlap": 0.05},
        )
        return float(run.record.column("velocity_m_s")[-1])

    gain = p["linear.flow_gain_m3_s"] * p["linear.spool_gain_1_v"] / p["linear.area_m2"]
    rounding = 2e-3  # of the edges, typical: r^2 / (4 s) is left at a distance s
    assert abs(speed(0.2)) < gain * 10.0 * rounding**2 / (4 * 0.03)
    assert speed(2.0) == pytest.approx(gain * 1.5, rel=1e-3)


def test_dead_bands_of_two_sides_and_a_flow_that_drifts() -> None:
    rig = read_rig(LINEAR)
    p = rig.values
    gain = p["linear.flow_gain_m3_s"] * p["linear.spool_gain_1_v"] / p["linear.area_m2"]
    overlaps = {"overlap_a": 0.05, "overlap_b": 0.02}

    def speed(command_v: float, **effects: dict[str, float]) -> float:
        values = {f"effects.{e}.{n}": size for e, of in effects.items() for n, size in of.items()}
        run = simulate(rig, np.full(3000, command_v), dt_s=1e-3, values=values)
        return float(run.record.column("velocity_m_s")[-1])

    assert speed(2.0, valve_dead_band_sides=overlaps) == pytest.approx(gain * 1.5, rel=1e-3)
    assert speed(-2.0, valve_dead_band_sides=overlaps) == pytest.approx(-gain * 1.8, rel=1e-3)
    # At the end of 3 s; the rod follows a flow that falls slowly 1 / (2 xi w) = 0.05 s later.
    drifting = speed(2.0, flow_gain_drift={"rate_1_s": -0.05})
    assert drifting == pytest.approx(gain * 2.0 * 0.85, rel=4e-3)


@pytest.mark.parametrize("effect", ["internal_leakage", "supply_droop"])
def test_has_no_oil_of_its_own(effect: str) -> None:
    info = {e.id: e for e in ehsid.effects()}[effect]
    more = "".join(f"{p.name} = {p.typical}\n" for p in info.parameters)
    text = LINEAR.read_text() + f"[effects.{effect}]\n{more}"
    with pytest.raises(RigError, match=f"effects.{effect}.*has no hydraulics"):
        parse_rig(text)

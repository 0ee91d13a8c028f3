# SPDX-License-Identifier: MIT
"""The blind machine against hand calculations: statics, frequencies, energies, friction."""

import math

import numpy as np
import pytest
from reality_runs import DT_S, drawn_case, own_run
from scipy.integrate import quad
from scipy.optimize import brentq

from ehsid.lab.reality import machine as equations
from ehsid.lab.reality.case import start_state
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.variants import with_friction

ATMOSPHERE_PA = 101325.0


def servo(**changes: float) -> Truth:
    """A plain machine with ideal edges and supply; `changes` replace its fields."""
    t = drawn_case(11, "plain", "none").truth
    ideal = {f"overlap_{name}": 0.0 for name in ("pa", "at", "pb", "bt")}
    ideal |= {f"gain_{name}": 1.0 for name in ("pa", "at", "pb", "bt")}
    ideal |= {"round_width": 1e-4, "hum_share": 0.0, "warming_viscous": 0.0, "warming_bulk": 0.0}
    ideal |= {"source_resistance_pa_s_m3": 1.0, "accumulator_m3_pa": 1e-3}  # constant pressure
    return t._replace(**{**ideal, **changes})


@pytest.mark.slow
@pytest.mark.parametrize("u", [0.4, -0.4])
@pytest.mark.parametrize("load", [0.0, 0.1, -0.1])
def test_steady_speed_follows_from_orifices_and_forces(u: float, load: float) -> None:
    t = servo()
    t = t._replace(load_n=load * t.source_pa * t.area_a_m2)
    gain = t.flow_gain * abs(u)

    def forces(v: float) -> float:
        """Net force, N, at the speed v; the pressures follow from the flows A v = K sqrt(dp)."""
        drop_a, drop_b = (t.area_a_m2 * v / gain) ** 2, (t.area_b_m2 * v / gain) ** 2
        if u > 0.0:
            p_a, p_b = t.source_pa - drop_a, t.tank_pa + drop_b
        else:
            p_a, p_b = t.tank_pa + drop_a, t.source_pa - drop_b
        atmosphere = ATMOSPHERE_PA * (t.area_a_m2 - t.area_b_m2)
        viscous = math.copysign(t.viscous_n_s_m * v, u)
        return p_a * t.area_a_m2 - p_b * t.area_b_m2 - atmosphere - viscous - t.load_n

    speed = brentq(forces, 1e-4, 5.0)
    start = start_state(t, (0.3 if u > 0.0 else 0.7) * t.stroke_m)
    n = min(int(0.4 * t.stroke_m / speed / DT_S), 600)
    out = own_run(t, start, np.full(n, u))
    # At steady state dp/dt = 0, although the volumes of the chambers change.
    assert out[-1, equations.OUT_V] == pytest.approx(math.copysign(speed, u), rel=2e-3)


def closed(t: Truth) -> Truth:
    """The machine with a closed valve and without friction."""
    overlaps = {f"overlap_{name}": 0.5 for name in ("pa", "at", "pb", "bt")}
    return t._replace(viscous_n_s_m=0.0, **overlaps)


def test_oil_spring_rings_at_its_natural_frequency() -> None:
    t = closed(servo(gas_fraction=1e-9))
    start = start_state(t, 0.5 * t.stroke_m)
    p_a, p_b = equations.chamber_pressures(0.0, start, t)
    volume_a = t.dead_volume_a_m3 + t.area_a_m2 * start[equations.Y]
    volume_b = t.dead_volume_b_m3 + t.area_b_m2 * (t.stroke_m - start[equations.Y])
    stiffness = (t.bulk_modulus_0_pa + t.bulk_slope * p_a) * t.area_a_m2**2 / volume_a
    stiffness += (t.bulk_modulus_0_pa + t.bulk_slope * p_b) * t.area_b_m2**2 / volume_b
    start[equations.V] = 1e-3  # small, so that the oil is linear
    out = own_run(t, start, np.zeros(500), 8)
    v = out[:, equations.OUT_V]
    up = np.flatnonzero((v[:-1] < 0.0) & (v[1:] >= 0.0))
    crossings = up + v[up] / (v[up] - v[up + 1])
    period = DT_S * (crossings[-1] - crossings[0]) / (crossings.size - 1)
    # Linear interpolation of the crossings has an error of 1e-3 of a period of about 15 samples.
    assert 2.0 * math.pi / period == pytest.approx(math.sqrt(stiffness / t.mass_kg), rel=1e-3)


def test_energy_of_the_closed_machine_is_constant() -> None:
    t = closed(servo())
    start = start_state(t, 0.5 * t.stroke_m)
    start[equations.V] = 0.05
    out = own_run(t, start, np.zeros(300), 8)
    mass_a = start[equations.C_A]

    def work(y: float) -> float:
        """Work of oil and atmosphere on the piston up to y, J; c + ln V is constant."""

        def force(position: float) -> float:
            total = 0.0
            for c, dead, area, length, initial_length in (
                (mass_a, t.dead_volume_a_m3, t.area_a_m2, position, out[0, 0]),
                (
                    start[equations.C_B],
                    t.dead_volume_b_m3,
                    t.area_b_m2,
                    t.stroke_m - position,
                    t.stroke_m - out[0, 0],
                ),
            ):
                compression = c - math.log((dead + area * length) / (dead + area * initial_length))
                p = equations.pressure(
                    compression, t.bulk_slope, t.bulk_modulus_0_pa, t.gas_fraction, t.balance_pa
                )
                sign = 1.0 if length == position else -1.0
                total += sign * area * (p - ATMOSPHERE_PA)
            return total

        return float(quad(force, out[0, 0], y, epsrel=1e-10, epsabs=1e-9)[0])

    kinetic = 0.5 * t.mass_kg * out[:, equations.OUT_V] ** 2
    samples = range(0, 300, 23)
    energies = np.array([kinetic[k] - work(out[k, equations.OUT_Y]) for k in samples])
    # Positions have steps of 1e-12 m and forces are below 1e5 N: rounding is below 1e-7 J.
    np.testing.assert_allclose(energies, kinetic[0], rtol=1e-4)


def axis(coulomb: float, static: float) -> Truth:
    t = Truth(mass_kg=20.0, viscous_n_s_m=40.0, stroke_m=1.0, force_per_unit_n=100.0)
    return with_friction(t, coulomb, static, 0.02, 1e-5)


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_below_break_away_the_bristles_carry_the_force(share: float) -> None:
    t = axis(10.0, 15.0)
    ramp = 0.5 - 0.5 * np.cos(np.pi * np.minimum(np.arange(4000) / 3000.0, 1.0))
    commands = share * 0.15 * ramp
    out = own_run(t, np.zeros(equations.STATES), commands)
    # At rest F = s0 z. Before that dz/dy = 1 - s0 z / F_s, hence y = -(F_s / s0) ln(1 - F / F_s).
    # Inertia, a hundredth of the force at most, adds to the deflection near break-away.
    assert out[-1, equations.OUT_Y] == pytest.approx(-1e-5 * math.log(1.0 - share), rel=1e-2)
    assert abs(out[-1, equations.OUT_V]) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("force", [20.0, 60.0])
def test_above_break_away_the_steady_speed_is_on_the_stribeck_curve(force: float) -> None:
    t = axis(10.0, 15.0)
    out = own_run(t, np.zeros(equations.STATES), np.full(6000, force / 100.0))

    def net_force(v: float) -> float:
        return force - 10.0 - 5.0 * math.exp(-((v / 0.02) ** 2)) - 40.0 * v

    # With m / b = 0.5 s, exp(-12) of the difference remains after 6 s.
    assert out[-1, equations.OUT_V] == pytest.approx(brentq(net_force, 0.1, 5.0), rel=1e-4)


def test_friction_and_drive_balance_the_kinetic_energy() -> None:
    """LuGre friction is passive if its damping fades with speed: it never generates energy."""
    t = axis(10.0, 15.0)
    commands = 0.3 * np.sin(2.0 * np.pi * 1.3 * DT_S * np.arange(3000))
    out = own_run(t, np.zeros(equations.STATES), commands)
    v, y = out[:, equations.OUT_V], out[:, equations.OUT_Y]
    drive = np.concatenate(([0.0], np.cumsum(100.0 * commands * np.diff(y))))
    dissipated = drive - 0.5 * t.mass_kg * v**2
    assert dissipated.min() > -1e-9
    distance = float(np.sum(np.abs(np.diff(y))))
    viscous = 40.0 * float(np.sum(v**2)) * DT_S
    # Friction is between Coulomb and static friction over the whole distance, except in presliding.
    assert 9.9 * distance < dissipated[-1] - viscous < 15.0 * distance


@pytest.mark.slow
def test_supply_droops_by_its_resistance() -> None:
    resistance = 0.1 * servo().source_pa / (0.5 * servo().area_a_m2)
    t = servo(source_resistance_pa_s_m3=resistance, accumulator_m3_pa=5e-3 / resistance)
    start = start_state(t, 0.3 * t.stroke_m)
    out = own_run(t, start, np.full(300, 0.3))
    droop = t.source_pa - out[-1, equations.OUT_P_S]
    assert droop == pytest.approx(resistance * t.area_a_m2 * out[-1, equations.OUT_V], rel=2e-2)


def test_slew_limits_the_spool() -> None:
    t = servo(spool_slew_1_s=50.0, spool_rad_s=2000.0, amplifier_s=0.0)
    out = own_run(t, start_state(t, 0.5 * t.stroke_m), np.full(30, 0.9))
    x = out[:, equations.OUT_X]
    assert np.diff(x).max() == pytest.approx(50.0 * DT_S, rel=1e-6)
    assert x[-1] == pytest.approx(0.9, rel=1e-2)


def test_delay_shifts_the_spool_by_itself() -> None:
    delay_s = 0.0037
    t = servo()
    start = start_state(t, 0.5 * t.stroke_m)
    commands = np.concatenate((np.zeros(10), np.full(40, 0.3)))
    undelayed = own_run(t, start, commands)[:, equations.OUT_X]
    delayed = own_run(t._replace(delay_s=delay_s), start, commands)[:, equations.OUT_X]
    shifted = own_run(t._replace(delay_s=0.003), start, commands)[:, equations.OUT_X]
    np.testing.assert_allclose(shifted[3:], undelayed[:-3], atol=1e-9)
    # The area between two steps is their height times the delay.
    assert DT_S * float(np.sum(undelayed - delayed)) == pytest.approx(0.3 * delay_s, rel=1e-2)

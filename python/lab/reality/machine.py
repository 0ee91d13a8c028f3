# SPDX-License-Identifier: MIT
"""Equations of the blind machine and their solution by the classical Runge-Kutta method.

All compiled functions are in this one file. The cache of numba looks for changes only in the file
of the function that it compiled; it would miss changes in another file that this one calls.

Sources: C. Canudas de Wit et al., A new model for control of systems with friction, IEEE Trans.
Automatic Control 40(3), 1995 (friction); H. Olsson, Control systems with friction, Lund 1996
(its damping that fades with speed); A. Ellman, R. Piche, A two regime orifice flow formula for
numerical simulation, J. Dyn. Syst. Meas. Control 121(4), 1999, and W. Borutzky et al., Simulation
Modelling Practice and Theory 10(3-4), 2002 (flow); F. D. Murnaghan, PNAS 30(9), 1944 (oil);
K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42(2), 1975 (contact);
P. R. Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14(12), 1976; F. Ikhouane,
J. Rodellar, Systems with hysteresis, Wiley 2007 (Bouc-Wen law, normalised form); K. Kuhnen,
Modeling, identification and compensation of complex hysteretic nonlinearities, European Journal of
Control 9(4), 2003 (Prandtl-Ishlinskii operator).

Compilation of numerical functions by numba, kept on disk from run to run.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeVar, cast

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.error_words import install_line
from ehsid.harness.base.numbers import FloatArray

from .truth import Truth

try:
    import numba
except ImportError as error:  # an optional dependency: see pyproject.toml, extra "lab"
    raise ImportError(
        f"the generator of blind records needs numba; install it with: {install_line('lab')}"
    ) from error

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """Returns the function compiled by numba, which keeps its cache on disk beside the source."""
    return cast(F, numba.njit(cache=True)(function))


# States: spool position and its rate, compression of the oil on both sides, accumulator pressure,
# position, speed, deflection of the bristles, output of a lagging position sensor, position and
# speed of a second mass, output of the valve's amplifier, lifts of the counterbalance valves, angle
# of a boom in the triangle of its pivots, and its rate, friction of the spool as a share of its
# largest, free gas that may dissolve on both sides. With a boom, position and speed of the rod only
# follow its angle.
X, X_RATE, C_A, C_B, P_S, Y, V, Z, M, Y_2, V_2, DRIVE, L_A, L_B = range(14)
ANGLE, TURN, X_F, G_A, G_B = range(14, 19)
STATES = 19
# Outputs at the samples: position as read, pressures A, B and supply, spool position, speed.
OUT_Y, OUT_P_A, OUT_P_B, OUT_P_S, OUT_X, OUT_V = range(6)
OUTPUTS = 6

ATMOSPHERE_PA = 101325.0
POLYTROPIC = 1.3
ACCUMULATOR_POLYTROPIC = 1.2
LIFTING_S = 0.008  # time constant of a counterbalance valve
# Relative change of the oil's properties with each kelvin. Viscosity: Walther's law between 46 and
# 6.8 mm^2/s at 40 and 100 C has 4 % from 40 to 60 C. Bulk modulus and density are assumptions.
VISCOSITY_1_K, BULK_1_K, DENSITY_1_K = -0.04, -0.005, -0.0007
STOP_RAD_S = 1500.0  # sqrt(stiffness / mass) at the end stops
# The number of integration steps is chosen anew at least this often, s: within a sampling time of
# 50 ms, a rod that starts at rest reaches speeds at which its bristles need far shorter steps.
CHOSEN_ANEW_S = 1e-3
# A sample that is later than this, s, is integrated; one Euler step reaches earlier ones: pressures
# settle within some 100 us, and a fifth of that has an error of 2 % of the change in that time.
EULER_LATE_S = 2e-5


@compiled
def compression(p: float, slope: float, bulk_0: float, gas: float) -> float:
    """Relative volume change from zero pressure, of oil (Murnaghan) and free gas (polytropic)."""
    # c = ln(1 + n p / B) / n - alpha (p0 / p)^(1/1.3)
    return math.log1p(slope * p / bulk_0) / slope - gas * math.pow(
        ATMOSPHERE_PA / p, 1.0 / POLYTROPIC
    )


@compiled
def pressure(c: float, slope: float, bulk_0: float, gas: float, balance: float) -> float:
    """Pressure, Pa, at the compression c: the inverse of `compression`, to 1e-11 of the pressure.

    Both terms are increasing and concave in p, so Newton's method from the left stays left of the
    root and converges monotonically. `balance` is the root for c = 0.
    """
    if c >= 0.0:
        p = max(bulk_0 * math.expm1(slope * c) / slope, balance)
    else:  # the gas term is between -c and the sum of -c and the oil term at `balance`
        oil = math.log1p(slope * balance / bulk_0) / slope
        p = ATMOSPHERE_PA * math.pow(gas / (oil - c), POLYTROPIC)
    for _ in range(60):
        share = gas * math.pow(ATMOSPHERE_PA / p, 1.0 / POLYTROPIC)
        value = math.log1p(slope * p / bulk_0) / slope - share
        step = (c - value) / (1.0 / (bulk_0 + slope * p) + share / (POLYTROPIC * p))
        p += step
        if abs(step) <= 1e-11 * p:
            break
    return p


@compiled
def edge(s: float, width: float) -> float:
    """Opening of a metering edge: 0 below -width, a parabola from -width to width, s above."""
    if s <= -width:
        return 0.0
    if s >= width:
        return s
    return (s + width) * (s + width) / (4.0 * width)


@compiled
def orifice(drop: float, exponent: float, transition: float) -> float:
    """Returns |drop|^exponent with the sign of the drop; a parabola below the transition.

    The two laws meet smoothly.
    """
    size = abs(drop)
    if size >= transition:
        q = math.pow(size, exponent)
    else:
        r = size / transition
        q = math.pow(transition, exponent) * r * ((2.0 - exponent) + (exponent - 1.0) * r)
    return q if drop >= 0.0 else -q


@compiled
def opening(x: float, t: Truth) -> float:
    """Opening of the valve at the spool position x, after null bias and flow saturation."""
    o = x + t.null_bias
    if t.knee > 0.0:
        size = abs(o)
        steep = (1.0 - t.knee_gain * t.knee) / (1.0 - t.knee)
        bent = t.knee_gain * size if size < t.knee else 1.0 - steep * (1.0 - size)
        o = math.copysign(bent, o)
    if t.opening_limit > 0.0:
        r = o / t.opening_limit
        if t.limit_power > 0.0:
            o = o / (1.0 + abs(r) ** t.limit_power) ** (1.0 / t.limit_power)
        else:
            o = t.opening_limit * math.tanh(r)
    return o


@compiled
def sliding_friction(v: float, t: Truth) -> float:
    """Steady friction force, N, at the speed v (Stribeck), without its viscous part."""
    r = v / t.stribeck_m_s
    return t.coulomb_n + (t.static_n - t.coulomb_n) * math.exp(-r * r)


@compiled
def friction_factor(y: float, t: Truth) -> float:
    """Factor of the friction force at the position y."""
    r = (y - t.local_at_m) / t.local_width_m
    rising = max(1.0 + t.friction_rise_1_m * (y - 0.5 * t.stroke_m), 0.0)
    return rising * (1.0 + t.local_share * math.exp(-r * r))


@compiled
def largest_friction_factor(t: Truth) -> float:
    """Largest factor of the friction force over the stroke and both directions."""
    rising = 1.0 + abs(t.friction_rise_1_m) * 0.5 * t.stroke_m
    return rising * (1.0 + t.local_share) * (1.0 + abs(t.friction_by_direction))


@compiled
def contact_force(y: float, v: float, t: Truth) -> float:
    """Force, N, against extension by what the rod meets; it does not pull.

    Its surface is soft, and it damps as after Hunt and Crossley: F = k d^2 / (d + w) (1 + c v).
    """
    d = y - t.contact_at_m
    if d <= 0.0 or t.contact_n_m == 0.0:
        return 0.0
    return max(t.contact_n_m * d * d / (d + t.contact_soft_m) * (1.0 + t.contact_s_m * v), 0.0)


@compiled
def rod_length(angle: float, t: Truth) -> float:
    """Distance, m, from the foot of the cylinder to the eye of the rod: the law of cosines."""
    a, b = t.pivot_m, t.lever_m
    return math.sqrt(a * a + b * b - 2.0 * a * b * math.cos(angle))


@compiled
def boom_angle(y: float, t: Truth) -> float:
    """Angle, rad, of the triangle at the boom's pivot with the rod at the position y, m."""
    a, b, length = t.pivot_m, t.lever_m, t.retracted_m + y
    return math.acos((a * a + b * b - length * length) / (2.0 * a * b))


@compiled
def arm(angle: float, t: Truth) -> float:
    """Distance, m, of the boom's pivot from the line of the cylinder: the lever of its force."""
    return t.pivot_m * t.lever_m * math.sin(angle) / rod_length(angle, t)


@compiled
def weight_moment(angle: float, t: Truth) -> float:
    """Moment, N m, of the boom's weight against extension."""
    return t.boom_n_m * math.cos(angle - t.boom_level_rad)


@compiled
def turn_boom(s: FloatArray, force: float, t: Truth, d: FloatArray) -> None:
    """Writes the derivatives of the boom and of the rod on it; force: on the rod, N."""
    angle, turn = s[ANGLE], s[TURN]
    r, length = arm(angle, t), rod_length(angle, t)
    # J phi'' = F r - M(phi);  l' = r phi',  l'' = r phi'' + (a b cos(phi) - r^2) / l phi'^2
    d[ANGLE] = turn
    d[TURN] = (force * r - weight_moment(angle, t)) / t.boom_kg_m2
    bent = (t.pivot_m * t.lever_m * math.cos(angle) - r * r) / length
    d[Y] = r * turn
    d[V] = r * d[TURN] + bent * turn * turn


@compiled
def lift(own: float, other: float, t: Truth) -> float:
    """Lift at rest, 0 to 1, of a counterbalance valve by the pressures of both chambers, Pa.

    A quarter of its setting lifts it fully; the end of the lift is rounded.
    """
    lifting = (own + t.pilot_ratio * other - t.counterbalance_pa) / (0.25 * t.counterbalance_pa)
    return math.tanh(lifting) if lifting > 0.0 else 0.0


@compiled
def through_counterbalance(gain: float, lifted: float, t: Truth) -> float:
    """Opening, as a share of full, of an edge with a counterbalance valve in series.

    Two orifices in series: 1 / k^2 = 1 / k_1^2 + 1 / k_2^2; lifted, it is twice the edge's.
    """
    if t.counterbalance_pa == 0.0 or gain == 0.0:
        return gain
    other = 2.0 * lifted
    return gain * other / math.sqrt(gain * gain + other * other) if other > 0.0 else 0.0


@compiled
def port_valves(p: float, t: Truth) -> float:
    """Flow, m^3/s, from a chamber at the pressure p, Pa, through its relief and make-up valves."""
    relieved = t.relief_m3_s_pa * max(p - t.relief_pa, 0.0)
    return relieved - t.makeup_m3_s_pa * max(t.tank_pa - t.makeup_pa - p, 0.0)


@compiled
def bristle_rate(v: float, z: float, g: float, t: Truth) -> float:
    """Rate, m/s, at which the bristles' deflection z, m, changes at the speed v, m/s.

    g is the steady friction force at this speed, N.
    """
    if t.dahl_exponent > 0.0:
        # Dahl: z' = v |1 - s0 z sgn(v) / F_s|^i sgn(1 - s0 z sgn(v) / F_s)
        left = 1.0 - math.copysign(t.bristle_n_m * z / t.static_n, v * z)
        return v * math.copysign(math.pow(abs(left), t.dahl_exponent), left)
    if t.bouc_wen_power > 0.0:
        # Bouc-Wen: z' = v - sigma |v| |w|^(n-1) w + (sigma - 1) v |w|^n,  w = s0 z / F_s
        w = t.bristle_n_m * z / t.static_n
        size = math.pow(abs(w), t.bouc_wen_power)
        return (
            v
            + (t.bouc_wen_sigma - 1.0) * v * size
            - t.bouc_wen_sigma * abs(v) * math.copysign(size, w)
        )
    # LuGre: z' = v - s0 |v| z / g(v)
    return v - t.bristle_n_m * abs(v) * z / g


@compiled
def bristle_force(z: float, g: float, t: Truth) -> float:
    """Force, N, of bristles at the deflection z, m, without their damping; g as `bristle_rate`."""
    # LuGre, Dahl: F = s0 z;  Bouc-Wen: F = g(v) s0 z / F_s
    force = t.bristle_n_m * z
    return force * g / t.static_n if t.bouc_wen_power > 0.0 else force


@compiled
def supplied_flow(p: float, t: Truth) -> float:
    """Flow, m^3/s, from the source into the accumulator or line at the pressure p, Pa."""
    # q = (p_0 - p) / R
    flow = (t.source_pa - p) / t.source_resistance_pa_s_m3
    if t.pump_flow_m3_s > 0.0 and flow > t.pump_flow_m3_s:
        # The relief valve is closed: q = q_p + (p_0 - R q_p - p) / R_s
        closed_pa = t.source_pa - t.source_resistance_pa_s_m3 * t.pump_flow_m3_s
        flow = t.pump_flow_m3_s + (closed_pa - p) / t.slip_resistance_pa_s_m3
    return flow


@compiled
def hysteresis(u: float, plays: FloatArray, t: Truth) -> float:
    """Prandtl-Ishlinskii operator: weighted sum of plays; their outputs (5,) are changed in place.

    `u` is a fraction of the rated command.
    """
    # y_i = min(max(y_i, u - r_i), u + r_i),  y = sum w_i y_i
    total = 0.0
    for i in range(plays.size):
        r = t.play_half_widths[i]
        plays[i] = min(max(plays[i], u - r), u + r)
        total += t.play_weights[i] * plays[i]
    return total


@compiled
def warming_share(time: float, t: Truth) -> float:
    """Share of the warming that is complete at this time, 0 to 1."""
    return 1.0 - math.exp(-time / t.warming_s)


@compiled
def chamber_pressures(time: float, s: FloatArray, t: Truth) -> tuple[float, float]:
    """Pressures of the chambers A and B, Pa."""
    warming = warming_share(time, t)
    bulk = t.bulk_modulus_0_pa * (1.0 + t.warming_bulk * warming)
    bulk *= 1.0 + BULK_1_K * t.heating_k * warming
    gas_a, gas_b = t.gas_fraction + s[G_A], t.gas_fraction + s[G_B]
    balance_a, balance_b = t.balance_pa, t.balance_pa
    if t.dissolving_gas > 0.0:
        balance_a, balance_b = balance_of(gas_a, bulk), balance_of(gas_b, bulk)
    return (
        pressure(s[C_A], t.bulk_slope, bulk, gas_a, balance_a),
        pressure(s[C_B], t.bulk_slope, bulk, gas_b, balance_b),
    )


@compiled
def balance_of(gas: float, bulk_0: float) -> float:
    """Pressure, Pa, just below the root of `compression`, where p / B = alpha (p0 / p)^(1/1.3)."""
    power = 1.0 / POLYTROPIC
    return math.pow(gas * bulk_0 * math.pow(ATMOSPHERE_PA, power), 1.0 / (1.0 + power))


@compiled
def free_gas(p: float, t: Truth) -> float:
    """Fraction of gas that is free in the end at the pressure p, Pa, of what may dissolve."""
    return t.dissolving_gas * max(1.0 - p / t.all_dissolved_pa, 0.0)


@compiled
def gas_rate(p: float, free: float, t: Truth) -> float:
    """Rate, 1/s, at which gas comes out of solution at the pressure p, Pa, or goes into it."""
    more = free_gas(p, t) - free
    return more / (t.coming_out_s if more > 0.0 else t.dissolving_s)


@compiled
def valve_pressure(time: float, s: FloatArray, t: Truth) -> float:
    """Supply pressure at the valve, Pa: accumulator pressure with the ripple of the pump."""
    return float(s[P_S]) * (1.0 + t.hum_share * math.sin(2.0 * math.pi * t.hum_hz * time))


@compiled
def slope_of(
    time: float, s: FloatArray, command: float, sensor_position: float, t: Truth, d: FloatArray
) -> None:
    """Writes the time derivative of the state s to d; both have the shape (19,).

    `command` is the command to the spool or motor as a fraction. `sensor_position` is the position
    that the sensor reads through its play, m.
    """
    y, v = s[Y], s[V]
    if t.boom_kg_m2 > 0.0:
        y = rod_length(s[ANGLE], t) - t.retracted_m
        v = arm(s[ANGLE], t) * s[TURN]
    warming = warming_share(time, t)
    heated_k = t.heating_k * warming
    thin = math.exp(VISCOSITY_1_K * heated_k)  # viscosity over that at the start
    if t.force_per_unit_n > 0.0:  # a motor drives the load in place of the hydraulics
        drive = t.force_per_unit_n * command
        for i in (X, X_RATE, C_A, C_B, P_S, DRIVE, L_A, L_B, X_F, G_A, G_B):
            d[i] = 0.0
    else:
        current = command
        d[DRIVE] = 0.0
        if t.amplifier_s > 0.0:
            current = s[DRIVE]
            d[DRIVE] = (command - current) / t.amplifier_s
        # x'' = w^2 (u - x) - 2 zeta w x', |x'| <= slew
        rate = min(max(s[X_RATE], -t.spool_slew_1_s), t.spool_slew_1_s)
        d[X] = rate
        d[X_F] = 0.0
        if t.spool_friction > 0.0:  # Dahl: f' = x' / way (1 - f sgn(x'))
            d[X_F] = rate / t.spool_friction_way * (1.0 - s[X_F] * math.copysign(1.0, rate))
            current -= t.spool_friction * s[X_F]
        d[X_RATE] = t.spool_rad_s * (
            t.spool_rad_s * (current - s[X]) - 2.0 * t.spool_damping * s[X_RATE]
        )
        p_a, p_b = chamber_pressures(time, s, t)
        p_v = valve_pressure(time, s, t)
        o = opening(s[X] + t.bias_rate_1_s * time, t)
        e, tr, w = t.flow_exponent, t.transition_pa * thin * thin, t.round_width
        k = t.flow_gain * (1.0 + t.gain_rate_1_s * time)
        k *= 1.0 - 0.5 * DENSITY_1_K * heated_k
        q_pa = k * t.gain_pa * edge(o - t.overlap_pa, w + t.worn[0]) * orifice(p_v - p_a, e, tr)
        back_a = through_counterbalance(edge(-o - t.overlap_at, w + t.worn[1]), s[L_A], t)
        q_at = k * t.gain_at * back_a * orifice(p_a - t.tank_pa, e, tr)
        q_pb = k * t.gain_pb * edge(-o - t.overlap_pb, w + t.worn[2]) * orifice(p_v - p_b, e, tr)
        back_b = through_counterbalance(edge(o - t.overlap_bt, w + t.worn[3]), s[L_B], t)
        q_bt = k * t.gain_bt * back_b * orifice(p_b - t.tank_pa, e, tr)
        d[L_A] = (lift(p_a, p_b, t) - s[L_A]) / LIFTING_S if t.counterbalance_pa > 0.0 else 0.0
        d[L_B] = (lift(p_b, p_a, t) - s[L_B]) / LIFTING_S if t.counterbalance_pa > 0.0 else 0.0
        leak_a, leak_b = t.leak_a_m3_s_pa / thin, t.leak_b_m3_s_pa / thin
        q_ab = (t.leak_ab_m3_s_pa / thin + t.warming_leak_m3_s_pa * warming) * (p_a - p_b)
        q_a = q_pa - q_at - q_ab - leak_a * (p_a - t.tank_pa) - port_valves(p_a, t)
        q_b = q_pb - q_bt + q_ab - leak_b * (p_b - t.tank_pa) - port_valves(p_b, t)
        d[G_A], d[G_B] = 0.0, 0.0
        if t.dissolving_gas > 0.0:
            d[G_A], d[G_B] = gas_rate(p_a, s[G_A], t), gas_rate(p_b, s[G_B], t)
        if t.orifice_leak_m3_s_pa05 > 0.0:
            q_a -= t.orifice_leak_m3_s_pa05 * orifice(p_a - t.tank_pa, 0.5, tr)
        # c' = (q -+ A v) / V
        d[C_A] = (q_a - t.area_a_m2 * v) / (t.dead_volume_a_m3 + t.area_a_m2 * y)
        d[C_B] = (q_b + t.area_b_m2 * v) / (t.dead_volume_b_m3 + t.area_b_m2 * (t.stroke_m - y))
        # Accumulator: p V^n constant, hence C = C_0 (p_0 / p)^(1 + 1/n)
        capacity = t.accumulator_m3_pa * (t.source_pa / s[P_S]) ** (
            1.0 + 1.0 / ACCUMULATOR_POLYTROPIC
        )
        d[P_S] = (supplied_flow(s[P_S], t) - q_pa - q_pb) / capacity
        drive = t.area_a_m2 * (p_a - ATMOSPHERE_PA) - t.area_b_m2 * (p_b - ATMOSPHERE_PA)

    force = drive - t.load_n - t.spring_n_m * (y - 0.5 * t.stroke_m)
    force -= t.viscous_n_s_m * (1.0 + t.warming_viscous * warming) * thin * v
    from_middle = y - 0.5 * t.stroke_m
    force -= contact_force(y, v, t)
    force -= t.cubic_n_m3 * from_middle * from_middle * from_middle
    force -= t.drag_n_s2_m2 * v * abs(v)
    if t.later_load_n != 0.0:
        force -= t.later_load_n * 0.5 * (1.0 + math.tanh((time - t.later_at_s) / t.later_rise_s))
    # F = s0 z + s1(v) z',  s1 fading with speed
    g = sliding_friction(v, t)
    if g > 0.0:
        d[Z] = bristle_rate(v, s[Z], g, t)
        r = v / t.stribeck_m_s
        bristle = bristle_force(s[Z], g, t) + t.bristle_n_s_m * math.exp(-r * r) * d[Z]
        by_direction = 1.0 + t.friction_by_direction * math.copysign(1.0, bristle)
        force -= friction_factor(y, t) * by_direction * bristle
    else:
        d[Z] = 0.0
    if t.force_per_unit_n == 0.0:
        overtravel = y if y < 0.0 else max(y - t.stroke_m, 0.0)
        if overtravel != 0.0:
            stiffness = t.mass_kg * STOP_RAD_S * STOP_RAD_S
            force -= stiffness * overtravel + 0.6 * t.mass_kg * STOP_RAD_S * v
    if t.second_mass_kg > 0.0:
        coupling_force = t.second_spring_n_m * (s[Y_2] - y) + t.second_damper_n_s_m * (s[V_2] - v)
        force += coupling_force
        d[Y_2] = s[V_2]
        d[V_2] = -coupling_force / t.second_mass_kg
    else:
        d[Y_2] = 0.0
        d[V_2] = 0.0
    if t.boom_kg_m2 > 0.0:
        turn_boom(s, force, t, d)
    else:
        d[ANGLE] = 0.0
        d[TURN] = 0.0
        d[Y] = v
        d[V] = force / t.mass_kg
    # m' = (y with play - m) / T
    if t.sensor_lag_s > 0.0:
        contact = min(max(sensor_position, y - t.sensor_play_m), y + t.sensor_play_m)
        d[M] = (contact - s[M]) / t.sensor_lag_s
    else:
        d[M] = 0.0


@compiled
def steps_per_second(s: FloatArray, t: Truth, refinement: int) -> float:
    """Number of integration steps per second that the state s needs.

    In one step an oscillation turns by 1 / (3 refinement) rad at most, and a decay falls by
    exp(-1.3) at most. A mode that decays so fast has long settled to its input, so only stability
    matters: the method is stable up to exp(-2.78).
    """
    fastest_rad_s = 0.0
    decay_1_s = 0.0
    mass_kg = t.boom_kg_m2 / arm(s[ANGLE], t) ** 2 if t.boom_kg_m2 > 0.0 else t.mass_kg
    if t.force_per_unit_n == 0.0:
        volume_a = t.dead_volume_a_m3 + t.area_a_m2 * max(s[Y], 0.0)
        volume_b = t.dead_volume_b_m3 + t.area_b_m2 * max(t.stroke_m - s[Y], 0.0)
        bulk = t.bulk_modulus_0_pa + t.bulk_slope * t.source_pa
        stiffness = bulk * (t.area_a_m2**2 / volume_a + t.area_b_m2**2 / volume_b)
        fastest_rad_s = math.sqrt((stiffness + t.contact_n_m) / mass_kg)
        steepest = (2.0 - t.flow_exponent) * t.transition_pa ** (t.flow_exponent - 1.0)
        conductance = t.flow_gain * steepest * (abs(opening(s[X], t)) + 0.05)
        conductance = max(conductance, t.relief_m3_s_pa, t.makeup_m3_s_pa)
        decay_1_s = conductance * max(bulk / min(volume_a, volume_b), 1.0 / t.accumulator_m3_pa)
        decay_1_s = max(decay_1_s, 1.0 / (t.source_resistance_pa_s_m3 * t.accumulator_m3_pa))
        if t.amplifier_s > 0.0:
            decay_1_s = max(decay_1_s, 1.0 / t.amplifier_s)
        spool_rad_s = t.spool_rad_s * math.sqrt(1.0 + t.spool_friction / t.spool_friction_way)
        fastest_rad_s = max(
            fastest_rad_s, spool_rad_s, 2.0 * math.pi * t.hum_hz if t.hum_share > 0.0 else 0.0
        )
        if s[Y] < 0.002 * t.stroke_m or s[Y] > 0.998 * t.stroke_m:
            fastest_rad_s = max(fastest_rad_s, STOP_RAD_S)
    if t.static_n > 0.0:
        largest_factor = largest_friction_factor(t)
        fastest_rad_s = max(fastest_rad_s, math.sqrt(largest_factor * t.bristle_n_m / mass_kg))
        settling_1_s = t.bristle_n_m * abs(s[V]) / sliding_friction(s[V], t)
        # The derivative of |w|^n at the sliding deflection is n.
        settling_1_s *= max(1.0, t.dahl_exponent, t.bouc_wen_power)
        decay_1_s = max(decay_1_s, settling_1_s)
        decay_1_s = max(decay_1_s, largest_factor * t.bristle_n_s_m / mass_kg)
    if t.second_mass_kg > 0.0:
        smaller_mass = min(t.mass_kg, t.second_mass_kg)
        fastest_rad_s = max(fastest_rad_s, math.sqrt(2.0 * t.second_spring_n_m / smaller_mass))
    if t.sensor_lag_s > 0.0:
        decay_1_s = max(decay_1_s, 1.0 / t.sensor_lag_s)
    return max(3.0 * refinement * fastest_rad_s, decay_1_s / 1.3)


@compiled
def advance_piece(
    time: float,
    span: float,
    s: FloatArray,
    command: float,
    sensor_position: float,
    t: Truth,
    refinement: int,
) -> float:
    """Integrates as `advance` does, with equal steps whose number the state at the start decides.

    The method is the classical one of fourth order.
    """
    n = math.ceil(span * steps_per_second(s, t, refinement))
    n = min(max(n, refinement), 5000)
    h = span / n
    d1, d2, d3, d4 = np.empty(STATES), np.empty(STATES), np.empty(STATES), np.empty(STATES)
    w = np.empty(STATES)
    for _ in range(n):
        slope_of(time, s, command, sensor_position, t, d1)
        for i in range(STATES):
            w[i] = s[i] + 0.5 * h * d1[i]
        slope_of(time + 0.5 * h, w, command, sensor_position, t, d2)
        for i in range(STATES):
            w[i] = s[i] + 0.5 * h * d2[i]
        slope_of(time + 0.5 * h, w, command, sensor_position, t, d3)
        for i in range(STATES):
            w[i] = s[i] + h * d3[i]
        slope_of(time + h, w, command, sensor_position, t, d4)
        for i in range(STATES):
            s[i] += h / 6.0 * (d1[i] + 2.0 * (d2[i] + d3[i]) + d4[i])
        time += h
        sensor_position = min(max(sensor_position, s[Y] - t.sensor_play_m), s[Y] + t.sensor_play_m)
    return sensor_position


@compiled
def advance(
    time: float,
    span: float,
    s: FloatArray,
    command: float,
    sensor_position: float,
    t: Truth,
    refinement: int,
) -> float:
    """Integrates the state s in place over `span`, s; returns the state of the sensor's play, m.

    The command is held.
    """
    pieces = max(math.ceil(span / CHOSEN_ANEW_S - 1e-9), 1)
    piece = span / pieces
    for i in range(pieces):
        sensor_position = advance_piece(
            time + i * piece, piece, s, command, sensor_position, t, refinement
        )
    return sensor_position


@compiled
def run(
    t: Truth,
    start: FloatArray,
    dt_s: float,
    forward: FloatArray,
    reference: FloatArray,
    gain: float,
    command_step: float,
    error: FloatArray,
    late: FloatArray,
    lost: npt.NDArray[np.bool_],
    refinement: int,
) -> tuple[FloatArray, FloatArray]:
    """Simulates controller, machine and sensor, sample by sample.

    Parameters
    ----------
    t, start
        constants of the machine, and its state (19,) at the first sample.
    dt_s
        sampling period, s.
    forward, reference
        (n,) feed-forward as a fraction of rated command, and commanded position, m.
    gain
        gain of the position controller, fraction of rated command per m.
    command_step
        step of the digital output, as a fraction of rated command.
    error
        (n,) error that the sensor adds to the position, m.
    late
        (n,) time by which a sample is taken late, s; small against dt_s.
    lost
        (n,) whether a command does not arrive; the command before it is then held.
    refinement
        factor by which the integration step of an oscillation is shortened.

    Returns
    -------
    the sent commands (n,), as fractions of rated command, and the outputs (n, 6), with the position
    as read.
    """
    n = reference.size
    run = begun(t, start, n)
    run_samples(
        *(0, n, t, run, dt_s, forward, reference, gain, command_step, error, late, lost, refinement)
    )
    return run.sent, run.out


class Run(NamedTuple):
    """A run of at most n samples on its way."""

    state: FloatArray
    """(19,): state of the machine."""
    memory: FloatArray
    """(2,): position of the sensor within its play, and command to the spool behind play or
    stiction."""
    plays: FloatArray
    """Of the hysteresis."""
    sent: FloatArray
    arrived: FloatArray
    on_time: FloatArray
    """(n,) each: commands that were sent and that arrived, and readings before their delay."""
    out: FloatArray
    """(n, 6)."""


@compiled
def begun(t: Truth, start: FloatArray, n: int) -> Run:
    """Returns a run of n samples at its begin."""
    return Run(
        start.copy(),
        np.array([start[Y], 0.0]),
        np.zeros(len(t.play_weights)),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty((n, OUTPUTS)),
    )


@compiled
def run_samples(
    first: int,
    end: int,
    t: Truth,
    run: Run,
    dt_s: float,
    forward: FloatArray,
    reference: FloatArray,
    gain: float,
    command_step: float,
    error: FloatArray,
    late: FloatArray,
    lost: npt.NDArray[np.bool_],
    refinement: int,
) -> None:
    """Goes on with a run from sample `first` to before sample `end`; arguments as of `run`."""
    s, plays, sent, arrived, on_time, out = (
        run.state,
        run.plays,
        run.sent,
        run.arrived,
        run.on_time,
        run.out,
    )
    sensor_position, spool_command = run.memory
    samples_old = math.floor(t.reading_delay_s / dt_s)
    share_older = t.reading_delay_s / dt_s - samples_old
    d = np.empty(STATES)
    whole_samples = math.floor(t.delay_s / dt_s)
    fraction_s = t.delay_s - whole_samples * dt_s
    for k in range(first, end):
        time = k * dt_s
        if t.delay_rate != 0.0:
            delay_s = t.delay_s + t.delay_rate * time
            whole_samples = math.floor(delay_s / dt_s)
            fraction_s = delay_s - whole_samples * dt_s
        contact = min(max(sensor_position, s[Y] - t.sensor_play_m), s[Y] + t.sensor_play_m)
        slope_of(time, s, spool_command, sensor_position, t, d)
        if late[k] > EULER_LATE_S:
            sampled = s.copy()
            contact = advance(time, late[k], sampled, spool_command, sensor_position, t, refinement)
            reading = sampled[M] if t.sensor_lag_s > 0.0 else contact
            seen = sampled
        else:
            sampled, seen = s + late[k] * d, s
            motion_until_sampled = d[M] * late[k] if t.sensor_lag_s > 0.0 else s[V] * late[k]
            reading = (s[M] if t.sensor_lag_s > 0.0 else contact) + motion_until_sampled
        on_time[k] = reading
        if t.reading_delay_s > 0.0:
            older = on_time[max(k - samples_old - 1, 0)]
            reading = on_time[max(k - samples_old, 0)]
            reading += share_older * (older - reading)
        reading += error[k]
        reading += t.scale_slope * max(reading - t.scale_at_m, 0.0)
        reading += t.scale_wave_m * math.sin(2.0 * math.pi * reading / t.scale_period_m)
        if t.scale_bow_m != 0.0:
            from_end = 2.0 * reading / t.stroke_m - 1.0
            reading += t.scale_bow_m * (1.0 - from_end * from_end)
        reading = t.sensor_step_m * np.rint(reading / t.sensor_step_m)
        u = min(max(forward[k] + gain * (reference[k] - reading), -1.0), 1.0)
        sent[k] = command_step * np.rint(u / command_step)
        arrived[k] = arrived[k - 1] if lost[k] and k > 0 else sent[k]
        out[k, OUT_Y] = reading
        p_a, p_b = ATMOSPHERE_PA, ATMOSPHERE_PA
        if t.force_per_unit_n == 0.0:
            p_a, p_b = chamber_pressures(time + late[k], sampled, t)
        out[k, OUT_P_A] = p_a
        out[k, OUT_P_B] = p_b
        out[k, OUT_P_S] = valve_pressure(time + late[k], seen, t)
        out[k, OUT_X] = seen[X]
        out[k, OUT_V] = seen[V]
        # The delayed command changes at t_k + part, so the period is integrated in two pieces.
        for piece in range(2):
            span = fraction_s if piece == 0 else dt_s - fraction_s
            if span <= 0.0:
                continue
            u = arrived[max(k - whole_samples - (1 if piece == 0 else 0), 0)]
            if t.stick > 0.0:
                if abs(u - spool_command) > t.stick:
                    spool_command = u
            elif t.play_weights[0] > 0.0:
                spool_command = hysteresis(u, plays, t)
            else:
                spool_command = min(max(spool_command, u - t.play), u + t.play)
            sensor_position = advance(time, span, s, spool_command, sensor_position, t, refinement)
            time += span
    run.memory[0], run.memory[1] = sensor_position, spool_command

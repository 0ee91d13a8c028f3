# SPDX-License-Identifier: MIT
"""Cylinder and load for a controller: speeds, friction feed-forward, and the linear servo.

Velocity from opening without acceleration (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 6):
a spool that is open by x of full opening lets q = K x sqrt(dp) through each edge, K = rated flow /
sqrt(rated drop), and the forces on the piston balance:

    extending   (p_s - (A_a v / (K x))^2) A_a - (p_t + (A_b v / (K x))^2) A_b = F(v)

so that x = v sqrt((A_a^3 + A_b^3) / (S - F(v))) / K with the stall force S = p_s A_a - p_t A_b;
retracting with the areas exchanged.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..base.numbers import FloatArray
from ..diagnosis.schema import Estimate
from .known import Known
from .loop import Servo

POINTS = 100
ATMOSPHERE_PA = 101325.0
# Of the stall force: what is left of more friction moves nothing that a controller could rely on.
MOST_FRICTION = 0.9
# Positions at which the oil spring is looked at, shares of the stroke.
POSITIONS = np.linspace(0.1, 0.9, 9)
LEAKAGE, LAG = "effects.internal_leakage.coefficient_m3_s_pa", "effects.valve_lag"
DELAYS = ("transport_delay.delay_s", "sensor_lag.time_constant_s")
# What speeds and the oil spring depend on, with intervals.
OF_SPEED = ("valve.rated_flow_m3_s", "supply.pressure_pa", "nuisance.edge_gain_direction")
OF_SPRING = (
    "fluid.bulk_modulus_pa",
    "load.mass_kg",
    "load.viscous_friction_n_s_m",
    "cylinder.dead_volume_a_m3",
    "cylinder.dead_volume_b_m3",
    LEAKAGE,
    "nuisance.edge_rounding",
    "nuisance.edge_closing",
)
FRICTION = {
    "coulomb_friction": ("force_n", "force_n"),
    "coulomb_friction_sides": ("force_extending_n", "force_retracting_n"),
    "stribeck_friction": ("coulomb_n", "coulomb_n"),
    "position_friction": ("force_n", "force_n"),
}


@dataclass(frozen=True, eq=False)
class Direction:
    """One direction of motion."""

    speed: Estimate
    """At full opening against the constant load, without friction, m/s, > 0."""
    stall_n: float
    """Force at which the rod stops, N, > 0."""
    coulomb: Estimate
    """Dry friction while it slides, N."""
    velocity: FloatArray
    """Shape (100,), m/s, from 0 to the speed at full opening, without sign."""
    force: FloatArray
    """Friction at these velocities, N, without sign, shape (100,)."""
    opening: FloatArray
    """Opening that these velocities need, shares without sign, rising, shape (100,)."""


@dataclass(frozen=True, eq=False)
class Drive:
    """Cylinder and load of a machine."""

    area_a: float
    area_b: float
    """Of the piston, m^2."""
    static: Estimate
    """Dry friction at rest, N, mean of both directions."""
    stribeck_velocity: Estimate
    """m/s; 0 without a Stribeck curve."""
    viscous: Estimate
    """N s/m."""
    breakaway: float
    """Opening that replaces the leakage while the pressure overcomes dry friction, share."""
    extending: Direction
    retracting: Direction
    servo: Servo

    def direction(self, sign: float) -> Direction:
        """Returns the values of a direction."""
        return self.extending if sign > 0.0 else self.retracting


Values = Mapping[str, float]


def _areas(v: Values) -> tuple[float, float]:
    cap = 0.25 * math.pi * v["cylinder.bore_m"] ** 2
    return cap, cap - 0.25 * math.pi * v["cylinder.rod_m"] ** 2


def _stall(v: Values, side: int) -> float:
    a, b = _areas(v)[::side]
    supply, tank = (
        v[f"supply.{name}_pa"] - ATMOSPHERE_PA for name in ("pressure", "tank_pressure")
    )
    return supply * a - tank * b - side * v.get("effects.load_force.force_n", 0.0)


def _flow_gain(v: Values, side: int) -> float:
    """K of the edges of a direction, m^3/s for the root of a pascal."""
    gain = v["valve.rated_flow_m3_s"] / math.sqrt(v["valve.rated_pressure_drop_pa"])
    return gain * (1.0 + side * v.get("nuisance.edge_gain_direction", 0.0))


def _speed(v: Values, side: int) -> float:
    a, b = _areas(v)
    return _flow_gain(v, side) * math.sqrt(max(_stall(v, side), 0.0) / (a**3 + b**3))


def _spring_part(v: Values, position: float, part: int) -> float:
    return _spring(v, position)[part]


def _spring(v: Values, position: float) -> tuple[float, float]:
    """omega_n in rad/s and xi at null, at a share of the stroke.

    Linear chambers and load with the edges about null (Jelali, Kroll, Hydraulic Servo-systems,
    Springer 2003, ch. 4); the pair of the three poles of p_a, p_b and the velocity that swings.
    """
    a, b = _areas(v)
    stroke, mass = v["cylinder.stroke_m"], v["load.mass_kg"]
    beta = v["fluid.bulk_modulus_pa"]
    stiff_a = beta / (v["cylinder.dead_volume_a_m3"] + a * stroke * position)
    stiff_b = beta / (v["cylinder.dead_volume_b_m3"] + b * stroke * (1.0 - position))
    leak = v.get(LEAKAGE, 0.0)
    # Two rounded edges of a chamber at null, each with half of the supply; dq/dp = K area / (2
    # sqrt(dp)).
    overlap = v.get("effects.valve_dead_band.overlap", 0.0)
    rounding, closing = (v.get(f"nuisance.edge_{name}", 0.0) for name in ("rounding", "closing"))
    area = float(edge_area(np.array(-overlap), rounding, closing))
    drop = 0.5 * (v["supply.pressure_pa"] - v["supply.tank_pressure_pa"])
    edges = _flow_gain(v, 1) * area / math.sqrt(max(drop, 1.0))
    matrix = np.array(
        [
            [-stiff_a * (leak + edges), stiff_a * leak, -stiff_a * a],
            [stiff_b * leak, -stiff_b * (leak + edges), stiff_b * b],
            [a / mass, -b / mass, -v["load.viscous_friction_n_s_m"] / mass],
        ]
    )
    poles = sorted(np.linalg.eigvals(matrix), key=abs)[1:]
    omega_n = math.sqrt(abs(poles[0] * poles[1]))
    return omega_n, float(-(poles[0] + poles[1]).real / (2.0 * omega_n))


def edge_area(past_overlap: FloatArray, rounding: float, closing: float) -> FloatArray:
    """Returns the area of a metering edge, share of full opening, as the simulator has it.

    Parameters
    ----------
    past_overlap
        of the spool, share of full opening, any shape.
    rounding, closing
        the nuisances `edge_rounding` and `edge_closing`, see docs/simulator.md.
    """
    s, w = past_overlap, 2.0 * rounding
    leaks = 0.5 * (s + np.hypot(s, rounding))
    if w == 0.0:
        return np.asarray(leaks)
    closes = (np.clip(s, -w, w) + w) ** 2 / (4.0 * w) + np.maximum(s - w, 0.0)
    return np.asarray(leaks + closing * (closes - leaks))


def _band(
    known: Known, names: Sequence[str], of: Callable[[Values], float], middle: float
) -> tuple[float, float]:
    """Factors from a positive function of the values to the ends of its interval of 90 %."""
    assert known.rig is not None
    below = above = 0.0
    for name in names:
        for end in known.size(name).ci90 if name in known.rig.values else ():
            moved = math.log(max(of({**known.rig.values, name: end}), 1e-9) / middle)
            below, above = below + min(moved, 0.0) ** 2, above + max(moved, 0.0) ** 2
    return math.exp(-math.sqrt(below)), math.exp(math.sqrt(above))


def drive_of(known: Known) -> Drive | None:
    """Returns cylinder and load; None for a simulator of the user, which does not tell them.

    Raises
    ------
    ValueError
        the supply cannot move the load in a direction.
    """
    rig = known.rig
    if rig is None or rig.plant != "ehs":
        return None
    v = rig.values
    a, b = _areas(v)
    active = next((one for one in FRICTION if f"effects.{one}.{FRICTION[one][0]}" in v), None)
    coulomb = [Estimate(0.0, 0.0, 0.0)] * 2
    if active is not None:
        coulomb = [known.size(f"effects.{active}.{name}") for name in FRICTION[active]]
    mean = 0.5 * (coulomb[0].value + coulomb[1].value)
    static = known.size("effects.stribeck_friction.static_n", mean)
    stribeck = known.size("effects.stribeck_friction.stribeck_velocity_m_s")
    viscous = known.size("load.viscous_friction_n_s_m")
    # Leakage under the load pressure of the dry friction, over the flow of a full opening.
    drop = 0.5 * (v["supply.pressure_pa"] - v["supply.tank_pressure_pa"])
    leakage = v.get(LEAKAGE, 0.0) * 2.0 * static.value / (a + b)
    breakaway = leakage / (_flow_gain(v, 1) * math.sqrt(max(drop, 1.0)))
    ways = []
    for side, dry in zip((1, -1), coulomb, strict=True):
        stall, speed = _stall(v, side), _speed(v, side)
        if not stall > static.value:
            raise ValueError(
                f"{known.origin}: {'extending' if side > 0 else 'retracting'} the supply has "
                f"{stall:.4g} N against the load and {static.value:.4g} N of friction: expected "
                "more than the friction; look at supply, areas and load force"
            )
        low, high = _band(known, OF_SPEED, partial(_speed, side=side), speed)
        velocity = np.linspace(0.0, speed, POINTS)
        force = dry.value + viscous.value * velocity
        if stribeck.value > 0.0:
            # Armstrong-Helouvry et al., Automatica 30(7), 1994
            force += (static.value - dry.value) * np.exp(-((velocity / stribeck.value) ** 2))
        left = np.sqrt(np.maximum(1.0 - force / stall, 1.0 - MOST_FRICTION))
        opening = np.maximum.accumulate(velocity / speed / left + breakaway)
        interval = Estimate(speed, speed * low, speed * high)
        ways.append(Direction(interval, stall, dry, velocity, force, opening))
    servo = _servo(known, ways)
    return Drive(a, b, static, stribeck, viscous, breakaway, ways[0], ways[1], servo)


def _servo(known: Known, ways: Sequence[Direction]) -> Servo:
    """The servo behind the tables of the valve, which give both directions the same gain."""
    assert known.rig is not None
    v = known.rig.values
    gain = sum(one.speed.value for one in ways) / 2.0 / v["valve.rated_command_v"]
    low = min(one.speed.low / one.speed.value for one in ways)
    high = max(one.speed.high / one.speed.value for one in ways)
    springs = np.array([_spring(v, position=at) for at in POSITIONS])
    softest = int(np.argmin(springs[:, 0]))
    ends = []
    for i, value in enumerate(springs[softest]):
        of = partial(_spring_part, position=POSITIONS[softest], part=i)
        factors = _band(known, OF_SPRING, of, value)
        limits = springs[:, i].min() * factors[0], springs[:, i].max() * factors[1]
        ends.append(Estimate(float(value), *map(float, limits)))
    lag = known.size(f"{LAG}.bandwidth_hz", v.get("nuisance.spool_bandwidth_hz", 0.0))
    spool = Estimate(*(2.0 * math.pi * hz for hz in (lag.value, lag.low, lag.high)))
    delays = (v.get(f"effects.{name}", 0.0) for name in DELAYS)
    return Servo(
        Estimate(gain, low * gain, high * gain),
        ends[0],
        ends[1],
        sum(delays),
        spool if lag.value > 0.0 else None,
        v.get(f"{LAG}.damping", v.get("nuisance.spool_damping", 0.9)),
    )

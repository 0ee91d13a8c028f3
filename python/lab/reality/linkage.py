# SPDX-License-Identifier: MIT
"""Cylinders that turn a boom, as those of cranes and excavators do.

The foot of the cylinder and the boom have fixed pivots, and the eye of the rod is on the boom: a
triangle with two sides of constant length. Its angle is the state (`machine.turn_boom`). The rig
file states the mass that moves with the rod at mid-stroke, as a data sheet would; it states a load
force in half of the cases, that of the boom's weight at mid-stroke.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from . import machine as equations
from .effects import Effect, Sizes
from .excitation import Task
from .nominal_rig import NominalRig, Range, draw_drive, four_digits, is_built, spread, with_lag
from .truth import Truth

LINKAGE = "linkage"
LOAD = "effects.load_force.force_n"
GRAVITY = 9.81
# Angles of the triangle at the boom's pivot with the rod in and out, rad.
RETRACTED_RAD = (math.radians(20.0), math.radians(55.0))
EXTENDED_RAD = (math.radians(85.0), math.radians(145.0))
# The weight of a boom takes less than this share of the largest force anywhere in the stroke: the
# rest moves it.
LARGEST_WEIGHT = 0.35
# Effects of the catalogue that a part of it is.
LOADS = ("load_force", "load_spring")
# Of the stroke, to each side: how far the place goes about which the rod moves, and the movement
# about it. The way takes this share of the speed at full opening.
ALONG, AROUND, SLOW_SHARE = 0.3, 0.14, 0.3
# Laws that the simulator lacks for such a machine: equation and variable.
LAWS = (("force", "position_m"), ("mass", "position_m"))
BOOMS = Range(
    supply_pa=(14e6, 28e6),
    natural_hz=(5.0, 25.0),
    strokes_1_s=(0.3, 1.5),
    dead=(0.08, 0.3),
    damping=(0.05, 0.3),
    rated_drops_pa=(3.5e6, 0.5e6),
)


def draw_linkage_rig(rng: np.random.Generator) -> NominalRig:
    """Draws the rig file's values of a cylinder on a boom, without a load force.

    Bores of 40 to 140 mm, strokes of 0.3 to 1 m, 140 to 280 bar, oil springs of 5 to 25 Hz with a
    damping ratio of 0.05 to 0.3, 0.3 to 1.5 strokes a second at full opening.
    """
    while True:
        bore = round(spread(rng, 0.040, 0.140), 3)
        rod = round(bore * float(rng.uniform(0.5, 0.72)), 3)
        stroke = round(spread(rng, 0.3, 1.0), 2)
        rig, natural = draw_drive(rng, BOOMS, bore, rod, stroke)
        rig = with_lag(rng, rig, 30.0, 100.0)
        if is_built(rig, natural):
            return rig


def draw_linkage(rng: np.random.Generator, rig: NominalRig) -> dict[str, float]:
    """Draws the geometry of a boom for this cylinder.

    Returns
    -------
    the three lengths of the triangle, m: of its fixed side, of its side on the boom, of the
    retracted cylinder; its angle with the boom level, rad; and the distance of the boom's centre of
    mass from its pivot over its radius of gyration squared, 1/m.
    """
    while True:
        retracted = rig.stroke_m * float(rng.uniform(1.2, 1.6))
        extended = retracted + rig.stroke_m
        first, last = float(rng.uniform(*RETRACTED_RAD)), float(rng.uniform(*EXTENDED_RAD))
        # l^2 = a^2 + b^2 - 2 a b cos(phi) at both ends
        twice = (extended**2 - retracted**2) / (math.cos(first) - math.cos(last))
        squares = retracted**2 + twice * math.cos(first)
        apart = squares - twice
        if apart < 0.0:
            continue
        total, difference = math.sqrt(squares + twice), math.sqrt(apart)
        pivot, lever = 0.5 * (total + difference), 0.5 * (total - difference)
        if lever < 0.15 * pivot:
            continue
        # A beam of length L: c = L / 2, k^2 = L^2 / 3; with a load at its end c / k^2 is 1 / L.
        length = pivot * float(rng.uniform(2.5, 6.0))
        sizes = {
            "pivot_m": pivot,
            "lever_m": lever,
            "retracted_m": retracted,
            "level_rad": float(rng.uniform(first, last)),
            "centre_1_m": float(rng.uniform(1.0, 1.5)) / length,
        }
        if rng.random() < 0.5:
            sizes["pivot_m"], sizes["lever_m"] = lever, pivot
        if _largest_weight(sizes, rig) < LARGEST_WEIGHT * rig.force_n:
            return sizes


def put_linkage(machine: Truth, sizes: Sizes, _: float) -> Truth:
    """The mass of the machine is that which moves with the rod at mid-stroke."""
    boom = machine._replace(
        boom_kg_m2=1.0,
        boom_level_rad=sizes["level_rad"],
        pivot_m=sizes["pivot_m"],
        lever_m=sizes["lever_m"],
        retracted_m=sizes["retracted_m"],
    )
    middle = equations.arm(equations.boom_angle(0.5 * machine.stroke_m, boom), boom)
    inertia = machine.mass_kg * middle**2
    return boom._replace(boom_kg_m2=inertia, boom_n_m=inertia * sizes["centre_1_m"] * GRAVITY)


def weight_at(position: float, machine: Truth) -> float:
    """Force of the boom's weight on the rod against extension at a position, N."""
    angle = equations.boom_angle(position, machine)
    return float(equations.weight_moment(angle, machine) / equations.arm(angle, machine))


def _largest_weight(sizes: Sizes, rig: NominalRig) -> float:
    told = Truth(rig.values["load.mass_kg"], 0.0, rig.stroke_m)
    boom = put_linkage(told, sizes, 0.0)
    return max(abs(weight_at(share * rig.stroke_m, boom)) for share in np.linspace(0.0, 1.0, 21))


def with_told_load(rng: np.random.Generator, rig: NominalRig, sizes: Sizes) -> NominalRig:
    """The rig, whose file states the boom's weight at mid-stroke as a load force in half of all."""
    told = Truth(rig.values["load.mass_kg"], 0.0, rig.stroke_m)
    weight = weight_at(0.5 * rig.stroke_m, put_linkage(told, sizes, 0.0))
    if rng.random() < 0.5:
        return rig
    return replace(rig, values={**rig.values, **four_digits({LOAD: weight})})


def over_the_stroke(rng: np.random.Generator, task: Task, rig: NominalRig, dt_s: float) -> Task:
    """The task about a place that goes slowly over the stroke and back, as a sine."""
    around = task.reference - 0.5 * (task.reference.max() + task.reference.min())
    largest = max(float(np.abs(around).max()), 1e-9)
    share = min(1.0 - SLOW_SHARE, AROUND * rig.stroke_m / largest)
    way = ALONG * rig.stroke_m
    # The largest speed of the sine is this share of that at full opening.
    rate = float(rng.uniform(0.5, 1.0)) * SLOW_SHARE * rig.speed_m_s / way
    turn = rate * dt_s * np.arange(task.reference.size) + float(rng.uniform(0.0, 2.0 * math.pi))
    forward = share * task.forward + way * rate / rig.speed_m_s * np.cos(turn)
    reference = 0.5 * rig.stroke_m + share * around + way * np.sin(turn)
    return Task(forward, reference, task.gain)


EFFECT = Effect("mechanics", draw_linkage, put_linkage)

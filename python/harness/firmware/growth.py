# SPDX-License-Identifier: MIT
"""Tables of a `GrowthMonitor`, which tells on the target which of a few effects grows.

A quiet record gives the linear servo with its observer, and mean and deviation of the innovations
in each cell of command and acceleration. The simulator of the rig, driven along the record, gives
the signatures: how the means change when an effect grows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.stats import chi2

import ehsid

from ..base.numbers import FloatArray
from ..catalogue.spellings import ParameterKey
from ..models.identification import IdentificationError, IoData
from ..rigs import Rig
from ..signals.simulation.controller import velocity_gain
from ..signals.simulation.run import check_inside, noise_sigma, prepare
from .growth_observer import Observer, fit_observer

CELLS = 40
"""Of the command times those of the acceleration, as in growth_tables.hpp."""
EFFECTS = (
    ("valve_dead_band", "overlap", 1),
    ("coulomb_friction", "force_n", 1),
    ("internal_leakage", "coefficient_m3_s_pa", 1),
    ("valve_null_bias", "offset", 1),
    ("valve_null_bias", "offset", -1),
)
"""Effect, parameter and direction of growth of each test."""
OTHERS = (("gain", 0.03), ("load.viscous_friction_n_s_m", 0.03))
"""What changes with the oil, too, and shares of it: eliminated and never told."""
SHARE = 0.01
"""An effect as the record is first asked for it: this share of full opening, of the largest force,
of the rated flow at the pressure of the supply."""
LARGER = (0.01, 0.02, 0.05, 0.1)
"""Shares with signatures of their own."""
PRIOR = 0.1
"""1 / standard deviation of what is eliminated, in the sizes above."""
OPEN = 2.0
"""Deviations of what the record leaves open that are no growth."""
MARGIN = 0.25
"""What the record leaves open, as a share of the unit of an effect."""
LIMIT = 4.0
"""Deviations up to which an innovation counts, as in growth_monitor.hpp."""
HOURS = 8766.0
"""Of running between false alarms of all tests together: a year."""
BLOCK_S = 1.0
LEAST_BLOCKS = 100
LEAST_IN_CELL = 50
MOST_SIMULATED = 60_000
LOOP_HZ = 1.0
"""Loop that keeps the simulated rod beside the recorded one."""

Cells = npt.NDArray[np.int64]


@dataclass(frozen=True)
class GrowingEffect:
    """An effect that is tested in one direction."""

    name: str
    """Full name of its parameter, without `effects.`."""
    sizes: tuple[float, ...]
    """Of its signatures, signed, in the unit of the parameter; the first is that of the test."""


@dataclass(frozen=True, eq=False)
class GrowthTables:
    """What `ehsid.GrowthMonitor` is made of, with the meaning of its tests."""

    dt_s: float
    observer: Observer
    block: int
    command_edges: FloatArray
    acceleration_edges: FloatArray
    mean: FloatArray
    weight: FloatArray
    other: FloatArray
    """Shape (CELLS, 2), in deviations."""
    signature: FloatArray
    """Shape (CELLS, signatures), in deviations: those of the first effect, of the second one .."""
    effects: tuple[GrowingEffect, ...]
    scatter: FloatArray
    """Variance of a block's score over its information, >= 1, of each effect."""
    limit: float

    @property
    def effect(self) -> list[int]:
        """Effect of each signature."""
        return [i for i, effect in enumerate(self.effects) for _ in effect.sizes]

    @property
    def tests(self) -> list[tuple[int, float, float]]:
        """Signature, trust and margin of each test."""
        return [
            (self.effect.index(i), 1.0 / float(scatter), MARGIN)
            for i, scatter in enumerate(self.scatter)
        ]

    def monitor(self) -> ehsid.GrowthMonitor:
        """Returns a new monitor, as on the target."""
        return ehsid.GrowthMonitor(
            servo=self.observer.numbers(self.dt_s),
            correction=self.observer.correction,
            delay=self.observer.delay,
            settle=self.observer.settle,
            block=self.block,
            command_edges=self.command_edges,
            acceleration_edges=self.acceleration_edges,
            mean=self.mean,
            weight=self.weight,
            other=self.other,
            signature=self.signature,
            effect=self.effect,
            tests=self.tests,
            prior=PRIOR**2,
            limit=self.limit,
        )


class _Driven:
    """The rig in the simulator, driven along a record, and seen by a monitor."""

    def __init__(self, rig: Rig, data: IoData, dt_s: float, tables: GrowthTables) -> None:
        self.rig, self.data, self.dt_s, self.tables = rig, data, dt_s, tables
        samples = min(data.n_samples, MOST_SIMULATED)
        rng = np.random.default_rng(46)
        self.noise = rng.normal(size=samples) * noise_sigma(rig, "position_m")
        self.cells, self.quiet = self.run("gain", 0.0)
        count = np.bincount(self.cells, minlength=CELLS)
        self.mean = np.bincount(self.cells, self.quiet, CELLS) / np.maximum(count, 1)
        self.used = count >= LEAST_IN_CELL

    def run(self, name: str, size: float) -> tuple[Cells, FloatArray]:
        """Cells and innovations with one value larger by this size, the gain by a share."""
        rig, data = self.rig, self.data
        values = {} if name == "gain" else {name: rig.values.get(name, 0.0) + size}
        share = 1.0 + size if name == "gain" else 1.0
        start = prepare(rig, dt_s=self.dt_s, position0_m=float(data.y[0]), values=values)
        plant = start.plant()
        loop = 2.0 * math.pi * LOOP_HZ / velocity_gain(rig)
        command, position = np.empty(self.noise.size), np.empty(self.noise.size)
        for k in range(self.noise.size):
            position[k] = float(plant.read()[0]) + self.noise[k]
            command[k] = data.u[k] + loop * (data.y[k] - position[k])
            plant.advance(share * command[k])
        check_inside(position, start.values["cylinder.stroke_m"], self.dt_s)
        return in_cells(self.tables, command, position)

    def signature(self, name: str, size: float, weight: FloatArray) -> FloatArray:
        """Change of the means by a size, in deviations, limited as on the target."""

        def means(cells: Cells, innovations: FloatArray) -> FloatArray:
            x = np.clip((innovations - self.mean[cells]) * weight[cells], -LIMIT, LIMIT)
            count = np.bincount(cells, minlength=CELLS)
            self.used &= count >= LEAST_IN_CELL
            return np.asarray(np.bincount(cells, x, CELLS) / np.maximum(count, 1))

        return means(*self.run(name, size)) - means(self.cells, self.quiet)


def in_cells(tables: GrowthTables, u: FloatArray, y: FloatArray) -> tuple[Cells, FloatArray]:
    """Cells and innovations over a record, behind the start."""
    run = tables.monitor().run(u, y)
    kept = slice(tables.observer.settle + 2, None)
    return run.cell[kept].astype(np.int64), run.innovation[kept].astype(np.float64)


def _scatter(scores: FloatArray, information: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Variance of the scores over their information, >= 1, and the information beside the others.

    scores: shape (blocks, 2 + effects), those that are eliminated first. information: A of a block.
    The variance is the upper end of its 95 % interval, or that of sums of neighbouring blocks where
    this is larger, because blocks may depend on each other.
    """
    count = len(OTHERS)
    a = information[:count, :count] + PRIOR**2 / len(scores) * np.eye(count)
    shares = np.linalg.solve(a, information[:count, count:])
    left = np.diag(information[count:, count:] - information[count:, :count] @ shares)
    own = scores[:, count:] - scores[:, :count] @ shares
    found = [np.ones(len(left)), np.sum(own**2, axis=0) / left / chi2.ppf(0.05, len(own))]
    together = 2
    while together * 12 <= len(own):
        groups = len(own) // together
        sums = own[: groups * together].reshape(groups, together, -1).sum(axis=1)
        found.append(np.mean(sums**2, axis=0) / (together * left))
        together *= 2
    return np.max(found, axis=0), left


def _checked(rig: Rig, data: IoData, hours: float) -> tuple[float, int]:
    """Returns sampling time and samples of a block; raises the errors of `growth_tables`."""
    if rig.plant != "ehs":
        raise ValueError(f'{rig.name}: expected a rig with plant = "ehs", not "{rig.plant}"')
    if not 0.0 < hours < math.inf:
        raise ValueError(f"hours {hours:g}: expected a finite number above 0")
    if data.dt_s is None or len(data.segments) > 1:
        raise IdentificationError(
            "the record has gaps, or no sampling time: expected a record without gaps, and --dt"
        )
    signatures = len(EFFECTS) * (1 + len(LARGER))
    steps = 10 * (len(OTHERS) + signatures) + len(EFFECTS) * (signatures + 1)
    block = max(round(BLOCK_S / data.dt_s), steps)
    if data.n_samples < LEAST_BLOCKS * block:
        raise IdentificationError(
            f"the record has {data.n_samples} samples: expected at least {LEAST_BLOCKS * block}, "
            "so that it tells how a quiet machine scatters; record longer"
        )
    return data.dt_s, block


def growth_tables(rig: Rig, data: IoData, hours: float = HOURS) -> GrowthTables:
    """Makes the tables.

    Parameters
    ----------
    rig
        the machine as it is now: a rig with plant `ehs`, e.g. the `rig.augmented.toml` of a
        diagnosis.
    data
        command, V, and position, m, of the quiet machine at its usual work, without gaps.
    hours
        of running between false alarms of all tests together, > 0.

    Raises
    ------
    IdentificationError
        the record has gaps, no sampling time, is too short, or does not show an effect.
    ValueError
        the rig has no hydraulics, or the hours are out of range.
    """
    dt_s, block = _checked(rig, data, hours)
    observer = fit_observer(data.u, data.y, dt_s, velocity_gain(rig))
    command = np.quantile(np.abs(data.u), [0.25, 0.5, 0.8])
    acceleration = np.quantile(np.abs(observer.accelerations(data.u)), [0.6, 0.9])
    if not (np.all(np.diff([0.0, *command]) > 0) and np.all(np.diff([0.0, *acceleration]) > 0)):
        raise IdentificationError(
            "the command rests during a quarter of the record or more: expected the usual work"
        )
    v = rig.values
    whole = {
        "coulomb_friction": math.pi / 4 * v["cylinder.bore_m"] ** 2 * v["supply.pressure_pa"],
        "internal_leakage": v["valve.rated_flow_m3_s"] / v["supply.pressure_pa"],
    }
    keys = [str(ParameterKey.of_effect(effect, parameter)) for effect, parameter, _ in EFFECTS]
    wholes = [direction * whole.get(effect, 1.0) for effect, _, direction in EFFECTS]
    cut = GrowthTables(
        dt_s=dt_s,
        observer=observer,
        block=block,
        command_edges=np.hstack([-command[::-1], 0.0, command]),
        acceleration_edges=np.hstack([-acceleration[::-1], acceleration]),
        mean=np.zeros(CELLS),
        weight=np.zeros(CELLS),
        other=np.zeros((CELLS, len(OTHERS))),
        signature=np.zeros((CELLS, len(EFFECTS))),
        effects=tuple(GrowingEffect(key, (SHARE,)) for key in keys),
        scatter=np.ones(len(EFFECTS)),
        limit=math.log(len(EFFECTS) * hours * 3600.0 / (block * dt_s)),
    )
    cells, innovations = in_cells(cut, data.u, data.y)
    count = np.bincount(cells, minlength=CELLS)
    mean = np.bincount(cells, innovations, CELLS) / np.maximum(count, 1)
    square = np.bincount(cells, (innovations - mean[cells]) ** 2, CELLS)
    deviation = np.sqrt(square / np.maximum(count - 1, 1))
    used = (count >= LEAST_IN_CELL) & (deviation > 0.0)
    weight = np.where(used, 1.0 / np.where(used, deviation, 1.0), 0.0)

    driven = _Driven(rig, data, dt_s, cut)
    other = np.column_stack(
        [driven.signature(name, share * v.get(name, 1.0), weight) for name, share in OTHERS]
    )
    asked = [
        driven.signature(key, SHARE * all_, weight) for key, all_ in zip(keys, wholes, strict=True)
    ]
    # Scatter of the scores over blocks of the record, and the units that it tells apart from 0.
    first = np.where((weight > 0)[:, np.newaxis], np.column_stack([other, *asked]), 0.0)
    blocks = cells.size // block
    cells, innovations = cells[: blocks * block], innovations[: blocks * block]
    x = np.clip((innovations - mean[cells]) * weight[cells], -LIMIT, LIMIT)
    scores = (first[cells] * x[:, np.newaxis]).reshape(blocks, block, -1).sum(axis=1)
    information = first[cells].T @ first[cells] / blocks
    if not np.all(np.diag(information) > 0.0):
        raise IdentificationError("the record does not show an effect: expected the usual work")
    scatter, left = _scatter(scores, information)
    units = SHARE * OPEN / MARGIN * np.sqrt(scatter / (left * blocks))
    shares = [(unit, *(share for share in LARGER if share > 1.5 * unit)) for unit in units]
    signature = np.column_stack(
        [
            driven.signature(key, share * all_, weight)
            for key, all_, each in zip(keys, wholes, shares, strict=True)
            for share in each
        ]
    )
    unseen = ~(driven.used & (weight > 0.0))
    for table in (weight, other, signature):
        table[unseen] = 0.0
    return replace(
        cut,
        mean=mean,
        weight=weight,
        other=other,
        signature=signature,
        effects=tuple(
            GrowingEffect(key.removeprefix("effects."), tuple(share * all_ for share in each))
            for key, all_, each in zip(keys, wholes, shares, strict=True)
        ),
        scatter=scatter,
    )

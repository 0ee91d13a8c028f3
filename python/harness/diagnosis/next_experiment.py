# SPDX-License-Identifier: MIT
"""Next experiment: from a menu, the one that separates candidates where the records cannot.

The design is T-optimal: it chooses the record on which the outputs of the best candidate differ
most from those of every other candidate, after a new fit of that candidate (A. Atkinson,
V. Fedorov, Biometrika 62(1), 1975).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..base.numbers import FloatArray
from ..base.parallel import Progress, part_of, run_together
from ..catalogue.channels import CHAMBER_PRESSURES, SUPPLY_PRESSURE
from ..catalogue.parameters import effects, plant_parameters
from ..catalogue.spellings import ParameterKey
from ..records import Record, make_record
from ..rigs import Rig
from ..signals.excitation import chirp, multisine, random_steps, triangle
from ..signals.simulation import (
    SimulationError,
    command_limit,
    simulate_closed_loop,
    suggested_controller,
    velocity_gain,
)
from ..signals.simulation.run import noise_sigma
from .data.floor import DESIGN_PRESSURE_NOISE, NoiseFloor
from .model.fit import ITERATIONS
from .model.separation import CandidateModel, Separation, separations
from .schema import NEXT_EXPERIMENT, NextExperiment

# Duration of an experiment, s: long enough for fifteen windows, and short enough to run several of
# them in an afternoon.
DESIGN_S = 8.0
# Upper end of the excited band: above the corner frequency of any servo valve whose lag matters.
DESIGN_FAST_HZ = 150.0
# Bandwidth of the loop that holds the rod about its path. It leaves the command unchanged above a
# few times this frequency.
DESIGN_HELD_HZ = 0.2
# Share of the span that stays free at either end. Half of it is for what the rig file does not
# tell.
DESIGN_MARGIN = 0.1
# Chamber pressures may exceed the supply pressure through inertia and unequal areas. Above this
# multiple of it, relief valves open.
DESIGN_PRESSURE = 1.5
# Below half an atmosphere oil foams, which harms the machine, and no simulator is accurate there.
DESIGN_VACUUM_PA = 5e4

# A function that returns a signal in [-1, 1], shape (n,), from n and the sampling time dt_s.
Shape = Callable[[int, float], FloatArray]
SEED = 7


@dataclass(frozen=True)
class Entry:
    """An excitation of the menu."""

    description: str
    """Description for the operator; {speed} in mm/s and {size} in per cent are filled in."""
    size: float
    """Amplitude of the command, as a share of its limit."""
    shape: Shape
    """Function that returns the shape of the command."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """An experiment with the outputs that the best candidate predicts."""

    description: str
    """One line for the operator."""
    record: Record
    """Command and all outputs of the plant, without noise."""


def _triangle(period_s: float, n: int, dt_s: float) -> FloatArray:
    return triangle(n, dt_s, amplitude=1.0, period_s=period_s)


def _steps(hold_s: tuple[float, float], n: int, dt_s: float) -> FloatArray:
    hold = round(hold_s[0] / dt_s), round(hold_s[1] / dt_s)
    rng = np.random.default_rng(SEED)
    return random_steps(n, amplitude=1.0, hold=hold, rng=rng)


def _multisine(low_hz: float, n: int, dt_s: float) -> FloatArray:
    band = low_hz, min(DESIGN_FAST_HZ, 0.4 / dt_s)
    return multisine(n, dt_s, band_hz=band, peak=1.0, rng=np.random.default_rng(SEED))


def _chirp(n: int, dt_s: float) -> FloatArray:
    return chirp(n, dt_s, amplitude=1.0, band_hz=(1.0, min(DESIGN_FAST_HZ, 0.4 / dt_s)))


def _away_from_null(n: int, dt_s: float) -> FloatArray:
    """Forward and back at a steady speed, with a small triangle on it; shape (n,)."""
    slow = np.sign(np.sin(2.0 * np.pi * 0.5 * np.arange(n) * dt_s))
    return np.asarray(0.85 * slow + 0.15 * triangle(n, dt_s, amplitude=1.0, period_s=0.25))


def _pauses(n: int, dt_s: float) -> FloatArray:
    """Moves of 0.25 s in alternating directions, with rests of 0.75 s between them; shape (n,)."""
    phase = np.arange(n) * dt_s
    moving = phase % 1.0 < 0.25
    return np.where(moving, np.sign(np.sin(np.pi * np.floor(phase) + 0.5)), 0.0)


def _everything(n: int, dt_s: float) -> FloatArray:
    """Slow triangle, small reversals, fast multisine and large steps in sequence; shape (n,)."""
    part = n // 4
    shapes = (
        0.05 * _triangle(1.0, part, dt_s),
        0.02 * _triangle(0.25, part, dt_s),
        0.4 * _multisine(1.0, part, dt_s),
        _steps((0.05, 0.2), n - 3 * part, dt_s),
    )
    return np.concatenate([shape - shape.mean() for shape in shapes])


MENU = (
    Entry("slow triangle, {speed:.2g} mm/s, 8 reversals", 0.02, partial(_triangle, 2.0)),
    Entry("slow triangle, {speed:.2g} mm/s, 8 reversals", 0.08, partial(_triangle, 2.0)),
    Entry("triangle, {speed:.2g} mm/s, 16 reversals", 0.3, partial(_triangle, 1.0)),
    Entry(
        "triangle up to {size:.0f} % of the command, 32 reversals", 0.95, partial(_triangle, 0.5)
    ),
    Entry(
        "small reversals about null, {size:.0f} % of the command", 0.03, partial(_triangle, 0.25)
    ),
    Entry(
        "steady speed of {size:.0f} % to and fro, with small reversals on it", 0.3, _away_from_null
    ),
    Entry("moves at {size:.0f} % with rests between", 0.2, _pauses),
    Entry("random steps up to {size:.0f} %", 0.08, partial(_steps, (0.1, 0.4))),
    Entry("random steps up to {size:.0f} %", 0.3, partial(_steps, (0.1, 0.4))),
    Entry("random steps up to {size:.0f} %", 0.95, partial(_steps, (0.04, 0.2))),
    Entry(
        "multisine from 0.5 Hz past the valve, up to {size:.0f} %", 0.1, partial(_multisine, 0.5)
    ),
    Entry("multisine from 2 Hz past the valve, up to {size:.0f} %", 0.6, partial(_multisine, 2.0)),
    Entry("chirp from 1 Hz past the valve, {size:.0f} %", 0.15, _chirp),
    Entry(
        "slow triangle, small reversals, fast multisine, steps up to {size:.0f} %",
        0.8,
        _everything,
    ),
)


def simulate_experiment(
    entry: Entry,
    rig: Rig,
    values: dict[str, float],
    *,
    dt_s: float,
    limit_v: float,
    span_m: tuple[float, float],
) -> Experiment | None:
    """Simulates an excitation on a machine; returns None if it would leave the limits.

    Because a servo drifts, a slow position loop holds the rod about its path. The command that this
    loop puts out is the command of the experiment.

    Parameters
    ----------
    entry
        entry of the menu.
    rig
        the machine.
    values
        values of the best candidate, by full name.
    dt_s
        sampling time, s.
    limit_v
        largest command, V.
    span_m
        smallest and largest position of the rod, m.
    """
    n = round(DESIGN_S / dt_s)
    shape = entry.shape(n, dt_s)
    command = entry.size * limit_v * (shape - shape.mean())
    # Path of a plant whose speed follows the command. It ends where it began.
    path = velocity_gain(rig) * dt_s * np.cumsum(command)
    room = (1.0 - 2.0 * DESIGN_MARGIN) * (span_m[1] - span_m[0])
    scale = min(1.0, room / max(float(np.ptp(path)), 1e-12))
    path = 0.5 * (span_m[0] + span_m[1]) + scale * (path - 0.5 * (path.max() + path.min()))
    controller = replace(suggested_controller(rig, DESIGN_HELD_HZ), limit_v=limit_v)
    try:
        run = simulate_closed_loop(rig, path, controller, dt_s=dt_s, values=values)
    except SimulationError:
        return None
    record = run.run.record
    position = record.column("position_m")
    # The other half of the margin is for errors of the candidate.
    edge = 0.5 * DESIGN_MARGIN * (span_m[1] - span_m[0])
    if position.min() < span_m[0] + edge or position.max() > span_m[1] - edge:
        return None
    if rig.plant == "ehs":
        chambers = np.stack([record.column(name) for name in ("pressure_a_pa", "pressure_b_pa")])
        largest_pressure = DESIGN_PRESSURE * rig.values["supply.pressure_pa"]
        if chambers.max() > largest_pressure or chambers.min() < DESIGN_VACUUM_PA:
            return None
    size = scale * entry.size
    speed = 1e3 * velocity_gain(rig) * size * limit_v
    return Experiment(entry.description.format(speed=speed, size=100.0 * size), record)


# Iterations of a fit on each entry of the menu. The best entries are then fitted as in the
# diagnosis.
DESIGN_ITERATIONS = 4
DESIGN_FINALISTS = 6
# With a power of nineteen in twenty, no sensor needs to be bought.
DESIGN_POWER = 0.95
# A sensor that adds less than this to the power is not requested.
DESIGN_GAIN = 0.1

# Number of finalists that are fitted in parallel. The result depends on this number; therefore it
# does not depend on the number of cores.
PARALLEL_FITS = 2
# Shares of the time: of the sensors that there are, which mostly suffice, and in it of short fits.
FIRST_SENSORS, SHORT_FITS = 0.7, 0.6
# Sensors that can be added, in this order of preference.
ADDED_SENSORS = (CHAMBER_PRESSURES, (SUPPLY_PRESSURE,))


def _weakest_separation(
    rig: Rig,
    candidates: Sequence[CandidateModel],
    experiment: Experiment,
    *,
    floors: Mapping[str, float],
    iterations: int,
) -> Separation:
    """Returns the separation with the smallest power on the record of an experiment."""
    results = separations(rig, candidates, experiment.record, floors, iterations=iterations)
    return min(results, key=lambda separation: separation.power)


def next_experiment(
    rig: Rig,
    candidates: Sequence[CandidateModel],
    outputs: Sequence[str],
    floors: Mapping[str, NoiseFloor],
    *,
    dt_s: float = 1e-3,
    command_limit_v: float | None = None,
    span_m: tuple[float, float] | None = None,
    progress: Progress | None = None,
) -> tuple[NextExperiment, Record] | None:
    """Designs a record that separates the best candidate from all others.

    The design is the excitation of the menu, inside the limits of stroke, command and pressure,
    that has the largest power against the candidate that is hardest to separate. Sensors that the
    records did not have are requested only if the power stays below DESIGN_POWER without them. A
    low power is reported as it is.

    Parameters
    ----------
    rig
        the machine.
    candidates
        effects and values of the plant by full name, the best first; values that are missing are
        taken from the rig.
    outputs
        outputs that the records had.
    floors
        noise floors of those outputs, by name.
    dt_s
        sampling time of the experiment, s.
    command_limit_v
        largest command, V; by default the rated command, required if the rig has none.
    span_m
        smallest and largest position, m; by default the stroke, required if the rig has none.
    progress
        called with the share of the work that is done, 0 to 1.

    Returns
    -------
    The experiment, and its record as `result.Diagnosis.next_record`; None if there are fewer than
    two candidates, a limit is not known, or no entry of the menu stays inside the limits.
    """
    if len(candidates) < 2:
        return None
    candidates = [(effects, runnable(values)) for effects, values in candidates]
    limit_v = command_limit(rig) if command_limit_v is None else command_limit_v
    if span_m is None:
        span_m = 0.0, rig.values.get("cylinder.stroke_m", np.inf)
    if not (np.isfinite(limit_v) and np.isfinite(span_m).all()):
        return None
    make = partial(
        simulate_experiment,
        rig=rig,
        values=dict(candidates[0][1]),
        dt_s=dt_s,
        limit_v=limit_v,
        span_m=span_m,
    )
    experiments = [
        experiment
        for experiment in run_together([partial(make, entry) for entry in MENU])
        if experiment is not None
    ]
    if not experiments:
        return None
    best: tuple[float, Experiment, tuple[str, ...]] | None = None
    sensor_sets = _sensor_sets(rig, outputs, floors)
    done = [0.0, *np.linspace(FIRST_SENSORS, 1.0, len(sensor_sets))]
    for begin, end, sensor_floors in zip(done, done[1:], sensor_sets, strict=False):
        part = part_of(progress, begin, end)
        power, experiment = _most_powerful(rig, candidates, experiments, sensor_floors, part)
        if best is None or power > best[0] + DESIGN_GAIN:
            best = power, experiment, tuple(sensor_floors)
        if best[0] >= DESIGN_POWER:
            break
    assert best is not None
    power, best_experiment, measured = best
    coming = NextExperiment(
        separates=tuple("+".join(effects) or "no effect" for effects, _ in candidates),
        record=NEXT_EXPERIMENT,
        description=best_experiment.description,
        power=power,
        sensors=("command_v", *measured),
    )
    return coming, _experiment_record(best_experiment.record)


def _most_powerful(
    rig: Rig,
    candidates: Sequence[CandidateModel],
    experiments: Sequence[Experiment],
    floors: Mapping[str, float],
    progress: Progress | None,
) -> tuple[float, Experiment]:
    """Returns the largest power and the experiment that has it.

    All experiments get short fits. Those with the largest separation then get whole fits, until one
    of them reaches DESIGN_POWER.
    """
    weakest = partial(_weakest_separation, rig, list(candidates), floors=floors)
    screened = run_together(
        [partial(weakest, experiment, iterations=DESIGN_ITERATIONS) for experiment in experiments],
        part_of(progress, 0.0, SHORT_FITS),
    )
    # The largest separation comes first; equal ones stay in the order of the menu.
    order = sorted(range(len(experiments)), key=lambda i: screened[i].nats, reverse=True)
    powers: list[tuple[float, Experiment]] = []
    for begin in range(0, min(len(experiments), DESIGN_FINALISTS), PARALLEL_FITS):
        finalists = [experiments[i] for i in order[begin : begin + PARALLEL_FITS]]
        finals = run_together(
            [partial(weakest, experiment, iterations=ITERATIONS) for experiment in finalists]
        )
        powers += [
            (final.power, experiment) for final, experiment in zip(finals, finalists, strict=True)
        ]
        if max(power for power, _ in powers) >= DESIGN_POWER:
            break
    return max(powers, key=lambda scored: scored[0])


def runnable(values: Mapping[str, float]) -> dict[str, float]:
    """Returns values that the simulator accepts: a fit may pass a bound by a rounding error."""
    inside = {
        name: min(max(value, plant_parameters()[name].minimum), plant_parameters()[name].maximum)
        if value != 0.0
        else value
        for name, value in values.items()
    }
    for effect in effects().values():
        for pair in effect.not_below:
            larger, smaller = (ParameterKey.of_effect(effect.id, name) for name in pair)
            if larger in inside and smaller in inside:
                inside[larger] = max(inside[larger], inside[smaller])
    return inside


def _sensor_sets(
    rig: Rig, outputs: Sequence[str], floors: Mapping[str, NoiseFloor]
) -> list[dict[str, float]]:
    """Returns noise floors by output: for the measured outputs, and for sets with more sensors."""
    known = {name: floors[name].value for name in outputs}
    sets = [known]
    if rig.plant != "ehs":
        return sets
    default_floor = DESIGN_PRESSURE_NOISE * rig.values["supply.pressure_pa"]
    for added in ADDED_SENSORS:
        missing = [name for name in added if name not in sets[-1]]
        if missing:
            added_floors = {name: noise_sigma(rig, name) or default_floor for name in missing}
            sets.append({**sets[-1], **added_floors})
    return sets


def _experiment_record(record: Record) -> Record:
    assert record.time_s is not None
    names = ("command_v", "position_m")
    columns = {"time_s": record.time_s, **{name: record.column(name) for name in names}}
    return make_record(columns, name="next_experiment")

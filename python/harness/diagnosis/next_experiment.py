# SPDX-License-Identifier: MIT
"""Next experiment: from a menu, the one that separates candidates where the records cannot.

The design is T-optimal: it chooses the record on which the outputs of the best candidate differ
most from those of every other candidate, after a new fit of that candidate (A. Atkinson,
V. Fedorov, Biometrika 62(1), 1975).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from ..base.parallel import Progress, part_of, run_together
from ..catalogue.channels import CHAMBER_PRESSURES, COMMAND, POSITION, SUPPLY_PRESSURE
from ..catalogue.parameters import effects, plant_parameters
from ..catalogue.spellings import ParameterKey
from ..records import Record, make_record
from ..rigs import Rig
from ..signals.excitation.menu import MENU, Entry
from ..signals.simulation import (
    SimulationError,
    command_limit,
    simulate_closed_loop,
    suggested_controller,
    velocity_gain,
)
from ..signals.simulation.run import noise_sigma
from .data.floor import DESIGN_PRESSURE_NOISE, NoiseFloor
from .data.gate import MOVES
from .limits import Limits
from .model.separation import LAST_ITERATIONS, CandidateModel, Separation, separations
from .schema import NEXT_EXPERIMENT, NextExperiment

# Duration of an experiment, s: long enough for fifteen windows, and short enough to run several of
# them in an afternoon.
DESIGN_S = 8.0
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


@dataclass(frozen=True, eq=False)
class Experiment:
    """An experiment with the outputs that the best candidate predicts."""

    description: str
    """One line for the operator."""
    record: Record
    """Command and all outputs of the plant, without noise."""


def limits_of(rig: Rig, records: Sequence[Record] = ()) -> Limits | None:
    """Returns what the rig file tells of the limits; None where it does not tell enough.

    A rig without a stroke, such as an axis, stays within the positions and commands of its records.
    """
    low, high = 0.0, rig.values.get("cylinder.stroke_m", math.inf)
    command = command_limit(rig)
    if not math.isfinite(high) and records:
        low = min(float(record.column(POSITION).min()) for record in records)
        high = max(float(record.column(POSITION).max()) for record in records)
        command = max(float(np.abs(record.column(COMMAND)).max()) for record in records)
    if not (math.isfinite(command) and math.isfinite(high) and low < high and command > 0.0):
        return None
    supply = rig.values.get("supply.pressure_pa", math.inf)
    return Limits((low, high), command, pressure_pa=DESIGN_PRESSURE * supply)


def simulate_experiment(
    entry: Entry,
    rig: Rig,
    values: dict[str, float],
    *,
    dt_s: float,
    limits: Limits,
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
    limits
        what the machine may not pass.
    """
    n = round(DESIGN_S / dt_s)
    # A fifth of the speed is left for what the rig file does not tell.
    fastest_m_s = (1.0 - 2.0 * DESIGN_MARGIN) * limits.speed_m_s
    limit_v = min(limits.command_v, fastest_m_s / velocity_gain(rig))
    low, high = limits.position_m
    shape = entry.shape(n, dt_s)
    command = entry.size * limit_v * (shape - shape.mean())
    # Path of a plant whose speed follows the command. It ends where it began.
    path = velocity_gain(rig) * dt_s * np.cumsum(command)
    room = (1.0 - 2.0 * DESIGN_MARGIN) * limits.span_m
    scale = min(1.0, room / max(float(np.ptp(path)), 1e-12))
    path = 0.5 * (low + high) + scale * (path - 0.5 * (path.max() + path.min()))
    controller = replace(suggested_controller(rig, DESIGN_HELD_HZ), limit_v=limit_v)
    try:
        run = simulate_closed_loop(rig, path, controller, dt_s=dt_s, values=values)
    except SimulationError:
        return None
    record = run.run.record
    position = record.column("position_m")
    # The other half of the margin is for errors of the candidate.
    edge = 0.5 * DESIGN_MARGIN * limits.span_m
    if position.min() < low + edge or position.max() > high - edge:
        return None
    if np.abs(record.column("velocity_m_s")).max() > fastest_m_s:
        return None
    if rig.plant == "ehs":
        chambers = np.stack([record.column(name) for name in CHAMBER_PRESSURES])
        if chambers.max() > limits.pressure_pa or chambers.min() < DESIGN_VACUUM_PA:
            return None
    size = scale * entry.size * limit_v / limits.command_v
    speed = 1e3 * velocity_gain(rig) * size * limits.command_v
    return Experiment(entry.description.format(speed=speed, size=100.0 * size), record)


# Steps of a fit on each entry of the menu. The best entries are then fitted to the end.
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
    limits: Limits | None = None,
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
    limits
        what the machine may not pass; by default what the rig file tells.
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
    limits = limits or limits_of(rig)
    if limits is None:
        return None
    make = partial(
        simulate_experiment,
        rig=rig,
        values=dict(candidates[0][1]),
        dt_s=dt_s,
        limits=limits,
    )
    experiments = [
        experiment
        for experiment in run_together([partial(make, entry) for entry in MENU])
        if experiment is not None
    ]
    # The gate refuses records without motion. Half of it is left for errors of the candidate.
    least_m = 2.0 * MOVES * floors[POSITION].value if POSITION in floors else 0.0
    moving = [each for each in experiments if np.std(each.record.column(POSITION)) >= least_m]
    experiments = moving or experiments
    if not experiments:
        return None
    best: tuple[Separation, Experiment, tuple[str, ...]] | None = None
    sensor_sets = _sensor_sets(rig, outputs, floors)
    done = [0.0, *np.linspace(FIRST_SENSORS, 1.0, len(sensor_sets))]
    for begin, end, sensor_floors in zip(done, done[1:], sensor_sets, strict=False):
        part = part_of(progress, begin, end)
        weakest, experiment = _most_powerful(rig, candidates, experiments, sensor_floors, part)
        if best is None or weakest.power > best[0].power + DESIGN_GAIN:
            best = weakest, experiment, tuple(sensor_floors)
        if best[0].power >= DESIGN_POWER:
            break
    assert best is not None
    weakest, best_experiment, measured = best
    coming = NextExperiment(
        separates=tuple("+".join(effects) or "no effect" for effects, _ in candidates),
        record=NEXT_EXPERIMENT,
        description=best_experiment.description,
        power=weakest.power,
        sensors=("command_v", *measured),
        nats=weakest.nats,
    )
    return coming, _experiment_record(best_experiment.record)


def _most_powerful(
    rig: Rig,
    candidates: Sequence[CandidateModel],
    experiments: Sequence[Experiment],
    floors: Mapping[str, float],
    progress: Progress | None,
) -> tuple[Separation, Experiment]:
    """Returns the experiment with the largest power, and its weakest separation.

    All experiments get short fits. Those with the largest separation then get whole fits, until one
    of them reaches DESIGN_POWER, or none can become the largest: a longer fit of a candidate leaves
    less of the errors that separate it.
    """
    weakest = partial(_weakest_separation, rig, list(candidates), floors=floors)
    screened = run_together(
        [partial(weakest, experiment, iterations=DESIGN_ITERATIONS) for experiment in experiments],
        part_of(progress, 0.0, SHORT_FITS),
    )
    # The largest separation comes first; equal ones stay in the order of the menu.
    order = sorted(range(len(experiments)), key=lambda i: screened[i].nats, reverse=True)
    found: list[tuple[Separation, Experiment]] = []
    for begin in range(0, min(len(experiments), DESIGN_FINALISTS), PARALLEL_FITS):
        ahead = max((final.nats for final, _ in found), default=-math.inf)
        if screened[order[begin]].nats <= ahead:
            break
        finalists = [experiments[i] for i in order[begin : begin + PARALLEL_FITS]]
        finals = run_together(
            [partial(weakest, experiment, iterations=LAST_ITERATIONS) for experiment in finalists]
        )
        found += zip(finals, finalists, strict=True)
        if max(final.power for final, _ in found) >= DESIGN_POWER:
            break
    return max(found, key=lambda scored: (scored[0].power, scored[0].nats))


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

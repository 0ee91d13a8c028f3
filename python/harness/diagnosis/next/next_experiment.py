# SPDX-License-Identifier: MIT
"""Design of the experiment that separates candidates where the records cannot.

The design is T-optimal: it chooses the record on which the outputs of the best candidate differ
most from those of every other candidate, after a new fit of that candidate (A. Atkinson,
V. Fedorov, Biometrika 62(1), 1975).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from ...base.parallel import Progress, part_of, run_together
from ...catalogue.channels import CHAMBER_PRESSURES, SUPPLY_PRESSURE
from ...catalogue.parameters import effects, plant_parameters
from ...catalogue.spellings import ParameterKey
from ...records import Record, make_record
from ...rigs import Rig
from ...signals.simulation import command_limit
from ...signals.simulation.run import noise_sigma
from ..data.floor import DESIGN_PRESSURE_NOISE, NoiseFloor
from ..model.fit import ITERATIONS
from ..model.separation import CandidateModel, Separation, separations
from ..schema import NEXT_EXPERIMENT, NextExperiment
from .menu import MENU, Experiment, simulate_experiment

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

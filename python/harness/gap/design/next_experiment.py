# SPDX-License-Identifier: MIT
"""Design of the experiment that tells rivals apart where the records cannot.

The design is T-optimal: it chooses the record on which the outputs of the best rival are farthest
from those of every other rival, after a new fit of that other rival (A. Atkinson, V. Fedorov,
Biometrika 62(1), 1975).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from ehsid.harness.catalogue.channels import CHAMBER_PRESSURES, SUPPLY_PRESSURE
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.catalogue.parameters import effects, plant_parameters
from ehsid.harness.gap.data.floor import NoiseFloor
from ehsid.harness.gap.design.menu import MENU, Candidate, candidate
from ehsid.harness.gap.model.separation import CandidateModel, Separation, separations
from ehsid.harness.gap.schema import NextExperiment
from ehsid.harness.gap.thresholds import (
    DESIGN_FINALISTS,
    DESIGN_GAIN,
    DESIGN_ITERATIONS,
    DESIGN_POWER,
    DESIGN_PRESSURE_NOISE,
    ITERATIONS,
)
from ehsid.harness.parallel import run_tasks
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig
from ehsid.harness.simulation import command_limit
from ehsid.harness.simulation.outputs import noise_sigma

# Number of finalists that are fitted in parallel. The result depends on this number; therefore it
# does not depend on the number of cores.
AT_ONCE = 2
# Sensors that can be added, in this order of preference.
MORE_SENSORS = (CHAMBER_PRESSURES, (SUPPLY_PRESSURE,))


def _least(
    rig: Rig,
    rivals: Sequence[CandidateModel],
    one: Candidate,
    *,
    floors: Mapping[str, float],
    iterations: int,
) -> Separation:
    """Returns the separation of the rival with the smallest power on the record of a candidate."""
    found = separations(rig, rivals, one.record, floors, iterations=iterations)
    return min(found, key=lambda each: each.power)


def next_experiment(
    rig: Rig,
    rivals: Sequence[CandidateModel],
    outputs: Sequence[str],
    floors: Mapping[str, NoiseFloor],
    *,
    dt_s: float = 1e-3,
    command_limit_v: float | None = None,
    span_m: tuple[float, float] | None = None,
) -> NextExperiment | None:
    """Designs a record that separates the best rival from all others.

    The design is the excitation of the menu, inside the limits of stroke, command and pressure,
    that has the largest power against the rival that is hardest to separate. Sensors that the
    records did not have are requested only if the power stays below DESIGN_POWER without them. A
    low power is reported as it is.

    Parameters
    ----------
    rig
        the machine.
    rivals
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

    Returns
    -------
    The experiment; None if there are fewer than two rivals, a limit is not known, or no entry of
    the menu stays inside the limits.
    """
    if len(rivals) < 2:
        return None
    rivals = [(effects, runnable(values)) for effects, values in rivals]
    limit_v = command_limit(rig) if command_limit_v is None else command_limit_v
    if span_m is None:
        span_m = 0.0, rig.values.get("cylinder.stroke_m", np.inf)
    if not (np.isfinite(limit_v) and np.isfinite(span_m).all()):
        return None
    make = partial(
        candidate, rig=rig, values=dict(rivals[0][1]), dt_s=dt_s, limit_v=limit_v, span_m=span_m
    )
    made = [found for found in run_tasks([partial(make, one) for one in MENU]) if found is not None]
    if not made:
        return None
    best: tuple[float, Candidate, tuple[str, ...]] | None = None
    for chosen in _sensor_sets(rig, outputs, floors):
        power, one = _most_powerful(rig, rivals, made, chosen)
        if best is None or power > best[0] + DESIGN_GAIN:
            best = power, one, tuple(chosen)
        if best[0] >= DESIGN_POWER:
            break
    assert best is not None
    power, winner, measured = best
    return NextExperiment(
        separates=tuple("+".join(effects) or "no effect" for effects, _ in rivals),
        record=_to_send(winner.record),
        description=winner.description,
        power=power,
        sensors=("command_v", *measured),
    )


def _most_powerful(
    rig: Rig,
    rivals: Sequence[CandidateModel],
    made: Sequence[Candidate],
    floors: Mapping[str, float],
) -> tuple[float, Candidate]:
    """Returns the largest power and its candidate.

    All candidates get short fits. Those with the largest separation then get whole fits, until one
    of them reaches DESIGN_POWER.
    """
    least = partial(_least, rig, list(rivals), floors=floors)
    screened = run_tasks([partial(least, one, iterations=DESIGN_ITERATIONS) for one in made])
    # The largest separation comes first; equal ones stay in the order of the menu.
    order = sorted(range(len(made)), key=lambda i: screened[i].nats, reverse=True)
    found: list[tuple[float, Candidate]] = []
    for begin in range(0, min(len(made), DESIGN_FINALISTS), AT_ONCE):
        finalists = [made[i] for i in order[begin : begin + AT_ONCE]]
        finals = run_tasks([partial(least, one, iterations=ITERATIONS) for one in finalists])
        found += [(one.power, entry) for one, entry in zip(finals, finalists, strict=True)]
        if max(power for power, _ in found) >= DESIGN_POWER:
            break
    return max(found, key=lambda one: one[0])


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
    guess = DESIGN_PRESSURE_NOISE * rig.values["supply.pressure_pa"]
    for more in MORE_SENSORS:
        missing = [name for name in more if name not in sets[-1]]
        if missing:
            told = {name: noise_sigma(rig, name) or guess for name in missing}
            sets.append({**sets[-1], **told})
    return sets


def _to_send(record: Record) -> Record:
    assert record.time_s is not None
    names = ("command_v", "position_m")
    columns = {"time_s": record.time_s, **{name: record.column(name) for name in names}}
    return make_record(columns, name="next_experiment")

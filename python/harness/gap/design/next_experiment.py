# SPDX-License-Identifier: MIT
"""The experiment that tells rivals apart which the records at hand cannot.

T-optimal design: the record on which the best rival's outputs are farthest from those of every
other rival after that one has been fitted anew (A. Atkinson, V. Fedorov, Biometrika 62(1), 1975).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from ehsid.harness.gap.data.floor import NoiseFloor
from ehsid.harness.gap.design.menu import MENU, Candidate, candidate
from ehsid.harness.gap.model.separation import Rival, Separation, separations
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
from ehsid.harness.rigs.parameters import EFFECT_PREFIX, plant_parameters
from ehsid.harness.simulation import command_limit
from ehsid.harness.simulation.outputs import NOISE_OF

# Entries of the menu that are looked at closely side by side; the answer hangs on it, the number of
# cores does not.
AT_ONCE = 2
# Sensors that can be added, in this order.
MORE_SENSORS = (("pressure_a_pa", "pressure_b_pa"), ("supply_pressure_pa",))


def _least(
    rig: Rig,
    rivals: Sequence[Rival],
    one: Candidate,
    *,
    floors: Mapping[str, float],
    iterations: int,
) -> Separation:
    """Of the rival that is hardest to set apart."""
    found = separations(rig, rivals, one.record, floors, iterations=iterations)
    return min(found, key=lambda each: each.power)


def next_experiment(
    rig: Rig,
    rivals: Sequence[Rival],
    outputs: Sequence[str],
    floors: Mapping[str, NoiseFloor],
    *,
    dt_s: float = 1e-3,
    command_limit_v: float | None = None,
    span_m: tuple[float, float] | None = None,
) -> NextExperiment | None:
    """Design a record that sets the best rival apart from all others.

    Among the excitations of the menu, inside stroke, command and pressure limits, the one with the
    largest power against the hardest rival. Sensors that the records did not have are asked for
    only where without them the power stays below DESIGN_POWER. A low power is given as it is.

    Parameters
    ----------
    rig
        the machine.
    rivals
        effects and values of the plant by full name, the best first; values that are not there
        are those of the rig.
    outputs
        that the records had.
    floors
        of those outputs.
    dt_s
        sampling time of the experiment.
    command_limit_v
        by default rated command; needed where the rig names none.
    span_m
        least and largest position; by default the stroke, needed where there is none.

    Returns
    -------
    None where there are no two rivals, or no entry of the menu stays inside the limits.
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
    rig: Rig, rivals: Sequence[Rival], made: Sequence[Candidate], floors: Mapping[str, float]
) -> tuple[float, Candidate]:
    """All of them with short fits, the farthest then with whole ones, until one is good enough."""
    least = partial(_least, rig, list(rivals), floors=floors)
    screened = run_tasks([partial(least, one, iterations=DESIGN_ITERATIONS) for one in made])
    # The farthest first; those as far as each other stay in the order of the menu.
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
    """Values as the simulator takes them: a fit ends at a bound, give or take a rounding."""
    inside = {
        name: min(max(value, plant_parameters()[name].minimum), plant_parameters()[name].maximum)
        if value != 0.0
        else value
        for name, value in values.items()
    }
    static, coulomb = (
        f"{EFFECT_PREFIX}stribeck_friction.{name}_n" for name in ("static", "coulomb")
    )
    if static in inside and coulomb in inside:
        inside[static] = max(inside[static], inside[coulomb])
    return inside


def _sensor_sets(
    rig: Rig, outputs: Sequence[str], floors: Mapping[str, NoiseFloor]
) -> list[dict[str, float]]:
    """Floors by output: as measured, and with more sensors."""
    known = {name: floors[name].value for name in outputs}
    sets = [known]
    if rig.plant != "ehs":
        return sets
    guess = DESIGN_PRESSURE_NOISE * rig.values["supply.pressure_pa"]
    for more in MORE_SENSORS:
        missing = [name for name in more if name not in sets[-1]]
        if missing:
            told = {name: rig.sensors.get(NOISE_OF[name], 0.0) or guess for name in missing}
            sets.append({**sets[-1], **told})
    return sets


def _to_send(record: Record) -> Record:
    assert record.time_s is not None
    names = ("command_v", "position_m")
    columns = {"time_s": record.time_s, **{name: record.column(name) for name in names}}
    return make_record(columns, name="next_experiment")

# SPDX-License-Identifier: MIT
"""The signal that shows an effect best: from the menu of experiments, inside the limits of a rig.

Each signal is simulated on the rig, with the noise of its sensors, and `search.visible` tells from
which size on its record would show the effect. The least size wins. Where several signals show
every size that is no part of a sound servo, the one with the most left over does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..base.parallel import Progress, part_of, run_together, single_threaded_algebra
from ..catalogue.channels import CHAMBER_PRESSURES, POSITION
from ..catalogue.parameters import acts_on, effects
from ..records import Record, make_record
from ..rigs import Rig
from ..signals.excitation.menu import MENU, Entry
from ..signals.simulation import draw_noise
from ..signals.simulation.run import OUTPUTS, noise_sigma
from .data.floor import DESIGN_PRESSURE_NOISE, NOISE_OF_STROKE
from .model.case import make_case
from .model.scale import effect_starts
from .next_experiment import limits_of, simulate_experiment
from .schema import CouldBeSeen
from .search.identifiability import unmeasured_effects
from .search.visible import beyond, ground_of, smallest

# Share of the time in which the signals are simulated; the refits take the rest.
SIMULATING = 0.3
SEED = 11


@dataclass(frozen=True, eq=False)
class Shown:
    """A signal, and the size from which on its record would show the effect."""

    description: str
    """One line for the operator."""
    record: Record
    """Time, command and the position that the rig predicts."""
    seen: CouldBeSeen
    beyond: float
    """How far the record is above what suffices at this size; it orders signals of one size."""


def signals_for(
    rig: Rig,
    effect: str,
    *,
    dt_s: float = 1e-3,
    pressures: bool = False,
    progress: Progress | None = None,
) -> list[Shown]:
    """Returns the signals that the rig can follow, the one that shows the effect best first.

    Parameters
    ----------
    rig
        the machine, as its rig file tells it; a plant of ehsid with its limits.
    effect
        id of an effect that the plant can have and the rig file does not have.
    dt_s
        sampling time, s.
    pressures
        whether the chamber pressures will be logged besides the position.
    progress
        called with the share of the work that is done, 0 to 1.

    Raises
    ------
    ValueError
        the plant cannot have the effect, the rig has it, or it lacks its limits; what is logged
        cannot show it; or none of the signals stays inside the limits of the machine.
    """
    if pressures and rig.plant != "ehs":
        raise ValueError(
            f"--pressures: a plant '{rig.plant}' has no chambers; leave the option out"
        )
    _check(rig, effect)
    names = [POSITION, *(CHAMBER_PRESSURES if pressures else ())]
    for missing in unmeasured_effects(names, [effect]):
        advice = "; log the chamber pressures, and add --pressures" if rig.plant == "ehs" else ""
        raise ValueError(f"--for {effect}: {missing.why}{advice}")
    make = partial(_record, rig, names, dt_s)
    with single_threaded_algebra():
        made = run_together(
            [partial(make, one) for one in MENU], part_of(progress, 0.0, SIMULATING)
        )
        inside = [one for one in made if one is not None]
        if not inside:
            raise ValueError(
                f"{rig.name}: each signal would leave the limits of stroke, command and pressure: "
                "check the stroke and the supply pressure in the rig file"
            )
        tasks = [partial(_shown, rig, effect, *one) for one in inside]
        shown = run_together(tasks, part_of(progress, SIMULATING, 1.0))
    return sorted(shown, key=_order)


def _check(rig: Rig, effect: str) -> None:
    if rig.simulator is not None or not acts_on(effects()[effect], rig.plant):
        raise ValueError(f"--for {effect}: a plant '{rig.plant}' of {rig.name} has no such effect")
    if effect in rig.effects():
        raise ValueError(
            f"--for {effect}: the rig file has it already: leave its section [effects.{effect}] out"
        )
    if not effect_starts(effect, rig):
        raise ValueError(
            f"--for {effect}: any record shows it by itself; take any motion, no signal is needed"
        )
    if limits_of(rig) is None:
        raise ValueError(
            f"{rig.name}: expected a rated command and a stroke, inside which a signal can stay"
        )


def _record(
    rig: Rig, names: Sequence[str], dt_s: float, entry: Entry
) -> tuple[str, Record, Record] | None:
    """Description, the record with noise, and the one to be sent; None outside of the limits."""
    limits = limits_of(rig)
    assert limits is not None  # `_check`
    found = simulate_experiment(entry, rig, {}, dt_s=dt_s, limits=limits)
    if found is None:
        return None
    clean = found.record
    noise = draw_noise(rig, len(clean), np.random.default_rng(SEED))
    assert clean.time_s is not None
    columns = {"time_s": clean.time_s, "command_v": clean.column("command_v")}
    columns[POSITION] = clean.column(POSITION)
    measured = dict(columns)
    for name in names:
        own = noise[:, OUTPUTS.index(name)]
        if noise_sigma(rig, name) == 0.0:
            usual = (
                NOISE_OF_STROKE * limits.span_m
                if name == POSITION
                else DESIGN_PRESSURE_NOISE * rig.values["supply.pressure_pa"]
            )
            own = usual * np.random.default_rng([SEED, len(name)]).standard_normal(len(clean))
        measured[name] = clean.column(name) + own
    return found.description, make_record(measured, name="excite"), make_record(columns)


def _shown(rig: Rig, effect: str, description: str, measured: Record, sent: Record) -> Shown:
    ground = ground_of(make_case(rig, [measured]))
    seen = smallest(ground, effect)
    sizes = dict(seen.sizes)
    return Shown(description, sent, seen, beyond(ground, effect, sizes))


def _order(one: Shown) -> tuple[float, float]:
    power = {p.name: p.power for p in effects()[one.seen.id].parameters}[one.seen.parameter]
    size = math.inf if one.seen.limit == "none" else math.copysign(one.seen.size, power)
    return size, -one.beyond

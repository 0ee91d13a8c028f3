# SPDX-License-Identifier: MIT
"""The edit test: does the twin without a named effect agree with the machine after a change?

A set of causes that compensate each other can follow the records that it was fitted to. It does not
follow a machine of which one cause was taken away. That is the test of a name which no record of
the unchanged machine can give.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq, minimize_scalar
from scipy.stats import chi2

from ...base.numbers import FloatArray
from ...base.parallel import Progress, single_threaded_algebra
from ...catalogue.parameters import plain_name
from ...records import Record
from ..data.gate import gate, usable_part
from ..data.regimes import visited
from ..deciding import NEAR_FLOOR
from ..decision.effect_selection import percent
from ..model.differences import SimulatorEngine
from ..schema import Estimate
from ..search.identifiability import unidentifiable_effects
from .twin import MOST_SHARE, Comparison, Shares, Simulated, Twin

# A twin agrees where its gap is at most so many times that on its own held-out record: another
# motion of the same machine, without a cause that hid others, shows more of what the twin lacks.
AGREES = 3.0
# Difference of the evidence at the ends of an interval of 90 % of one value, nats (Wilks, Ann.
# Math. Stat. 9(1), 1938); less of it decides nothing.
ENDS = 0.5 * float(chi2.ppf(0.9, 1))
# An interval of a share that is wider tells nothing of use.
WIDEST = 0.6
STEPS = 20
ACCURACY = 2e-3

Outcome = Literal["it_was", "mostly", "not_it", "another_change", "cannot_tell"]


@dataclass(frozen=True)
class TestedEdit:
    """A twin with a share of some of its effects left, on the new records."""

    effects: tuple[str, ...]
    """Ids of the effects that were edited."""
    share: tuple[float, ...]
    """Of the size of each that is left in this edit; 0 is removed."""
    gap: float
    """What it leaves, nrmse, mean of the outputs."""
    per_output: Mapping[str, float]
    agrees: bool
    """Whether that is as little as the twin left before the change, or near the noise floor."""
    left: Estimate
    """Share of the sizes that the records show to be left, one for all of these effects, 0 to 2,
    with its interval of 90 %."""
    gap_at_left: float
    """What the twin leaves with this share, nrmse."""
    gain: float
    """Evidence for this share above the twin as found, nats."""
    shown: bool
    """Whether the records distinguish shares of the effects from none to all, with an interval that
    is narrow enough to be of use."""
    why: str
    """What the records lack of what would show them; "" where nothing is missing."""


@dataclass(frozen=True)
class EditTest:
    """Result of the edit test."""

    outcome: Outcome
    sentence: str
    """The outcome in words."""
    machine: str
    origin: str
    """The diagnosis."""
    records: tuple[str, ...]
    """Names of the records after the change."""
    outputs: tuple[str, ...]
    """What is compared."""
    own_gap: float
    """Gap of the twin on the held-out record of its diagnosis, nrmse."""
    noise_floor: float
    """Of the new records, nrmse."""
    found: float
    """Gap of the twin as found on the new records, nrmse."""
    found_per_output: Mapping[str, float]
    edits: tuple[TestedEdit, ...]
    told: int
    """Number of the edit that the sentence is about."""
    notes: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class EditRun:
    """A record after the change beside the twin as found and edited; arrays of shape (N,)."""

    record: str
    time_s: FloatArray
    window: npt.NDArray[np.int64]
    """Number of the simulation window, -1 where a sample is not compared."""
    measured: Mapping[str, FloatArray]
    found: Mapping[str, FloatArray]
    edited: Mapping[str, FloatArray]
    left: Mapping[str, FloatArray]
    """Signals by output: of the twin as found, with the edit of the sentence, and with the share
    that this record shows to be left."""


def edit_test(
    twin: Twin,
    records: Sequence[Record],
    edits: Sequence[Shares],
    *,
    engine: SimulatorEngine | None = None,
    progress: Progress | None = None,
) -> tuple[EditTest, tuple[EditRun, ...]]:
    """Compares edited twins with records that were taken after the machine was changed.

    Nothing is fitted but the one share that is told as `left`.

    Parameters
    ----------
    twin
        the diagnosis before the change.
    records
        at least one; of a record with gaps the longest stretch is used.
    edits
        each the share that is left by id of a named effect, 0 to 2; at least one.
    engine
        runs of the simulator of the rig, where that is not ours.
    progress
        called with the share of the work that is done.

    Raises
    ------
    ValueError
        a record cannot carry the test; the message says why.
    """
    remarks = gate(records, twin.rig)
    for remark in remarks:
        if remark.serious:
            raise ValueError(f"record '{remark.record}': {remark.what}")
    used = [usable_part(record, twin.rig)[0] for record in records]
    with single_threaded_algebra():
        comparison = Comparison(twin, used, engine)
        found = comparison.simulate({})
        floor = comparison.floor(found)
        limit = max(NEAR_FLOOR * floor, AGREES * twin.own_gap)
        tested = []
        simulated = []
        for number, edit in enumerate(edits):
            one, edited, best = _tested(comparison, used, edit, found, limit)
            tested.append(one)
            simulated.append((found, edited, best))
            if progress is not None:
                progress((number + 1) / len(edits))
    # Of edits that explain the records alike, the one that changes least.
    most = max(one.gain for one in tested) - ENDS
    alike = [number for number, one in enumerate(tested) if one.gain >= most]
    told = min(alike, key=lambda number: (len(tested[number].effects), -tested[number].gain))
    outcome, sentence = _decided(twin, tested, tested[told], found, limit)
    result = EditTest(
        outcome,
        sentence,
        twin.rig.name,
        twin.origin,
        tuple(record.name for record in records),
        comparison.outputs,
        twin.own_gap,
        floor,
        found.gap,
        found.per_output,
        tuple(tested),
        told,
        (
            *_notes(twin, comparison, tested, tested[told]),
            *(f"{remark.record}: {remark.what}." for remark in remarks if remark.record),
        ),
    )
    runs = tuple(
        EditRun(
            one.record.name,
            one.dt_s * np.arange(one.window.size, dtype=np.float64),
            one.window,
            {name: one.outputs[name] for name in comparison.outputs},
            *(
                {name: run.outputs[index][name] for name in comparison.outputs}
                for run in simulated[told]
            ),
        )
        for index, one in enumerate(comparison.compared)
    )
    return result, runs


def _tested(
    comparison: Comparison, records: Sequence[Record], edit: Shares, found: Simulated, limit: float
) -> tuple[TestedEdit, Simulated, Simulated]:
    names = tuple(edit)
    twin = comparison.twin

    def nats(share: float) -> float:
        return comparison.simulate(dict.fromkeys(names, share)).nats

    left, span = profile(nats)
    run = comparison.simulate(edit)
    best = comparison.simulate(dict.fromkeys(names, left.value))
    regimes = [visited(record, twin.rig) for record in records]
    lacks = unidentifiable_effects(regimes, names, twin.rig.plant)
    one = TestedEdit(
        names,
        tuple(edit.values()),
        run.gap,
        run.per_output,
        run.gap <= limit,
        widened(left, twin.relative_error(names)),
        best.gap,
        found.nats - best.nats,
        span > ENDS and left.high - left.low < WIDEST,
        "; ".join(dict.fromkeys(each.why for each in lacks)),
    )
    return one, run, best


def profile(nats: Callable[[float], float]) -> tuple[Estimate, float]:
    """Returns the share with the least evidence against it, its 90 % interval, and the span.

    The interval has all shares around the best one against which there is less than ENDS more. Its
    ends are 0 and MOST_SHARE where it does not end before. The span is by how much the evidence
    differs over the shares from 0 to 1.

    Parameters
    ----------
    nats
        evidence against a share, 0 to MOST_SHARE; infinite where the simulation diverges.
    """
    grid = [MOST_SHARE * number / STEPS for number in range(STEPS + 1)]
    known = {share: nats(share) for share in grid}
    best = min(grid, key=lambda share: known[share])
    place = grid.index(best)
    bounds = grid[max(place - 1, 0)], grid[min(place + 1, STEPS)]
    inner = minimize_scalar(nats, bounds=bounds, method="bounded", options={"xatol": ACCURACY})
    least = known[best]
    if inner.fun < least:
        best, least = float(inner.x), float(inner.fun)

    def end(outwards: Sequence[float]) -> float:
        inside = best
        for share in outwards:
            if known[share] > least + ENDS:
                # Where the simulation diverges there is no root, and the interval ends before.
                if not math.isfinite(known[share]):
                    return inside
                over = brentq(lambda s: nats(s) - least - ENDS, inside, share, xtol=ACCURACY)
                return float(over)
            inside = share
        return inside

    low = end([share for share in reversed(grid) if share < best])
    high = end([share for share in grid if share > best])
    between = [known[share] for share in grid if share <= 1.0]
    return Estimate(best, low, high), max(between) - min(between)


def widened(share: Estimate, relative: float) -> Estimate:
    """Returns a share with the uncertainty of the size that it is a share of.

    relative: half of the interval of that size, as a share of it.
    """
    own = relative * share.value
    low = share.value - math.hypot(share.value - share.low, own)
    high = share.value + math.hypot(share.high - share.value, own)
    return Estimate(share.value, max(low, 0.0), min(high, MOST_SHARE))


def in_words(effects: Sequence[str]) -> str:
    """Returns the ids of effects as a list in words, each with its article."""
    words = [f"the {plain_name(effect)}" for effect in effects]
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]


def share_words(left: Estimate) -> str:
    """Returns a share with its interval: "3 % (0 to 8 %)"."""
    places = 1 if left.high - left.low < 0.02 else 0
    value, low, high = (f"{100.0 * end:.{places}f}" for end in (left.value, left.low, left.high))
    more = " or more" if left.high >= MOST_SHARE else ""
    return f"{value} % ({low} to {high} %{more})"


def _decided(
    twin: Twin, tested: Sequence[TestedEdit], told: TestedEdit, found: Simulated, limit: float
) -> tuple[Outcome, str]:
    """The outcome and its sentence.

    told: the edit that explains most. limit: the largest gap with which a twin agrees.
    """
    names, it = in_words(told.effects), "it" if len(told.effects) == 1 else "them"
    share, before = share_words(told.left), percent(found.gap)
    if not any(one.shown for one in tested):
        everything = in_words(list(dict.fromkeys(name for one in tested for name in one.effects)))
        why = next((f" ({one.why})" for one in tested if one.why), "")
        return "cannot_tell", (
            f"Nothing can be told: the new record hardly shows {everything}{why}. The twin leaves "
            f"{before} as found and {percent(told.gap)} edited; take a record that shows it."
        )
    if told.gain < ENDS and found.gap <= limit:
        needed = [one for one in tested if one.shown and len(one.effects) == 1] or [told]
        still = " and ".join(
            f"{share_words(one.left)} of {in_words(one.effects)}" for one in needed
        )
        return "not_it", (
            f"It was not {' and not '.join(in_words(one.effects) for one in needed)}: the record "
            f"after the change still needs {still}. The twin leaves {before} as found, and "
            f"{' or '.join(percent(one.gap) for one in needed)} edited."
        )
    own = f"{percent(twin.own_gap)} before the change" if twin.own_gap > 0.0 else "less before"
    explained = told.gain >= ENDS and told.shown
    if explained and (told.gap_at_left <= limit or told.gap_at_left < 0.5 * found.gap):
        agrees = told.gap_at_left <= limit
        all_gone = told.left.low == 0.0 and not any(told.share)
        sentence = f"It was {'' if agrees else 'mostly '}{names}: "
        if all_gone:
            sentence += (
                f"without {it} the twin leaves {percent(told.gap)} on the new record ({before} "
                f"with {it}); {share} of {it} is left."
            )
        else:
            sentence += (
                f"{share} of {it} is left. With that the twin leaves {percent(told.gap_at_left)} "
                f"on the new record, and {before} as found."
            )
        if not agrees:
            sentence += (
                f" It left {own}: {names} hid a further cause, or more was changed; diagnose the "
                "new record."
            )
        return "it_was" if agrees else "mostly", sentence
    return "another_change", (
        "The change was of another kind: no edit of what was named leaves less than "
        f"{percent(min(one.gap_at_left for one in tested))} on the new record, and the twin left "
        f"{own}; diagnose the new record."
    )


def _notes(
    twin: Twin, comparison: Comparison, tested: Sequence[TestedEdit], told: TestedEdit
) -> Iterator[str]:
    """What a reader of the sentence must know, one sentence each."""
    others = [set_of for set_of in twin.file.which.ambiguity_set if set(set_of) != set(twin.named)]
    if others:
        yield (
            f"The diagnosis could not tell {in_words(twin.named)} from "
            f"{', or '.join(map(in_words, others))}: without either the simulator is the same. "
            "What was changed on the machine says which of them it was."
        )
    for one in tested:
        if one is not told and one.shown and ENDS <= told.gain < one.gain + ENDS:
            yield f"Less of {in_words(one.effects)} explains the new record as well."
        if one.shown and one.why:
            yield f"The new record shows little of {in_words(one.effects)}: {one.why}."
    missing = [
        name
        for name in twin.file.provenance.settings.get("outputs", ())
        if name not in comparison.outputs
    ]
    if missing:
        yield (
            f"{', '.join(missing)}: compared in the diagnosis, but not in all of the new records, "
            "or hardly moving there."
        )

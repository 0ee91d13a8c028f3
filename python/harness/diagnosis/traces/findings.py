# SPDX-License-Identifier: MIT
"""The findings on records of which only simulated traces are at hand.

No value and no effect inside the machine can be tried. Where the error lies can be told, and
whether delay, lag, play of the sensor or another scale make up most of it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np

from ...base.parallel import Progress
from ...catalogue.channels import COMMAND
from ...catalogue.parameters import effects
from ...rigs import Rig
from ..data.floor import NoiseFloor, machine_floor, sensor_step
from ..data.gate import gate
from ..deciding import SIMULATOR_TOLERANCE
from ..model.comparison import BLOCK_S, Blocks, compare, varying_outputs
from ..result import Diagnosis, HeldOutRun, insufficient
from ..schema import (
    NOWHERE,
    SKIP_S,
    SUBSYSTEMS,
    WINDOW_S,
    Candidate,
    CannotJudge,
    Effect,
    Estimate,
    HowFar,
    Value,
    Verdict,
    Where,
)
from ..search.gap_reduction import gap_reduction, window_sums
from ..search.maps import maps
from .match import Matched
from .terms import POSITION, TERMS, TIMING, Sizes, TraceFit
from .words import NOT_FROM_TRACES, drift_of, reasons_of, sentence_of

# Share of the explainable gap of the position that terms must remove before they are named, and the
# gap that they may leave. In trials, right ones left 0.4 to 2.6 %, and the best wrong one, a lag in
# place of hysteresis, 4.8 %.
MOST, LEFT = 0.7, 1.5 * SIMULATOR_TOLERANCE
# Share that a term must add to a simpler set, and by which sets that explain alike may differ.
LEAST_PART, ALIKE = 0.1, 0.08
# What no trace is tried with, but looks the same in a position: seals that rub against the spring
# of the oil move the rod less, as play does. In trials, a third of friction looked like play.
LOOKS_LIKE = {"sensor_backlash": "coulomb_friction"}
# A term that removes less than this alone is in no larger set.
PROMISING = 0.02
# A scale or a late simulation that removes more than this is told.
HINT = 0.3
# Of the squared error, above which the steps of the sensor are worth a sentence.
LEAST_STEPS = 0.05
# The trace is as good as the noise allows where its error is this many times the floor.
OF_FLOOR = 1.5


@dataclass(frozen=True)
class TriedSet:
    """Terms that were fitted together to the position."""

    sizes: Sizes
    left: float
    """Gap of the position on held-out blocks, nrmse."""
    removed: float
    """Share of its explainable gap that the terms remove."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Ids of the effects among the terms."""
        return tuple(name for name in self.sizes if name in effects())


@dataclass(frozen=True, eq=False)
class TraceData:
    """Records with their traces, prepared to be compared."""

    matched: Sequence[Matched]
    outputs: tuple[str, ...]
    left_out: tuple[str, ...]
    floors: Mapping[str, NoiseFloor]

    def fit_of(self, blocks: Blocks) -> TraceFit:
        """Returns the comparison on these blocks of the records."""
        parts = [(compare(each.record, blocks=blocks), each.trace) for each in self.matched]
        return TraceFit(parts)

    @cached_property
    def fitted(self) -> TraceFit:
        """On the blocks that are fitted."""
        return self.fit_of("fit")

    @cached_property
    def held_out(self) -> TraceFit:
        """On the blocks that judge."""
        return self.fit_of("held out")

    def far(self, sizes: Sizes, outputs: Sequence[str] | None = None) -> HowFar:
        """Returns the gaps on held-out blocks without and with these terms; of all outputs."""
        compared = self.outputs if outputs is None else outputs
        records = [one for one, _ in self.held_out.parts]
        before, after = (
            window_sums(records, self.held_out.simulated(each), compared) for each in ({}, sizes)
        )
        return gap_reduction(before, before, after, self.floors)

    def errors(self, sizes: Sizes) -> dict[str, np.ndarray]:
        """Simulated minus measured on held-out blocks, by output."""
        made = self.held_out.simulated(sizes)
        return {
            name: np.concatenate(
                [
                    compared.inside(outputs[name] - compared.outputs[name])
                    for (compared, _), outputs in zip(self.held_out.parts, made, strict=True)
                ]
            )
            for name in self.outputs
        }

    def runs(self, sizes: Sizes) -> tuple[HeldOutRun, ...]:
        """Held-out blocks beside the trace as it is, and with these terms."""
        found = []
        plain, made = self.held_out.simulated({}), self.held_out.simulated(sizes)
        for (compared, _), before, after in zip(self.held_out.parts, plain, made, strict=True):
            record = compared.record
            assert record.time_s is not None
            measured = {name: compared.outputs[name] for name in self.outputs}
            found.append(
                HeldOutRun(
                    record.name,
                    record.time_s,
                    compared.window,
                    record.column(COMMAND),
                    measured,
                    *(
                        {name: each[name] for name in self.outputs}
                        for each in (before, before, after)
                    ),
                )
            )
        return tuple(found)

    def drifts(self) -> dict[str, tuple[float, float]]:
        """Mean distance of the positions, m, and its growth, m/s, by record."""
        return {
            each.record.name: drift_of(
                each.record.column(POSITION) - each.trace[POSITION], each.record.dt_s or 1.0
            )
            for each in self.matched
        }


def diagnose_traces(
    matched: Sequence[Matched],
    rig: Rig,
    *,
    exclude: Sequence[str] = (),
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnoses records from the traces that a simulation gave for their commands.

    Parameters
    ----------
    matched
        records with their traces, at least one.
    rig
        what is known of the machine: noise of its sensors, rated command. Its simulator is not run.
    exclude
        ids of effects that are not tried.
    progress
        called with the share of the work that is done, 0 to 1.
    """
    began = time.monotonic()
    records = [each.record for each in matched]
    remarks = [*gate(records, rig), *(remark for each in matched for remark in each.remarks)]
    reasons = [f"Record '{one.record}': {one.what.rstrip('.')}." for one in remarks if one.serious]
    data = None
    if not reasons:
        try:
            data = prepared(matched, rig)
        except ValueError as error:
            reasons = [f"{error}."]
    if data is None:
        return insufficient(
            rig,
            {record.name: "fit and held out" for record in records},
            remarks,
            reasons,
            _settings(exclude),
            time.monotonic() - began,
            of_traces=True,
        )
    tried = _tried(data, [name for name in TERMS if name not in exclude], progress)
    best, rivals = _chosen(tried)
    plain = data.far({})
    small = plain.nominal <= max(SIMULATOR_TOLERANCE, OF_FLOOR * plain.noise_floor[1])
    verdict: Verdict = "outside_catalogue"
    if small:
        verdict, best, rivals = "no_gap", None, []
    sets = [] if best is None else _sets([best, *rivals])
    if sets:
        verdict = "ambiguous" if len(sets) > 1 else "effects"
    sizes = {} if best is None else best.sizes
    far = data.far(sizes)
    decided = [] if best is None else [best, *rivals]
    named = () if best is None else _effects(data, best)
    step, step_share = _steps(data)
    return Diagnosis(
        verdict=verdict,
        sentence=sentence_of(verdict, [one.sizes for one in decided], far),
        reasons=reasons_of(sizes or _hint(tried), data.drifts(), step, step_share),
        where=NOWHERE if small else _where(data, rig, sets),
        effects=named,
        ambiguity_set=tuple(sets),
        candidates=_candidates(tried, best, rivals),
        cannot_judge=_cannot_judge({*exclude, *(name for one in sets for name in one)}),
        outside_probability=None,
        missing_laws=(),
        next_experiment=None,
        how_far=far,
        calibration={},
        remarks=tuple(remarks),
        runs=data.runs(sizes),
        rig=rig,
        augmented_rig=rig,
        outputs=data.outputs,
        outputs_left_out=data.left_out,
        records={record.name: "fit and held out" for record in records},
        settings=_settings(exclude),
        seconds=time.monotonic() - began,
        of_traces=True,
    )


def prepared(matched: Sequence[Matched], rig: Rig) -> TraceData:
    """Selects the outputs that are compared, and their noise floors.

    Raises
    ------
    ValueError
        no output that both have moves by more than its noise.
    """
    common = [name for name in matched[0].trace if all(name in one.trace for one in matched)]
    records = [one.record for one in matched]
    floors = {name: machine_floor(records, name, rig) for name in common}
    values = {name: floor.value for name, floor in floors.items()}
    moving = [set(varying_outputs(compare(one.record), values)) for one in matched]
    outputs = tuple(name for name in common if all(name in names for names in moving))
    if POSITION not in outputs:
        raise ValueError(
            "the position moves by no more than its noise: there is nothing to compare"
        )
    return TraceData(
        matched,
        outputs,
        tuple(name for name in common if name not in outputs),
        {name: floors[name] for name in outputs},
    )


def _tried(data: TraceData, terms: Sequence[str], progress: Progress | None) -> list[TriedSet]:
    """Fits each term alone, then those that promise something in sets of two and three."""

    def tried(ids: tuple[str, ...]) -> TriedSet:
        sizes = data.fitted.fitted(ids)
        far = data.far(sizes, (POSITION,))
        share = far.of_explainable
        removed = 0.0 if share is None else share.value
        return TriedSet(sizes, far.augmented, removed)

    alone = []
    for number, term in enumerate(terms):
        alone.append(tried((term,)))
        if progress is not None:
            progress(0.5 * (number + 1) / len(terms))
    promising = [name for one in alone if one.removed > PROMISING for name in one.sizes]
    sets = [
        ids
        for count in (2, 3)
        for ids in combinations(promising, count)
        if sum(name in TIMING for name in ids) <= 1
    ]
    together = []
    for number, ids in enumerate(sets):
        together.append(tried(ids))
        if progress is not None:
            progress(0.5 + 0.5 * (number + 1) / len(sets))
    return [*alone, *together]


def _chosen(tried: Sequence[TriedSet]) -> tuple[TriedSet | None, list[TriedSet]]:
    """The set that removes most of the gap, and others that do so alike.

    Each term must add its part to the set without it. Another scale or a late simulation alone name
    no cause: friction, other values and much else look like them. The pressures do not choose: in
    trials, values that were wrong in the simulator made them point to the wrong part.
    """
    allowed = [
        one
        for one in tried
        if one.effects and one.removed >= MOST and one.left <= LEFT and _earned(one, tried)
    ]
    if not allowed:
        return None, []
    most = max(one.removed for one in allowed)
    alike = [one for one in allowed if one.removed >= most - ALIKE]
    best, *rest = sorted(alike, key=lambda one: -one.removed)
    rivals: list[TriedSet] = []
    for one in rest:
        if one.effects not in [other.effects for other in (best, *rivals)]:
            rivals.append(one)
    return best, rivals


def _sets(decided: Sequence[TriedSet]) -> list[tuple[str, ...]]:
    """The sets of effects in question, with those that look the same in a position."""
    found = [one.effects for one in decided]
    for ids in list(found):
        alike = tuple(LOOKS_LIKE.get(name, name) for name in ids)
        if alike not in found:
            found.append(alike)
    return found


def _earned(one: TriedSet, tried: Sequence[TriedSet]) -> bool:
    smaller = [
        other
        for other in tried
        if len(other.sizes) == len(one.sizes) - 1 and other.sizes.keys() < one.sizes.keys()
    ]
    return all(one.removed - other.removed >= LEAST_PART for other in smaller)


def _hint(tried: Sequence[TriedSet]) -> Sizes:
    """What names no cause, but removes so much of the gap that it is worth a sentence."""
    best = max((one for one in tried if not one.effects), key=lambda one: one.removed, default=None)
    return {} if best is None or best.removed < HINT else best.sizes


def _effects(data: TraceData, best: TriedSet) -> tuple[Effect, ...]:
    """The effects of a set; their probability is not known, as no blind check has counted it."""
    sizes, without = {}, {}
    for name in best.effects:
        sizes[name] = Estimate(best.sizes[name], *data.fitted.interval(best.sizes, name))
        rest = {other: size for other, size in best.sizes.items() if other != name}
        without[name] = data.far(rest, (POSITION,)).augmented - best.left
    total = sum(max(part, 0.0) for part in without.values()) or 1.0
    return tuple(
        Effect(
            name,
            math.nan,
            {TERMS[name].parameter: Value.of(sizes[name])},
            max(without[name], 0.0) / total,
        )
        for name in best.effects
    )


def _where(data: TraceData, rig: Rig, named: Sequence[Sequence[str]]) -> Where:
    """The maps of the error of the trace; parts of the machine as far as effects are named."""
    records = [compared for compared, _ in data.held_out.parts]
    floors = {name: floor.value for name, floor in data.floors.items()}
    found = maps(records, data.errors({}), floors, rig)
    shares: dict[str, float] = dict.fromkeys(SUBSYSTEMS, 0.0) if named else {}
    for ids in named:
        for effect in ids:
            shares[effects()[effect].subsystem] += 1.0 / len(ids) / len(named)
    return Where(shares, found.regimes, found.frequency, found.time)


def _steps(data: TraceData) -> tuple[Estimate | None, float]:
    """The steps of the position sensor, and their share of the squared error of the position."""
    steps = [sensor_step(each.record.column(POSITION)) for each in data.matched]
    step = min(steps)
    error = float(np.mean(data.errors({})[POSITION] ** 2))
    share = step**2 / 12.0 / error if error > 0.0 else 0.0
    return (Estimate(step, step, step), min(share, 1.0)) if share > LEAST_STEPS else (None, 0.0)


def _candidates(
    tried: Sequence[TriedSet], best: TriedSet | None, rivals: Sequence[TriedSet]
) -> tuple[Candidate, ...]:
    """All sets with an effect, best first; their score is the gap that they leave."""
    first = [] if best is None else [best]
    rest = sorted((one for one in tried if one not in (*first, *rivals)), key=lambda one: one.left)
    found = []
    for one in (*first, *rivals, *rest):
        if not one.effects:
            continue
        found.append(
            Candidate(
                one.effects,
                math.nan,
                one.removed,
                {
                    f"effects.{name}.{TERMS[name].parameter}": one.sizes[name]
                    for name in one.effects
                },
                in_confidence_set=one is best or one in rivals,
                free=len(one.sizes),
                standing="named" if one is best else "equivalent" if one in rivals else "worse",
            )
        )
    return tuple(found)


def _cannot_judge(exclude: Collection[str]) -> tuple[CannotJudge, ...]:
    return tuple(
        CannotJudge(name, NOT_FROM_TRACES)
        for name in effects()
        if name not in TERMS and name != "sensor_quantisation" and name not in exclude
    )


def _settings(exclude: Sequence[str]) -> dict[str, object]:
    return {
        "compared_with": "traces",
        "window_s": WINDOW_S,
        "skip_s": SKIP_S,
        "effects_excluded": list(exclude),
        "held_out": f"every third block of {BLOCK_S:g} s",
    }

# SPDX-License-Identifier: MIT
"""The diagnosis: where the gap lies, which effects cause it, and how far they shrink it."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.gap.data.gate import gate, longest_stretch
from ehsid.harness.gap.data.regimes import Regimes, visited
from ehsid.harness.gap.design.next_experiment import next_experiment
from ehsid.harness.gap.inference import figures
from ehsid.harness.gap.inference.choice import Choice, choose
from ehsid.harness.gap.inference.judgeable import beyond_reach, cannot_judge
from ehsid.harness.gap.inference.quantised import QUANTISATION, position_step
from ehsid.harness.gap.inference.rivals import decisive, values_as_told
from ehsid.harness.gap.inference.search import Found, candidates, search
from ehsid.harness.gap.inference.verdict import Ruling, rule
from ehsid.harness.gap.inference.where import localise
from ehsid.harness.gap.model.case import Case, make_case
from ehsid.harness.gap.schema import (
    CalibratedValue,
    CannotJudge,
    Diagnosis,
    Estimate,
    FoundEffect,
    HeldOutRun,
    HowFar,
    NextExperiment,
    Remark,
    Where,
)
from ehsid.harness.gap.thresholds import (
    BLOCK_S,
    BOOTSTRAP_SEED,
    LEFT_AGAIN,
    LEFT_NRMSE,
    SKIP_S,
    SURE,
)
from ehsid.harness.parallel import Progress
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig

TOGETHER = (
    "The records that are held out excite what the others do not: fitted apart from them nothing "
    "explains the gap. All were fitted together, and every third block of each was held out."
)


def diagnose(
    records: Sequence[Record],
    rig: Rig,
    *,
    validate: Sequence[Record] = (),
    exclude: Sequence[str] = (),
    progress: Progress | None = None,
) -> Diagnosis:
    """Diagnoses where the gap of rig and records lies, what causes it, and how far it shrinks.

    Parameters
    ----------
    records
        records to fit, each with `command_v` and `position_m`; of a record with gaps the longest
        stretch is used.
    rig
        configuration of the simulator.
    validate
        held-out records, by which candidates are judged. They are fitted only where the others
        leave much of the gap; then, as without them, blocks of all records are held out.
    exclude
        ids of effects that are not searched for.
    progress
        called with the share that is done, 0 to 1.

    Returns
    -------
    The findings, whatever the quality of the data: data that cannot carry a diagnosis give the
    verdict "insufficient_data" with the reason.

    Raises
    ------
    ValueError
        there is no record.
    """
    began = time.monotonic()
    if not records:
        raise ValueError("the diagnosis needs a record")
    remarks = gate([*records, *validate], rig)
    fitted = [longest_stretch(record) for record in records]
    held_out = [longest_stretch(record) for record in validate]
    reasons = [remark.what for remark in remarks if remark.serious]
    case = None
    if not reasons:
        try:
            case = make_case(rig, fitted, held_out)
        except ValueError as error:
            reasons = [f"{error}."]
    if case is None:
        return _insufficient(rig, records, validate, remarks, reasons, exclude, began)
    asked = candidates(rig, exclude)
    regimes = [visited(record, rig) for record in case.records]
    judged = _judge(case, regimes, exclude, _part(progress, 0.0, 0.6 if validate else 0.9))
    if validate and _much_is_left(judged):
        # The other records cannot show an effect that only the held-out records excite.
        # Therefore all records are fitted together.
        together = make_case(rig, [*fitted, *held_out])
        again = _judge(together, regimes, exclude, _part(progress, 0.6, 0.9))
        if again.ruling.verdict != "outside_catalogue" and not _much_is_left(again):
            judged = again
            remarks = (*remarks, Remark("", TOGETHER))
    case, found, choice, ruling = judged.case, judged.found, judged.choice, judged.ruling
    best, values = choice.best, judged.values
    causes = figures.found_effects(case, found, choice, values, judged.far)
    seen = _seen(judged.step, causes)
    effects = (*causes, *seen)
    augmented = {name: one.value for name, one in values.items()}
    if judged.step is not None:
        augmented[ParameterKey.of_effect(QUANTISATION, "step_m")] = judged.step.value
    structural = ruling.verdict in ("effects", "ambiguous", "outside_catalogue")
    where = Where()
    if ruling.verdict == "effects" and not causes:
        where = Where(subsystem={"sensor": 1.0})
    elif structural:
        shares = {one.id: one.share_of_shrinkage for one in causes}
        where = localise(decisive(case), found.calibrated, best, shares=shares or None)
    experiment = _next(case, choice, progress)
    if progress is not None:
        progress(1.0)
    return Diagnosis(
        verdict=ruling.verdict,
        sentence=ruling.sentence,
        reasons=ruling.reasons,
        where=where,
        effects=effects,
        ambiguity_set=_sets(choice, seen),
        candidates=figures.listed(case, found, choice),
        cannot_judge=(*cannot_judge(regimes, asked, rig.plant), *judged.beyond),
        next_experiment=experiment,
        how_far=judged.far,
        calibration=judged.calibration,
        remarks=tuple(remarks),
        runs=judged.runs,
        rig=rig,
        augmented_rig=rig.with_values(augmented),
        outputs=case.outputs,
        outputs_left_out=case.left_out,
        records=_roles(records, validate),
        settings=_settings(case, exclude),
        seconds=time.monotonic() - began,
    )


def _seen(step: Estimate | None, causes: Sequence[FoundEffect]) -> tuple[FoundEffect, ...]:
    """Returns the effect that the record itself shows (quantisation); it shrinks no gap."""
    if step is None:
        return ()
    share = 0.0 if causes else 1.0
    return (FoundEffect(QUANTISATION, SURE, {"step_m": step}, share),)


def _sets(choice: Choice, seen: Sequence[FoundEffect]) -> tuple[tuple[str, ...], ...]:
    always = tuple(one.id for one in seen)
    sets = (choice.best, *choice.equals)
    return tuple((*one.effects, *always) for one in sets if one.effects or always)


@dataclass(frozen=True, eq=False)
class _Judged:
    """All results for one division of the data into fitted and held-out parts."""

    case: Case
    found: Found
    choice: Choice
    runs: tuple[HeldOutRun, ...]
    far: HowFar
    values: Mapping[str, Estimate]
    calibration: Mapping[str, CalibratedValue]
    beyond: Sequence[CannotJudge]
    step: Estimate | None
    ruling: Ruling


def _much_is_left(judged: _Judged) -> bool:
    far = judged.far
    left = far.augmented - far.noise_floor[1]
    share = left / max(far.calibrated - far.noise_floor[1], 1e-300)
    return judged.ruling.verdict == "outside_catalogue" or (
        far.augmented > LEFT_NRMSE and share > LEFT_AGAIN
    )


def _judge(
    case: Case, regimes: Sequence[Regimes], exclude: Sequence[str], progress: Progress | None
) -> _Judged:
    found = search(case, exclude, progress)
    choice = choose(case, found)
    best = choice.best
    runs, far = figures.held_out_figures(case, found.nominal, found.calibrated, best)
    values, moved = figures.estimates(case, best)
    calibration = figures.calibration_of(case, values, moved)
    beyond = beyond_reach(best.values, regimes, best.effects)
    step = position_step(case, exclude)
    untouched = None if best.effects else values_as_told(case, found.calibrated)
    ruling = rule(case, found, choice, far, calibration, beyond, untouched, step)
    return _Judged(case, found, choice, runs, far, values, calibration, beyond, step, ruling)


def _part(progress: Progress | None, begin: float, end: float) -> Progress | None:
    if progress is None:
        return None
    return lambda share: progress(begin + share * (end - begin))


def _next(case: Case, choice: Choice, progress: Progress | None) -> NextExperiment | None:
    """Designs an experiment for sets that the data cannot tell apart; None if there are none."""
    if not choice.equals:
        return None
    rivals = [(one.effects, one.values) for one in (choice.best, *choice.equals[:2])]
    span = None
    limit = None
    if "cylinder.stroke_m" not in case.rig.values:
        positions = [record.column("position_m") for record in case.records]
        span = float(min(p.min() for p in positions)), float(max(p.max() for p in positions))
        limit = max(float(np.abs(record.column("command_v")).max()) for record in case.records)
    return next_experiment(
        case.rig, rivals, case.outputs, case.floors, command_limit_v=limit, span_m=span
    )


def _roles(records: Sequence[Record], validate: Sequence[Record]) -> dict[str, str]:
    if not validate:
        return {record.name: "fit and held out" for record in records}
    roles = {record.name: "fit" for record in records}
    return roles | {record.name: "held out" for record in validate}


def _settings(case: Case, exclude: Sequence[str]) -> dict[str, object]:
    return {
        "window_s": case.window_s,
        "skip_s": SKIP_S,
        "reset": "estimate" if case.all_states else "carry",
        "outputs": list(case.outputs),
        "outputs_left_out": list(case.left_out),
        "effects_excluded": list(exclude),
        "substeps": decisive(case).substeps,
        "held_out": f"every third block of {BLOCK_S:g} s" if case.blocks else "records",
        "seed": BOOTSTRAP_SEED,
    }


def _insufficient(
    rig: Rig,
    records: Sequence[Record],
    validate: Sequence[Record],
    remarks: Sequence[Remark],
    reasons: Sequence[str],
    exclude: Sequence[str],
    began: float,
) -> Diagnosis:
    return Diagnosis(
        verdict="insufficient_data",
        sentence=f"These data cannot carry a diagnosis: {reasons[0]}",
        reasons=tuple(reasons),
        where=Where(),
        effects=(),
        ambiguity_set=(),
        candidates=(),
        cannot_judge=(),
        next_experiment=None,
        how_far=None,
        calibration={},
        remarks=tuple(remarks),
        runs=(),
        rig=rig,
        augmented_rig=rig,
        outputs=(),
        outputs_left_out=(),
        records=_roles(records, validate),
        settings={"effects_excluded": list(exclude)},
        seconds=time.monotonic() - began,
    )

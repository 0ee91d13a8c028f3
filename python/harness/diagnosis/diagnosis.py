# SPDX-License-Identifier: MIT
"""The diagnosis: where the gap lies, which effects cause it, and how much of it they remove."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

from msgspec.structs import replace as replace_part

from ..base.error_words import error_words
from ..base.parallel import Progress, single_threaded_algebra
from ..catalogue.channels import TIME
from ..catalogue.spellings import ParameterKey
from ..records import Record
from ..rigs import Rig
from ..rigs.rig import table_subsystem, table_words
from .data.gate import gate, usable_part
from .data.regimes import BOOTSTRAP_SEED, Regimes, visited
from .deciding import FIT_TOGETHER, NEAR_GAP, WORSE_HELD_OUT, WORSENED
from .decision import results
from .decision.effect_selection import Selection, percent, select_effects
from .decision.hypotheses import SHOWN, posterior
from .decision.inside import Inside, evidence_of
from .decision.verdict import Decision, decide
from .job import LOGGER, Begun, Pace, Watch, look_for
from .laws.choosing import SPRINGS, LawsFound, missing_laws, shows_linkage
from .laws.drifting import Drift, values_that_drift
from .laws.fitting import equation_shares
from .laws.forms import sentence
from .laws.wandering import what_wanders
from .limits import Limits
from .model.case import Case, make_case
from .model.comparison import BLOCK_S
from .model.differences import SimulatorEngine
from .model.unlogged import BETWEEN
from .next_experiment import limits_of, next_experiment
from .options import DEFAULTS, DiagnosisOptions
from .result import Diagnosis, HeldOutRun, Stage, UnknownInput, Wandering, insufficient
from .schema import (
    NOWHERE,
    SKIP_S,
    Calibrated,
    CannotJudge,
    CouldBeSeen,
    Effect,
    Estimate,
    HowFar,
    NextExperiment,
    Remark,
    Value,
    Verdict,
    Where,
)
from .search.candidates import FittedCandidate, decision_case
from .search.identifiability import (
    effects_hardly_shown,
    unidentifiable_effects,
    unmeasured_effects,
)
from .search.maps import QUANTISATION, localise, position_step
from .search.refit import (
    contradicted,
    fitted_again,
    fitted_to_all,
    fitted_together,
    with_slower_spools,
    with_unlogged_commands,
)
from .search.score import left
from .search.search import Look, SearchResult, candidate_effects, search
from .search.visible import could_be_seen, ground_of
from .user_simulator import (
    check_direction,
    engine_of,
    forecast,
    not_carried,
    outside_of_simulator,
    simulator_remarks,
    values_that_moved,
)

FITTED_TOGETHER = (
    "The records that are held out may excite what the others do not: fitted apart from them, "
    "nothing explains the gap. All were fitted together, and every third block of each was held "
    "out."
)
VALUES_OF_ALL = (
    "The records that are held out may excite what the others do not: the values of the others "
    "explain them less well. All were fitted together, and every third block of each was held out."
)

OUTSIDE: Verdict = "outside_catalogue"

NOT_TOLD = "Where the gap lies could not be told: its computation failed on these numbers."


def diagnose(
    records: Sequence[Record],
    rig: Rig,
    *,
    validate: Sequence[Record] = (),
    options: DiagnosisOptions = DEFAULTS,
    progress: Progress | None = None,
    watch: Watch | None = None,
    begun: Begun | None = None,
    note: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Diagnoses where the gap of rig and records lies, what causes it, and how much it shrinks.

    Parameters
    ----------
    records
        records to fit, each with `command_v` and `position_m`; of a record with gaps the longest
        stretch is used, without spans in which the supply is down.
    rig
        configuration of the simulator.
    validate
        held-out records, on which candidates are compared. They are fitted only where they are
        explained clearly less than the others; then, as without them, blocks of all records are
        held out.
    options
        what the user chose, see `DiagnosisOptions`.
    progress
        called with the share of the expected time that is over, 0 to 1.
    watch
        called when a stage begins, with what is known then.
    begun
        called when a stage begins, with the stage.
    note
        called with how long the runs of a user's simulator will take.

    Returns
    -------
    The diagnosis, whatever the quality of the data: data that cannot carry a diagnosis give the
    verdict "insufficient_data" with the reason.

    Raises
    ------
    ValueError
        there is no record.
    """
    if not records:
        raise ValueError("the diagnosis needs a record")
    with single_threaded_algebra(), engine_of(rig) as engine:
        return _diagnose(
            records, rig, validate, options, progress, watch, begun, engine, note or LOGGER.info
        )


def _diagnose(
    records: Sequence[Record],
    rig: Rig,
    validate: Sequence[Record],
    options: DiagnosisOptions,
    progress: Progress | None,
    watch: Watch | None,
    begun: Begun | None,
    engine: SimulatorEngine | None,
    note: Callable[[str], None],
) -> Diagnosis:
    began = time.monotonic()
    pace = Pace(progress, may_be_joint=bool(validate))
    remarks = gate([*records, *validate], rig)
    reasons = [_of_record(remark) for remark in remarks if remark.serious]
    effort = options.effort or ("full" if engine is None else "screened")
    case = None
    if not reasons:
        fitted = [usable_part(record, rig)[0] for record in records]
        held_out = [usable_part(record, rig)[0] for record in validate]
        try:
            case = make_case(rig, fitted, held_out, engine, effort)
        except ValueError as error:
            if error_words(error) is None:
                raise
            reasons = [f"{error}."]
    if case is not None and case.engine is not None:
        against = check_direction(case)
        if against is None:
            note(forecast(case))
        else:
            case, reasons = None, [f"{against[0].upper()}{against[1:]}."]
    if case is None:
        return insufficient(
            rig,
            _roles(records, validate),
            remarks,
            reasons,
            {"effects_excluded": list(options.exclude)},
            time.monotonic() - began,
        )
    unmeasured = unmeasured_effects(case.outputs, candidate_effects(rig, options.exclude))
    effect_ids = candidate_effects(rig, options.exclude, case.outputs)
    regimes = [visited(record, rig) for record in case.records]
    _log_case(case)
    look = look_for(watch, begun, pace, case)
    evaluation = _evaluate(case, regimes, options, pace, look)
    shown = _shown_by_held_out(evaluation) if validate else None
    if shown is not None:
        joint_case = replace(
            make_case(rig, [*fitted, *held_out], engine=engine, effort=effort),
            unlogged=evaluation.case.unlogged,
            held=evaluation.case.held,
        )
        look = look_for(watch, begun, pace, joint_case)
        found, remark = None, FITTED_TOGETHER
        if shown == "values":  # the sets are known
            found = fitted_together(evaluation.case, joint_case, evaluation.search_result)
            remark = VALUES_OF_ALL
        evaluation = _evaluate(joint_case, regimes, options, pace, look, found)
        remarks = (*remarks, Remark("", remark))
    evaluation = _with_missing_laws(evaluation, regimes, effect_ids, pace, look)
    case, search_result, laws = evaluation.case, evaluation.search_result, evaluation.laws
    selection, decision = evaluation.selection, evaluation.decision
    best, values = selection.best, evaluation.values
    fitted_effects = results.selected_effects(
        case, search_result, selection, values, 1.0 if laws is None else laws.of_effects
    )
    quantisation = _quantisation_effect(evaluation.step, fitted_effects)
    effects = (*fitted_effects, *quantisation)
    ambiguity_set = _ambiguity_set(selection, fitted_effects, quantisation)
    augmented = {name: estimate.value for name, estimate in values.items()}
    if evaluation.step is not None:
        augmented[ParameterKey.of_effect(QUANTISATION, "step_m")] = evaluation.step.value
    structural = decision.verdict in ("effects", "ambiguous", "outside_catalogue")
    where = NOWHERE
    unknown_inputs: tuple[UnknownInput, ...] = ()
    if decision.verdict == "effects" and not fitted_effects:
        where = replace_part(NOWHERE, subsystem={"sensor": 1.0})
    elif structural:
        told = best if laws is None else laws.candidate
        look = look_for(watch, begun, pace, case)
        _tell(look, "where", search_result, told, tasks=len(selection.rivals))
        where, unknown_inputs = _located(evaluation, fitted_effects, pace)
    seen: tuple[CouldBeSeen, ...] = ()
    if case.engine is None:
        told = best if laws is None else laws.candidate
        named = {name for names in ambiguity_set for name in names}
        others = [effect for effect in effect_ids if effect not in named]
        seen = could_be_seen(ground_of(case, told), others)
    experiment, next_record = None, None
    if selection.rivals and case.engine is None:
        _tell(look_for(watch, begun, pace, case), "experiment", search_result, best)
        designed = _design_experiment(case, selection, options.limits, pace.within)
        experiment, next_record = designed or (None, None)
    if progress is not None:
        progress(1.0)
    return Diagnosis(
        verdict=decision.verdict,
        sentence=decision.sentence,
        reasons=decision.reasons,
        where=where,
        effects=effects,
        ambiguity_set=ambiguity_set,
        candidates=results.ranked_candidates(case, search_result, selection),
        cannot_judge=(
            *not_carried(rig),
            *unmeasured,
            *(
                each
                for each in unidentifiable_effects(regimes, effect_ids, rig.plant)
                if each.id not in {name for names in ambiguity_set for name in names}
            ),
        ),
        outside_probability=selection.posterior.outside,
        missing_laws=() if laws is None else laws.laws,
        next_experiment=experiment,
        how_far=evaluation.reduction,
        calibration=evaluation.calibration,
        remarks=(
            *remarks,
            *_moving_command(case, evaluation.calibration),
            *simulator_remarks(
                evaluation.case,
                evaluation.decision.verdict,
                evaluation.inside,
                selection.posterior.share,
            ),
        ),
        runs=evaluation.runs,
        rig=rig,
        augmented_rig=_augmented(rig, augmented, laws),
        outputs=case.outputs,
        outputs_left_out=case.left_out,
        records=_roles(records, validate),
        settings=_settings(case, options),
        seconds=time.monotonic() - began,
        unknown_inputs=unknown_inputs,
        wandering=evaluation.told_wandering,
        could_be_seen=seen,
        law_forms=() if laws is None else laws.forms,
        next_record=next_record,
        in_sigmas={
            parameter.name: results.in_sigmas(parameter, values[parameter.name])
            for parameter in case.parameters()
        },
    )


def _moving_command(case: Case, calibration: Mapping[str, Calibrated]) -> tuple[Remark, ...]:
    """Says where the controller is faster than the log, and what that costs."""
    if not case.commands_are_missing:
        return ()
    share = calibration[BETWEEN].found.value
    return (
        Remark(
            "",
            f"Between two samples the command moves by {percent(share)} of the way to the next "
            "one, so that the controller is faster than the log. What it sent in between counts "
            "as unknown, and small causes do not show: log every command of the controller",
        ),
    )


def _located(
    evaluation: _Evaluation, effects: Sequence[Effect], pace: Pace
) -> tuple[Where, tuple[UnknownInput, ...]]:
    """Tells where the gap lies; where that cannot be computed, the verdict stands without it."""
    case, found, laws = evaluation.case, evaluation.search_result, evaluation.laws
    selection = evaluation.selection
    best = selection.best
    missing = [
        (table_subsystem(each.law.adds_to, each.law.of), each.share_of_shrinkage)
        for each in (() if laws is None else laws.laws)
    ]
    shares = {effect.id: effect.share_of_shrinkage for effect in effects}
    wandering = evaluation.told_wandering
    try:
        if wandering is not None:
            removed = max(left(case, found.calibrated) - left(case, best), 0.0)
            of_wandering = wandering.gain / (wandering.gain + removed)
            missing = [(table_subsystem(wandering.adds_to, TIME), of_wandering)]
            shares = {name: (1.0 - of_wandering) * share for name, share in shares.items()}
        equations, unknown_inputs = (
            equation_shares(case, found.calibrated, pace.within)
            if case.engine is None
            else ((), ())
        )
        where = localise(
            decision_case(case),
            found.calibrated,
            best,
            equations=equations,
            shares=shares or None,
            laws=missing,
            others=[
                (other.effects, selection.probability(other) / selection.probability(best))
                for other in selection.equivalent
            ],
        )
    except (ValueError, ArithmeticError):
        LOGGER.info("where the gap lies could not be told", exc_info=True)
        return replace_part(NOWHERE, notes=(NOT_TOLD,)), ()
    if case.engine is not None and not best.effects:
        where = outside_of_simulator(case, found, where, evaluation.inside)
    return where, unknown_inputs


def _augmented(rig: Rig, values: Mapping[str, float], laws: LawsFound | None) -> Rig:
    """Returns the rig with these values and laws."""
    augmented = rig.with_values(values)
    if laws is None:
        return augmented
    return replace(augmented, tables={**rig.tables, **laws.candidate.tables()})


def _quantisation_effect(
    step: Estimate | None, fitted_effects: Sequence[Effect]
) -> tuple[Effect, ...]:
    """Returns the effect that the record itself shows (quantisation); it shrinks no gap."""
    if step is None:
        return ()
    share = 0.0 if fitted_effects else 1.0
    return (Effect(QUANTISATION, SHOWN, {"step_m": Value.of(step)}, share),)


def _ambiguity_set(
    selection: Selection, best: Sequence[Effect], quantisation: Sequence[Effect]
) -> tuple[tuple[str, ...], ...]:
    """The sets in question; the effects of the best one, which is first, in the given order."""
    quantisation_ids = tuple(candidate.id for candidate in quantisation)
    sets = [tuple(effect.id for effect in best)]
    sets += [candidate.effects for candidate in selection.equivalent]
    return tuple((*effects, *quantisation_ids) for effects in sets if effects or quantisation_ids)


@dataclass(frozen=True, eq=False)
class _Evaluation:
    """All results for one division of the data into fitted and held-out parts."""

    case: Case
    search_result: SearchResult
    selection: Selection
    runs: tuple[HeldOutRun, ...]
    reduction: HowFar
    values: Mapping[str, Estimate]
    calibration: Mapping[str, Calibrated]
    hardly_shown: Sequence[CannotJudge]
    step: Estimate | None
    laws: LawsFound | None = None
    inside: tuple[Inside, ...] = ()
    """Values of a user's simulator that could stand in for what it cannot be given."""
    drift: Drift | None = None
    """Values that change in the course of the records, beside the most probable set."""
    wandering: Wandering | None = None
    """What follows the time alone beside that set, where no value drifts."""

    @cached_property
    def decision(self) -> Decision:
        """The verdict."""
        # A law that is found explains more.
        return decide(
            self.case,
            self.search_result,
            self.selection,
            self.reduction,
            self.calibration,
            self.hardly_shown,
            self.step,
            missing="" if self.laws is None else sentence(self.laws.laws),
            changing=self._changing() if self.laws is None else "",
        )

    def _changing(self) -> str:
        """What changes with the time, in words."""
        if self.wandering is not None:
            words = table_words(self.wandering.adds_to, TIME)
            return f"The simulator lacks a term: {words}. It {self.wandering.looks_like}."
        return "" if self.drift is None else self.drift.sentence

    @property
    def told_wandering(self) -> Wandering | None:
        """What wanders, where it is what is told of the cause."""
        return self.wandering if self.laws is None and self.decision.verdict == OUTSIDE else None


def _log_case(case: Case) -> None:
    """Logs what is compared, and how much of it."""
    LOGGER.info(
        "records: %d, %.4g s in all, in windows of %g s; compared: %s%s",
        len(case.records),
        sum(len(record) * (record.dt_s or 0.0) for record in case.records),
        case.window_s,
        ", ".join(case.outputs),
        f"; left out: {', '.join(case.left_out)}" if case.left_out else "",
    )


def _tell(
    look: Look, stage: Stage, found: SearchResult, best: FittedCandidate, tasks: int = 0
) -> None:
    """Tells that a stage begins after the search; `tasks` as of `Look`."""
    look(stage, found.nominal, found.calibrated, [best, *found.fitted()], tasks=tasks)


def _shown_by_held_out(evaluation: _Evaluation) -> Literal["cause", "values"] | None:
    """What only the held-out records seem to show, so that all are fitted together."""
    fitted, held_out = (
        left(evaluation.case, evaluation.selection.best, part) for part in ("fitted", "held out")
    )
    if held_out - fitted <= WORSE_HELD_OUT:
        return None
    if evaluation.selection.posterior.outside >= FIT_TOGETHER:
        return "cause"
    # A run of a user's simulator takes long.
    return "values" if evaluation.case.engine is None else None


def _evaluate(
    case: Case,
    regimes: Sequence[Regimes],
    options: DiagnosisOptions,
    pace: Pace,
    look: Look,
    found: SearchResult | None = None,
) -> _Evaluation:
    """Weighs the sets of a search, which is made unless it is given."""
    search_result = found or search(case, options.exclude, pace.within, look)
    search_result = with_slower_spools(search_result.case, search_result)
    anew = contradicted(search_result) if found is None else None
    if anew is not None:
        search_result = search(anew, options.exclude, pace.within, look)
        search_result = with_slower_spools(anew, search_result)
    case = with_unlogged_commands(search_result)
    if any(case.unknown.values()):
        search_result = fitted_again(case, search_result)
    probabilities = posterior(
        case,
        search_result.calibrated,
        search_result.refined,
        fitted_to_all(case, search_result),
    )
    selection = select_effects(search_result, probabilities)
    inside: tuple[Inside, ...] = ()
    if case.engine is not None:
        inside = tuple(values_that_moved(case, selection.best))
        probabilities = probabilities.with_evidence(evidence_of(inside))
        selection = select_effects(search_result, probabilities, unnamed=bool(inside))
    best = selection.best
    runs, reduction = results.held_out_results(
        case, search_result.nominal, search_result.calibrated, best
    )
    first = probabilities.sets[0]
    drift = values_that_drift(case, first.fit)
    wandering = what_wanders(case, first.fit) if drift is None else None
    changes = drift is not None or wandering is not None
    speaking = bool(results.worse_outputs(reduction)) + changes
    agrees = reduction.nominal <= NEAR_GAP
    if agrees:
        probabilities = probabilities.with_agreement()
    if speaking:
        beside = first.effects if changes else ()
        probabilities = probabilities.with_evidence(speaking * WORSENED, beside)
    if agrees or speaking:
        selection = select_effects(search_result, probabilities, unnamed=bool(inside))
        if selection.best is not best:
            best = selection.best
            runs, reduction = results.held_out_results(
                case, search_result.nominal, search_result.calibrated, best
            )
    values, moved = results.estimates(case, best)
    calibration = results.calibration_of(case, values, moved)
    hardly_shown = effects_hardly_shown(best, regimes, case.rig.plant)
    step = position_step(case, options.exclude)
    return _Evaluation(
        case,
        search_result,
        selection,
        runs,
        reduction,
        values,
        calibration,
        hardly_shown,
        step,
        inside=inside,
        drift=drift,
        wandering=wandering,
    )


def _with_missing_laws(
    evaluation: _Evaluation,
    regimes: Sequence[Regimes],
    effect_ids: Sequence[str],
    pace: Pace,
    look: Look,
) -> _Evaluation:
    """Adds the laws of a cause outside of the catalogue, as far as they can be told.

    The set that is then named is that of the effects that the laws do not make needless. Where no
    set of effects is more probable than such a cause, and it is not excluded, a law that is found
    can decide; so it can beside a spring, which a law may take in. A linkage acts like nothing else
    and may hide behind any set.
    """
    case, search_result = evaluation.case, evaluation.search_result
    if case.engine is not None:  # a law needs the equations of the simulator
        return evaluation
    probabilities = evaluation.selection.posterior
    # Beside a cause outside, the most probable set may be too improbable to have a name. It may
    # still be a part of the cause.
    ahead = probabilities.sets[0].fit
    sets = [share for families, share in probabilities.by_families() if families]
    asked = max(sets, default=0.0) <= probabilities.outside or not set(SPRINGS).isdisjoint(
        ahead.effects
    )
    asked = asked and probabilities.outside >= FIT_TOGETHER
    if not asked and not shows_linkage(case, ahead):
        return evaluation
    _tell(look, "laws", search_result, ahead, tasks=2 if ahead.effects else 1)
    laws = missing_laws(
        case, search_result.calibrated, ahead, pace.within, effect_ids, evaluation.drift
    )
    if laws is None:
        return evaluation
    selection = select_effects(search_result, probabilities.with_laws(laws.hypotheses))
    if selection.answer.kind != "outside":
        return evaluation
    fitted = (search_result.calibrated, *search_result.refined)
    best = next(
        (each for each in fitted if set(each.effects) == set(laws.candidate.effects)),
        laws.candidate,
    )
    with_laws = laws.candidate
    runs, reduction = results.held_out_results(
        case, search_result.nominal, search_result.calibrated, with_laws
    )
    values, moved = results.estimates(case, with_laws)
    if laws.held:
        beside, _ = results.estimates(case, ahead)
        values |= {name: beside[name] for name in laws.held}
    return replace(
        evaluation,
        selection=replace(selection, best=best, equivalent=()),
        runs=runs,
        reduction=reduction,
        values=values,
        calibration=results.calibration_of(case, values, moved),
        hardly_shown=effects_hardly_shown(with_laws, regimes, case.rig.plant),
        laws=laws,
    )


def _design_experiment(
    case: Case, selection: Selection, limits: Limits | None, progress: Progress
) -> tuple[NextExperiment, Record] | None:
    """Designs an experiment for sets that the data cannot separate."""
    candidates = [
        (candidate.effects, candidate.values)
        for candidate in (selection.best, *selection.rivals[:2])
    ]
    return next_experiment(
        case.rig,
        candidates,
        case.outputs,
        case.floors,
        # What the records were logged with can be sent and logged again.
        dt_s=min(record.dt_s for record in case.records if record.dt_s is not None),
        limits=limits or limits_of(case.rig, case.records),
        progress=progress,
    )


def _roles(records: Sequence[Record], validate: Sequence[Record]) -> dict[str, str]:
    if not validate:
        return {record.name: "fit and held out" for record in records}
    roles = {record.name: "fit" for record in records}
    return roles | {record.name: "held out" for record in validate}


def _settings(case: Case, options: DiagnosisOptions) -> dict[str, object]:
    of_simulator: dict[str, object] = {}
    if case.engine is not None:
        of_simulator = {
            "windows": "caught and released",
            "simulator": case.engine.runs.section.what,
            "tolerance": case.engine.tolerance,
            "effort": case.effort,
        }
    return {
        "window_s": case.window_s,
        "skip_s": SKIP_S if case.engine is None else case.engine.first_catch_s,
        "reset": "estimate" if case.all_states else "carry",
        **of_simulator,
        "outputs": list(case.outputs),
        "outputs_left_out": list(case.left_out),
        "effects_excluded": list(options.exclude),
        "substeps": decision_case(case).substeps,
        "held_out": f"every third block of {BLOCK_S:g} s" if case.blocks else "records",
        "seed": BOOTSTRAP_SEED,
    }


def _of_record(remark: Remark) -> str:
    """Returns a remark with the name of its record, as a sentence."""
    what = f"{remark.what.rstrip('.')}."
    return f"Record '{remark.record}': {what}" if remark.record else what

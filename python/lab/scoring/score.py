# SPDX-License-Identifier: MIT
"""Score of a check: how far a diagnosis can be trusted, computed from the folder of the check."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import ehsid
from ehsid.harness.base.parallel import Progress, run_tasks

from ..blind.making import ANSWERS, RESULTS, SEAL, Answer, Seal, read_answers, read_seal
from .baselines import (
    Baseline,
    Control,
    Promises,
    baselines,
    controls,
    independent_samples,
    promises,
    transfer_of,
)
from .edits import EditFigures, edit_figures, edits_of
from .figures import (
    Figure,
    Reliability,
    RiskPoint,
    SizeError,
    claims_of,
    effect_errors,
    reliability,
    risk_curve,
    share,
)
from .findings import FAILED, Findings, read_findings
from .judging import ScoredCase, group_by, judge
from .tables import (
    Confusion,
    FigureTable,
    SplitTable,
    confusion_of_effects,
    confusion_of_verdicts,
    family_table,
    figure_tables,
    split_tables,
)
from .wrong import Regret, WrongCase, regret_of, wrong_cases


@dataclass(frozen=True)
class Contradiction:
    """A case whose diagnosis contradicts itself, and the rules that it breaks."""

    name: str
    rules: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class Results:
    """Results of a check, in its score and in the file of the score."""

    unfinished: tuple[str, ...]
    """Names of the cases without a result."""
    sealed: bool | None
    """Whether the answers are those of the seal; None without a seal."""
    tables: tuple[FigureTable, ...]
    """Figures with targets: for plain and hard cases together, then for each grade."""
    trust: tuple[Figure, ...]
    """For each verdict, the share of the cases with this verdict that are right."""
    splits: tuple[SplitTable, ...]
    """Main figures by grade, kind, size of the gap, excitation, sensors, plant, true effect."""
    verdicts: Confusion
    effects: Confusion
    """Confusion tables."""
    reliability: Reliability
    risk: tuple[RiskPoint, ...]
    """Calibration and risk-coverage curve of the probabilities."""
    sizes: tuple[SizeError, ...]
    """Errors of all estimated sizes."""
    regret: Regret
    """Held-out cost of the named effects against that of the fitted truth."""
    promises: tuple[Promises, ...]
    """Predicted shrinkage against the one on the third record."""
    baselines: tuple[Baseline, ...]
    controls: tuple[Control, ...]
    """What simpler methods and permuted answers score."""
    wrong: tuple[WrongCase, ...]
    """All cases that are not right, the worst first."""
    contradictions: tuple[Contradiction, ...]
    """Cases whose diagnosis contradicts itself, by name; there should be none."""
    edits: tuple[EditFigures, ...] = ()
    """The found rigs after the effects of their machines were removed, and after they were halved;
    none in a check that has no such records."""


@dataclass(frozen=True, kw_only=True)
class Score(Results):
    """Score of a check: its results, the finished cases by name, and the seal if it has one."""

    cases: tuple[ScoredCase, ...]
    seal: Seal | None


@dataclass(frozen=True)
class CaseSummary:
    """A finished case in `score.json`."""

    name: str
    kind: str
    grade: str
    sensors: str
    truth: tuple[str, ...]
    """What was made: name of the case, kind, grade, sensors, and true effects."""
    verdict: str
    named: tuple[str, ...]
    sets: tuple[tuple[str, ...], ...]
    """What the diagnosis returned: verdict, named effects, and ambiguity set."""
    outcome: str
    """Outcome by the rules of scoring."""
    gap_over_floor: float | None
    """Gap of the calibrated rig over the middle of its noise floor; None where it is not known."""
    seconds: float
    """Time that the diagnosis took, s."""


@dataclass(frozen=True, kw_only=True)
class ScoreFile(Results):
    """Content of `score.json`."""

    ehsid_version: str
    """Version of ehsid that scored the check."""
    records: int
    """Number of finished cases."""
    cases: tuple[CaseSummary, ...]
    """Finished cases, by name."""


def score_folder(out: Path, progress: Progress | None = None) -> Score:
    """Reads and scores a check; it writes nothing.

    Parameters
    ----------
    out
        folder of the check: `answers.json`, `results/NAME/diagnosis.json`, and, where they were
        kept, `cases`, `transfer` and `seal.json`.
    progress
        called with the share of the cases that is done.

    Raises
    ------
    ValueError
        answers or a result cannot be read; the message says which, and what is wrong.
    """
    answers = read_answers(out / ANSWERS)
    findings = {name: read_findings(out / RESULTS / name) for name in answers}
    tasks = [
        functools.partial(_scored, out, name, answers[name], finished)
        for name, finished in findings.items()
        if finished is not None
    ]
    results = run_tasks(tasks, progress) if tasks else []
    return score_cases(
        [case for case, _ in results],
        {case.name: samples for case, samples in results},
        [name for name, finished in findings.items() if finished is None],
        *_seal(out),
    )


def _scored(
    out: Path, name: str, answer: Answer, findings: Findings
) -> tuple[ScoredCase, float | None]:
    try:
        transfer = None if findings.verdict == FAILED else transfer_of(out, name, findings)
        edits = edits_of(out, name, findings)
    except ValueError as error:
        # Errors of records and rigs cannot return from another process; a plain ValueError can.
        raise ValueError(f"case {name}: {error}") from None
    case = ScoredCase(name, answer, findings, judge(answer, findings), transfer, edits)
    return case, independent_samples(out, name, findings)


def score_cases(
    cases: Sequence[ScoredCase],
    samples: Mapping[str, float | None] | None = None,
    unfinished: Sequence[str] = (),
    seal: Seal | None = None,
    sealed: bool | None = None,
) -> Score:
    """Scores cases in memory; `samples` has the form that `baselines.lowest_bic` takes."""
    verdicts = group_by(cases, lambda case: case.findings.verdict)
    return Score(
        unfinished=tuple(unfinished),
        sealed=sealed,
        tables=figure_tables(cases),
        trust=tuple(
            share(verdict, [case.judgement.right for case in group])
            for verdict, group in verdicts.items()
        ),
        splits=(*split_tables(cases), family_table(cases)),
        verdicts=confusion_of_verdicts(cases),
        effects=confusion_of_effects(cases),
        reliability=reliability([claim for case in cases for claim in claims_of(case)]),
        risk=risk_curve(cases),
        sizes=effect_errors(cases),
        regret=regret_of(cases),
        promises=promises(cases),
        baselines=baselines(cases, samples or {}),
        controls=controls(cases),
        wrong=wrong_cases(cases),
        contradictions=tuple(
            Contradiction(case.name, case.findings.contradictions)
            for case in sorted(cases, key=lambda case: case.name)
            if case.findings.contradictions
        ),
        edits=edit_figures(cases),
        cases=tuple(cases),
        seal=seal,
    )


def score_file(score: Score) -> ScoreFile:
    """Returns the content of `score.json`."""
    return ScoreFile(
        **{field.name: getattr(score, field.name) for field in fields(Results)},
        ehsid_version=ehsid.__version__,
        records=len(score.cases),
        cases=tuple(map(_summary, score.cases)),
    )


def _summary(case: ScoredCase) -> CaseSummary:
    answer, findings = case.answer, case.findings
    return CaseSummary(
        name=case.name,
        kind=answer.kind,
        grade=answer.grade,
        sensors=answer.sensors,
        truth=tuple(answer.effects),
        verdict=findings.verdict,
        named=tuple(effect.id for effect in findings.named),
        sets=findings.sets,
        outcome=case.judgement.outcome,
        gap_over_floor=findings.gap,
        seconds=findings.seconds,
    )


def _seal(out: Path) -> tuple[Seal | None, bool | None]:
    if not (out / SEAL).is_file():
        return None, None
    seal = read_seal(out)
    digest = hashlib.sha256((out / ANSWERS).read_bytes()).hexdigest()
    return seal, seal.answers_sha256 == digest

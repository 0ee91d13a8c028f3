# SPDX-License-Identifier: MIT
"""Score of a check: how far a diagnosis can be trusted, computed from the folder of the check."""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ehsid.harness.parallel import Progress, run_tasks
from ehsid.harness.validation.blind.seal import ANSWERS, RESULTS, SEAL, Seal, read_seal
from ehsid.harness.validation.scoring.baselines import Baseline, baselines
from ehsid.harness.validation.scoring.calibration import Reliability, claims_of, reliability
from ehsid.harness.validation.scoring.calibration_risk import RiskPoint, risk_curve
from ehsid.harness.validation.scoring.confusion import Confusion, of_effects, of_verdicts
from ehsid.harness.validation.scoring.control import Control, controls
from ehsid.harness.validation.scoring.figures import Figure, share
from ehsid.harness.validation.scoring.figures_sizes import SizeError, effect_errors
from ehsid.harness.validation.scoring.judged_case import Scored, by
from ehsid.harness.validation.scoring.reading import (
    FAILED,
    GRADES,
    Answer,
    Said,
    read_answers,
    read_said,
)
from ehsid.harness.validation.scoring.regret import Regret, regret_of
from ehsid.harness.validation.scoring.right import judge
from ehsid.harness.validation.scoring.splits import SplitTable, split_tables
from ehsid.harness.validation.scoring.table import FigureTable, figure_table
from ehsid.harness.validation.scoring.transfer import independent_samples, transfer_of
from ehsid.harness.validation.scoring.transfer_figures import Promises, promises
from ehsid.harness.validation.scoring.wrong import WrongCase, wrong_cases

# Grades whose records should allow one name; smooth and small records often allow only a set.
ASKED = ("plain", "hard")


@dataclass(frozen=True)
class Score:
    """Score of a check.

    Attributes
    ----------
    cases
        finished cases, by name.
    unfinished
        names of the cases without a result.
    seal
        seal of the check; None where it was not sealed.
    sealed
        whether the answers are those of the seal; None without a seal.
    tables
        figures with targets: for plain and hard cases together, then for each grade.
    trust
        for each verdict, the share of the cases with this verdict that are right.
    splits
        a few figures by grade, kind, size of the gap, excitation, sensors, plant, true effect.
    verdicts, effects
        confusion tables.
    reliability, risk
        calibration and risk-coverage curve of the probabilities.
    sizes
        errors of all estimated sizes.
    regret, promises, baselines, controls
        results of the modules `regret`, `transfer_figures`, `baselines` and `control`.
    wrong
        all cases that are not right.
    """

    cases: tuple[Scored, ...]
    unfinished: tuple[str, ...]
    seal: Seal | None
    sealed: bool | None
    tables: tuple[FigureTable, ...]
    trust: tuple[Figure, ...]
    splits: tuple[SplitTable, ...]
    verdicts: Confusion
    effects: Confusion
    reliability: Reliability
    risk: tuple[RiskPoint, ...]
    sizes: tuple[SizeError, ...]
    regret: Regret
    promises: tuple[Promises, ...]
    baselines: tuple[Baseline, ...]
    controls: tuple[Control, ...]
    wrong: tuple[WrongCase, ...]


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
    found = {name: read_said(out / RESULTS / name) for name in answers}
    said = {name: one for name, one in found.items() if one is not None}
    tasks = [
        functools.partial(_scored, out, name, answers[name], one) for name, one in said.items()
    ]
    results = run_tasks(tasks, progress) if tasks else []
    seal, sealed = _seal(out)
    cases = [case for case, _ in results]
    samples = {case.name: n for case, n in results}
    unfinished = [name for name in answers if name not in said]
    return score_cases(cases, samples, unfinished, seal, sealed)


def _scored(out: Path, name: str, answer: Answer, said: Said) -> tuple[Scored, float | None]:
    try:
        transfer = None if said.verdict == FAILED else transfer_of(out, name, said)
    except ValueError as error:
        # Errors of records and rigs cannot return from another process; a plain ValueError can.
        raise ValueError(f"case {name}: {error}") from None
    case = Scored(name, answer, said, judge(answer, said), transfer)
    return case, independent_samples(out, name, said)


def score_cases(
    cases: Sequence[Scored],
    samples: Mapping[str, float | None] | None = None,
    unfinished: Sequence[str] = (),
    seal: Seal | None = None,
    sealed: bool | None = None,
) -> Score:
    """Scores cases in memory; `samples` has the form that `baselines.lowest_bic` takes."""
    asked = [case for case in cases if case.answer.grade in ASKED]
    tables = [figure_table("plain and hard records", asked)]
    tables += [
        figure_table(f"{grade} records", [case for case in cases if case.answer.grade == grade])
        for grade in GRADES
        if any(case.answer.grade == grade for case in cases)
    ]
    return Score(
        cases=tuple(cases),
        unfinished=tuple(unfinished),
        seal=seal,
        sealed=sealed,
        tables=tuple(tables),
        trust=tuple(
            share(verdict, [case.judged.right for case in group])
            for verdict, group in by(cases, lambda case: case.said.verdict).items()
        ),
        splits=split_tables(cases),
        verdicts=of_verdicts(cases),
        effects=of_effects(cases),
        reliability=reliability(claims_of(cases)),
        risk=risk_curve(cases),
        sizes=effect_errors(cases),
        regret=regret_of(cases),
        promises=promises(cases),
        baselines=baselines(cases, dict(samples or {})),
        controls=controls(cases),
        wrong=wrong_cases(cases),
    )


def _seal(out: Path) -> tuple[Seal | None, bool | None]:
    if not (out / SEAL).is_file():
        return None, None
    seal = read_seal(out)
    found = hashlib.sha256((out / ANSWERS).read_bytes()).hexdigest()
    return seal, seal.answers_sha256 == found

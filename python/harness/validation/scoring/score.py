# SPDX-License-Identifier: MIT
"""Score of a check: what its folder says of how far a diagnosis can be trusted."""

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

# The grades on which one name is asked for; on smooth and small records it often is a set.
ASKED = ("plain", "hard")


@dataclass(frozen=True)
class Score:
    """Attributes
    ----------
    cases
        finished ones, by name.
    unfinished
        names of those without a result.
    seal
        how the check was made; None where it was not sealed.
    sealed
        the answers are those of the seal; None without one.
    tables
        figures against targets: plain and hard together, then each grade.
    trust
        by verdict: of the cases with this verdict, those that are right.
    splits
        few figures by kind, excitation, size of the gap, true effect, plant.
    verdicts, effects
        confusions.
    reliability, risk
        of the probabilities.
    sizes
        errors of sizes, one by one.
    regret, promises, baselines, controls
        as their modules tell.
    wrong
        every case that is not right.
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
    """Read and score a check; nothing is written.

    Parameters
    ----------
    out
        folder of the check: `answers.json`, `results/NAME/diagnosis.json`, and where they were
        kept `cases`, `transfer` and `seal.json`.
    progress
        called with the share that is done.

    Raises
    ------
    ValueError
        answers or a result that cannot be read: which, and what is wrong with it.
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
        # A plain one: errors of records and rigs do not come back from another process.
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
    """The same of cases at hand; samples: as `baselines.lowest_bic` takes them."""
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

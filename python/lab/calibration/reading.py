# SPDX-License-Identifier: MIT
"""Reads the finished cases of checks as machines for the calibration."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ehsid.harness.base.manifest import sha256_of
from ehsid.harness.base.parallel import Progress, run_tasks
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.diagnosis.search.quantised import QUANTISATION

from ..blind.answers import Answer, read_answers
from ..blind.seal import ANSWERS, RESULTS, SEAL, read_seal
from ..scoring.calibration import effect_errors
from ..scoring.judging import ScoredCase, judge
from ..scoring.reading import FAILED, read_findings
from ..scoring.transfer import promises, transfer_of
from .machines import MEASURES, Machine, Promised, Size, WeighedSet

# Digits of a number in the file of features: more are below the accuracy of the fits.
DIGITS = 5
# Why a case is left out.
NOT_FINISHED = "not finished"
NO_PROBABILITIES = "without probabilities"
INSUFFICIENT = "insufficient_data"


@dataclass(frozen=True)
class Found:
    """Machines of checks, and the number of cases that were left out, by reason."""

    machines: tuple[Machine, ...] = ()
    left_out: dict[str, int] = field(default_factory=dict)


def read_checks(folders: Sequence[Path], progress: Progress | None = None) -> Found:
    """Reads the finished cases of the folders of checks, and computes the realised shrinkage.

    Parameters
    ----------
    folders
        folders that `ehsid gap-check --out` made; a check that still runs may be one of them.
    progress
        called with the share of the cases that is done.

    Raises
    ------
    ValueError
        a folder holds no check, its answers were changed since they were sealed, or a file of it
        cannot be read.
    """
    tasks = [
        functools.partial(read_case, out, name, answer)
        for out in folders
        for name, answer in _sealed_answers(out).items()
    ]
    cases = run_tasks(tasks, progress) if tasks else []
    left_out: dict[str, int] = {}
    for case in cases:
        if isinstance(case, str):
            left_out[case] = left_out.get(case, 0) + 1
    return Found(tuple(case for case in cases if isinstance(case, Machine)), left_out)


def distinct(machines: Iterable[Machine]) -> list[Machine]:
    """Returns the machines in the order of their names, on which no result depends otherwise.

    Raises
    ------
    ValueError
        a machine occurs twice: it would be among those that are fitted and those that are tested.
    """
    ordered = sorted(machines, key=lambda machine: machine.name)
    for one, other in itertools.pairwise(ordered):
        if one.name == other.name:
            raise ValueError(
                f"machine {one.name}: given twice; expected each machine once: name each check and "
                "each file of features once, and no file beside the check that it was made from"
            )
    return ordered


def _sealed_answers(out: Path) -> dict[str, Answer]:
    seal = read_seal(out)
    answers = read_answers(out / ANSWERS)
    if sha256_of(out / ANSWERS) != seal.answers_sha256:
        raise ValueError(
            f"{out / ANSWERS}: differs from the digest in {SEAL}: expected the answers that were "
            "sealed; restore the file"
        )
    return answers


def read_case(out: Path, name: str, answer: Answer) -> Machine | str:
    """Returns the machine of a case, or the reason why the case is left out.

    Raises
    ------
    ValueError
        a file of the case cannot be read.
    """
    findings = read_findings(out / RESULTS / name)
    if findings is None:
        return NOT_FINISHED
    if findings.verdict in (FAILED, INSUFFICIENT):
        return findings.verdict
    sets = tuple(
        WeighedSet(each.effects, _rounded(each.left), _rounded(each.small))
        for each in findings.candidates
        if each.probability is not None and each.left is not None and each.small is not None
    )
    if not sets:
        return NO_PROBABILITIES
    try:
        transfer = transfer_of(out, name, findings)
    except ValueError as error:
        # Errors of records and rigs cannot return from another process; a plain ValueError can.
        raise ValueError(f"case {name}: {error}") from None
    case = ScoredCase(name, answer, findings, judge(answer, findings), transfer)
    return Machine(
        name=name,
        kind=answer.kind,
        grade=answer.grade,
        measured=case.measured,
        # The record itself decides on quantisation; sets of effects have no part in it.
        truth=tuple(effect for effect in answer.effects if effect != QUANTISATION),
        sets=sets,
        families={"excitation": "+".join(sorted(answer.excitation)), **answer.families},
        sizes=tuple(
            Size(error.of, error.parameter, _of(error.estimate), _rounded(error.true))
            for error in effect_errors([case])
            if error.of != QUANTISATION and _is_finite(error.estimate)
        ),
        promises=tuple(
            Promised(measure, _of(promise.predicted), _rounded(promise.realised.value))
            for measure, of in zip(MEASURES, promises([case]), strict=True)
            for promise in of.each
            if _is_finite(promise.predicted) and math.isfinite(promise.realised.value)
        ),
    )


def _is_finite(estimate: Estimate) -> bool:
    return all(map(math.isfinite, (estimate.value, estimate.low, estimate.high)))


def _of(estimate: Estimate) -> Estimate:
    return Estimate(_rounded(estimate.value), _rounded(estimate.low), _rounded(estimate.high))


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")

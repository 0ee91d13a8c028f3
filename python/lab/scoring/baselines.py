# SPDX-License-Identifier: MIT
"""What simpler methods and chance would score, from the same results and by the same rules.

Simpler methods choose among the candidates of the diagnosis. Chance is a negative control: answers
that are permuted among the cases must score no better.

Shrinkage that the augmented rig realises on the transfer record, which the diagnosis never saw.

The transfer record is the third one of the same machine, under another excitation. It is simulated
in the windows of the diagnosis with the rig as configured, with the augmented rig, and with the
augmented rig without its effects. The last one replaces the calibrated rig, which a diagnosis does
not write. Its values were fitted together with the effects, so its gap is, as a rule, larger than
that of a separate calibration, and `of_explainable` is too large. `from_nominal` does not need this
replacement. The realised shrinkage is then compared with the one predicted on held-out data.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import ehsid
from ehsid.harness.catalogue.channels import CHANNELS, POSITION, REQUIRED_COLUMNS
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.diagnosis.data.floor import sensor_floor
from ehsid.harness.diagnosis.model.comparison import compare
from ehsid.harness.diagnosis.model.problem import Problem
from ehsid.harness.diagnosis.schema import Candidate, Estimate
from ehsid.harness.diagnosis.search.candidates import DECISION_SUBSTEPS
from ehsid.harness.diagnosis.search.gap_reduction import gap_reduction, window_sums
from ehsid.harness.records import Record, read_record
from ehsid.harness.rigs import Rig, read_rig

from ..blind.making import CASES, RESULTS, TRANSFER, Answer
from .figures import Figure, quantile, share
from .findings import Findings, NamedEffect
from .judging import Judgement, ScoredCase, Transfer, group_by, judge

PERMUTATIONS = 10_000
SEED = 6

# What a method finds in a case; None where the file lacks the data that the method needs.
Method = Callable[[ScoredCase], Findings | None]
# Whether a diagnosis is right for an answer.
Test = Callable[[Answer, Findings], bool]


@dataclass(frozen=True)
class Baseline:
    """A method of diagnosis and its figures over the cases in which it could be applied."""

    name: str
    how: str
    figures: tuple[Figure, ...]


@dataclass(frozen=True)
class Control:
    """Result of a permutation test."""

    words: str
    """What is counted."""
    real: float
    """Share of the cases of the check that pass the test."""
    chance: float
    """Exact mean of this share over all permutations of the answers among cases with the same
    sensors."""
    mean: float
    low: float
    high: float
    """Mean of the share over the drawn permutations, and the limits that contain 90 % of them."""
    p_value: float
    """Share of the permutations, the real order among them, that do as well or better; never 0 (B.
    Phipson, G. Smyth, Stat. Appl. Genet. Mol. Biol. 9(1), 2010)."""
    deals: int
    """Number of drawn permutations."""


def refit_only(case: ScoredCase) -> Findings:
    """Blames the values in the rig file and never an effect."""
    return replace(case.findings, verdict="parameters", named=(), sets=(), subsystem={})


def best_fit(case: ScoredCase) -> Findings | None:
    """Names the set of effects with the lowest cost on the fitted records."""
    return _chosen(case, lambda candidate: candidate.fitted_cost)


def lowest_bic(samples: Mapping[str, float | None]) -> Method:
    """Method with the lowest BIC / 2 = cost + (k / 2) ln n (Schwarz, Ann. Statist. 6(2), 1978).

    `samples` has n by name of the case. The cost includes priors: those of the rig count alike for
    all sets, those of an effect's own sizes do not.
    """

    def method(case: ScoredCase) -> Findings | None:
        n = samples.get(case.name)

        def criterion(candidate: Candidate) -> float:
            if n is None or candidate.free is None:
                return math.nan
            return candidate.fitted_cost + 0.5 * candidate.free * math.log(n)

        return _chosen(case, criterion)

    return method


def largest_gain(case: ScoredCase) -> Findings | None:
    """Blames the subsystem of the equation in which terms of free form explain most."""
    if not case.findings.equations:
        return None
    subsystem, _ = max(case.findings.equations, key=lambda equation: equation[1])
    return Findings("outside_catalogue", subsystem={subsystem: 1.0}, gap=case.findings.gap)


def _chosen(case: ScoredCase, cost: Callable[[Candidate], float]) -> Findings | None:
    costs = [
        (value, candidate.effects)
        for candidate in case.findings.candidates
        if math.isfinite(value := cost(candidate))
    ]
    if not costs:
        return None
    _, best = min(costs, key=lambda pair: pair[0])
    if not best:
        return refit_only(case)
    known = effects().get(best[0])
    return replace(
        case.findings,
        verdict="effects",
        named=tuple(NamedEffect(effect, 1.0) for effect in best),
        sets=(),
        subsystem={known.subsystem: 1.0} if known else {},
    )


def baselines(
    cases: Sequence[ScoredCase], samples: Mapping[str, float | None]
) -> tuple[Baseline, ...]:
    """Returns all methods, judged by the same rules; `samples` is that of `lowest_bic`."""
    return (
        _judged("this diagnosis", "as it was run", lambda case: case.findings, cases),
        _judged("refit only", "values of the rig, never an effect", refit_only, cases),
        _judged("best fit in sample", "lowest cost on the fitted record", best_fit, cases),
        _judged(
            "BIC", "lowest cost + k/2 ln n, n = 20 a second and output", lowest_bic(samples), cases
        ),
        Baseline(
            "largest gain of an equation",
            "equation in which terms of free form explain most",
            (_subsystem_first(_applied(largest_gain, cases)),),
        ),
    )


def _applied(method: Method, cases: Sequence[ScoredCase]) -> list[tuple[ScoredCase, Judgement]]:
    return [
        (case, judge(case.answer, findings))
        for case in cases
        if (findings := method(case)) is not None
    ]


def _subsystem_first(applied: Sequence[tuple[ScoredCase, Judgement]]) -> Figure:
    return share("subsystem first", [j.subsystem_first for _, j in applied])


def _judged(name: str, how: str, method: Method, cases: Sequence[ScoredCase]) -> Baseline:
    applied = _applied(method, cases)
    return Baseline(
        name,
        how,
        (
            _subsystem_first(applied),
            share("effect first", [j.effect_first for case, j in applied if case.name_required]),
            share("exact set", [j.exact for _, j in applied]),
            share("confident wrong name", [j.wrong_name for _, j in applied]),
            share("effect where there is none", [j.false_effect for _, j in applied]),
            share("outside recognised", [j.recognised for _, j in applied]),
        ),
    )


def controls(cases: Sequence[ScoredCase]) -> tuple[Control, ...]:
    """Returns the controls of the whole diagnosis and of the first name.

    Returns none without cases, and none where a true effect was left out: the list of effects left
    out would then reveal the truth.
    """
    if not cases or any(case.left_out for case in cases):
        return ()
    return (
        control("verdict and effects right", cases, lambda a, f: judge(a, f).right),
        control("effect named first", cases, lambda a, f: judge(a, f).effect_first is True),
    )


def control(
    words: str,
    cases: Sequence[ScoredCase],
    test: Test,
    *,
    permutations: int = PERMUTATIONS,
    seed: int = SEED,
) -> Control:
    """Permutes the answers at random among cases with the same sensors.

    Everything else stays: the diagnoses, and how often each diagnosis and each truth occurs.
    """
    rng = np.random.default_rng(seed)
    real, chance, permuted = 0.0, 0.0, np.zeros(permutations)
    for group in group_by(cases, lambda case: case.answer.sensors).values():
        # 1 where the answer of the row's case suits the diagnosis of the column's case.
        right = np.array(
            [[test(a.answer, b.findings) for b in group] for a in group], dtype=np.float64
        )
        n = len(group)
        real += float(np.trace(right))
        chance += float(right.mean(axis=0).sum())
        columns = np.arange(n)
        permuted += np.array(
            [right[rng.permutation(n), columns].sum() for _ in range(permutations)]
        )
    as_good = int(np.count_nonzero(permuted >= real))
    low, high = np.quantile(permuted, [0.05, 0.95]) / len(cases)
    return Control(
        words,
        real / len(cases),
        chance / len(cases),
        float(permuted.mean()) / len(cases),
        float(low),
        float(high),
        (as_good + 1) / (permutations + 1),
        permutations,
    )


# Independent errors per second; the samples of a record at 1 kHz are not independent. The errors of
# a servo lie below the frequency of its oil spring. Their bandwidth is some 5 to 20 Hz after the
# mean of each window is subtracted.
INDEPENDENT_HZ = 20.0


@dataclass(frozen=True)
class Promise:
    """Shrinkage of one case as predicted and as realised, each with its interval."""

    case: str
    right: bool
    predicted: Estimate
    realised: Estimate


@dataclass(frozen=True)
class Promises:
    """Predicted and realised values of one measure of shrinkage."""

    words: str
    """Name of the measure."""
    each: tuple[Promise, ...]
    """Promises of the cases in which an effect was named."""
    figures: tuple[Figure, ...]
    """Shares of the cases whose realised value lies in the predicted interval, whose two intervals
    overlap, and whose realised value is at least the lower end of the predicted interval; then
    medians of the realised less the predicted value, of right cases and of the others."""


def realised(nominal: Rig, augmented: Rig, record: Record, findings: Findings) -> Transfer | None:
    """Simulates the transfer record; returns None where it has none of the compared outputs."""
    settings = findings.settings
    compared = compare(
        record,
        window_s=float(settings.get("window_s", 0.5)),
        all_states=settings.get("reset") == "estimate",
    )
    outputs = tuple(name for name in settings.get("outputs", ()) if name in compared.outputs)
    if not outputs:
        return None
    floors = {name: sensor_floor(record, name, nominal) for name in outputs}
    named = [effect.id for effect in findings.named]
    sums = []
    for rig in (nominal, without(augmented, nominal, named), augmented):
        substeps = ehsid.plant_substeps(rig.plant, rig.plant_values(), compared.dt_s)
        problem = Problem(
            rig,
            [compared],
            (),
            outputs=outputs,
            floors={name: floor.value for name, floor in floors.items()},
            substeps=max(DECISION_SUBSTEPS, substeps),
        )
        sums.append(window_sums([compared], problem.simulate(np.zeros(0)), outputs))
    before, calibrated, after = sums
    gaps = gap_reduction(before, calibrated, after, floors)
    return Transfer(
        gaps.from_nominal, gaps.of_explainable if named else None, gaps.nominal, gaps.augmented
    )


def without(augmented: Rig, nominal: Rig, effects: list[str]) -> Rig:
    """Returns the augmented rig with the effects set to their values in the rig file, or else 0."""
    off: Mapping[str, float] = {
        name: nominal.values.get(name, 0.0)
        for name in augmented.values
        if ParameterKey(name).effect in effects
    }
    return augmented.with_values(off) if off else augmented


def transfer_of(out: Path, name: str, findings: Findings) -> Transfer | None:
    """Computes the transfer of a case in the folder of a check; None where a file is missing."""
    record = out / TRANSFER / f"{name}.csv"
    augmented = out / RESULTS / name / "rig.augmented.toml"
    nominal = out / CASES / name / "rig.toml"
    if not (record.is_file() and augmented.is_file() and nominal.is_file()):
        return None
    rig = read_rig(nominal)
    required = (*REQUIRED_COLUMNS, POSITION)
    read = read_record(record, columns=list(CHANNELS), required=required, layout=rig.columns)
    return realised(rig, read_rig(augmented), read, findings)


def independent_samples(out: Path, name: str, findings: Findings) -> float | None:
    """Number of independent errors in the fitted record, as the cost of a fit counts them.

    n = INDEPENDENT_HZ T for each output, where T is the length of the record, s. Returns None where
    the record was not kept.
    """
    path = out / CASES / name / "train.csv"
    if not path.is_file():
        return None
    time_s = read_record(path, columns=REQUIRED_COLUMNS).time_s
    assert time_s is not None
    seconds = float(time_s[-1] - time_s[0])
    return INDEPENDENT_HZ * seconds * max(1, len(findings.settings.get("outputs", ())))


def promises(cases: Sequence[ScoredCase]) -> tuple[Promises, ...]:
    """Returns the promises of both measures of shrinkage."""
    return (
        _promises("shrinkage of the explainable gap", "of_explainable", cases),
        _promises("shrinkage from the simulator as configured", "from_nominal", cases),
    )


def _promises(words: str, measure: str, cases: Sequence[ScoredCase]) -> Promises:
    each = []
    for case in cases:
        predicted = getattr(case.findings, measure) if case.findings.named else None
        realised = getattr(case.transfer, measure, None)
        if predicted is not None and realised is not None:
            each.append(Promise(case.name, case.judgement.right, predicted, realised))

    def excess(right: bool) -> list[float]:
        return [p.realised.value - p.predicted.value for p in each if p.right == right]

    return Promises(
        words,
        tuple(each),
        (
            share(
                "realised inside the predicted interval",
                (p.predicted.low <= p.realised.value <= p.predicted.high for p in each),
            ),
            share(
                "intervals of both meet",
                (
                    p.predicted.low <= p.realised.high and p.realised.low <= p.predicted.high
                    for p in each
                ),
            ),
            share(
                "realised at least the lower end",
                (p.realised.value >= p.predicted.low for p in each),
            ),
            quantile("realised less predicted, median, answered right", excess(True)),
            quantile("realised less predicted, median, others", excess(False)),
        ),
    )

# SPDX-License-Identifier: MIT
"""Shrinkage that the augmented rig realises on the transfer record, which the diagnosis never saw.

The transfer record is the third one of the same machine, under another excitation. It is simulated
in the windows of the diagnosis with the rig as configured, with the augmented rig, and with the
augmented rig without its effects. The last one replaces the calibrated rig, which a diagnosis does
not write. Its values were fitted together with the effects, so its gap is, as a rule, larger than
that of a separate calibration, and `of_explainable` is too large. `from_nominal` does not need this
replacement. The realised shrinkage is then compared with the one predicted on held-out data.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

import ehsid
from ehsid.harness.catalogue.channels import CHANNELS, POSITION, REQUIRED_COLUMNS
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.diagnosis.data.sensor_floor import sensor_floor
from ehsid.harness.diagnosis.model.comparison import compare
from ehsid.harness.diagnosis.model.problem import Problem
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.diagnosis.search.candidates import DECISION_SUBSTEPS
from ehsid.harness.diagnosis.search.gap_reduction import gap_reduction, window_sums
from ehsid.harness.records import Record, read_record
from ehsid.harness.rigs import Rig, read_rig

from ..blind.seal import CASES, RESULTS, TRANSFER
from .figures import Figure, quantile, share
from .judging import ScoredCase, Transfer
from .reading import Findings

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
    """Predicted and realised values of one measure of shrinkage.

    Attributes
    ----------
    words
        name of the measure.
    each
        promises of the cases in which an effect was named.
    figures
        shares of the cases whose realised value lies in the predicted interval, whose two intervals
        overlap, and whose realised value is at least the lower end of the predicted interval; then
        medians of the realised less the predicted value, of right cases and of the others.
    """

    words: str
    each: tuple[Promise, ...]
    figures: tuple[Figure, ...]


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
    time_s = pl.read_csv(path, columns=["time_s"])["time_s"].to_numpy()
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

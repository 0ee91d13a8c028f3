# SPDX-License-Identifier: MIT
"""A diagnosis as plain values: the contract's `diagnosis.json`, schema version 1."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import ehsid
from ehsid.harness.encoding import to_plain
from ehsid.harness.gap.schema import Diagnosis, Estimate, HowFar, NextExperiment, Where
from ehsid.harness.records import Record

SCHEMA_VERSION = 1
NEXT_EXPERIMENT = "next_experiment.csv"


def plain_diagnosis(
    diagnosis: Diagnosis, records: Sequence[Record], rig_file: str
) -> dict[str, Any]:
    """Every key of the contract, whatever the verdict; numbers are finite or None.

    Beyond the contract: `sentence`, `reasons`, `remarks`, `where.equations`, `where.notes`,
    intervals of the shares, `moved` of a calibrated value, sizes of the candidates, and `power` and
    `sensors` of the next experiment.
    """
    plain = to_plain(
        {
            "schema_version": SCHEMA_VERSION,
            "verdict": diagnosis.verdict,
            "sentence": diagnosis.sentence,
            "reasons": diagnosis.reasons,
            "where": _where(diagnosis.where),
            "which": _which(diagnosis),
            "how_far": _how_far(diagnosis.how_far),
            "calibration": {
                name: {"rig": value.rig, **_found(value.found), "moved": value.moved}
                for name, value in diagnosis.calibration.items()
            },
            "remarks": diagnosis.remarks,
            "provenance": {
                "ehsid_version": ehsid.__version__,
                "records": [
                    {
                        "file": str(record.source or record.name),
                        "sha256": record.sha256,
                        "role": diagnosis.records.get(record.name),
                    }
                    for record in records
                ],
                "rig": rig_file,
                "settings": {
                    **diagnosis.settings,
                    "outputs": diagnosis.outputs,
                    "outputs_left_out": diagnosis.outputs_left_out,
                },
                "seconds": diagnosis.seconds,
            },
        }
    )
    assert isinstance(plain, dict)
    return plain


def _interval(estimate: Estimate) -> dict[str, Any]:
    return {"value": estimate.value, "ci90": [estimate.low, estimate.high]}


def _found(estimate: Estimate) -> dict[str, Any]:
    return {"found": estimate.value, "ci90": [estimate.low, estimate.high]}


def _share(estimate: Estimate) -> dict[str, Any]:
    return {"share_of_gap": estimate.value, "ci90": [estimate.low, estimate.high]}


def _where(where: Where) -> dict[str, Any]:
    return {
        "subsystem": where.subsystem,
        "regimes": [
            {
                "condition": regime.condition,
                **_share(regime.share_of_gap),
                "share_of_time": regime.share_of_time,
            }
            for regime in where.regimes
        ],
        "frequency": [
            {"band_hz": band.band_hz, **_share(band.share_of_gap)} for band in where.frequency
        ],
        "time": [
            {"span_s": span.span_s, "share_of_gap": span.share_of_gap, "record": span.record}
            for span in where.time
        ],
        "equations": [
            {
                "equation": equation.equation,
                "subsystem": equation.subsystem,
                "residual": _interval(equation.residual),
                "noise": equation.noise,
            }
            for equation in where.equations
        ],
        "notes": where.notes,
    }


def _which(diagnosis: Diagnosis) -> dict[str, Any]:
    return {
        "effects": [
            {
                "id": effect.id,
                "probability": effect.probability,
                "parameters": {name: _interval(e) for name, e in effect.parameters.items()},
                "share_of_shrinkage": effect.share_of_shrinkage,
            }
            for effect in diagnosis.effects
        ],
        "ambiguity_set": diagnosis.ambiguity_set,
        "candidates": diagnosis.candidates,
        "cannot_judge": diagnosis.cannot_judge,
        "next_experiment": _next(diagnosis.next_experiment),
    }


def _next(coming: NextExperiment | None) -> dict[str, Any] | None:
    if coming is None:
        return None
    return {
        "separates": coming.separates,
        "record": NEXT_EXPERIMENT,
        "description": coming.description,
        "power": coming.power,
        "sensors": coming.sensors,
    }


def _how_far(far: HowFar | None) -> dict[str, Any]:
    """Of one form; where nothing could be compared, without numbers."""
    nothing = Estimate(math.nan, math.nan, math.nan)
    steps = ("nominal", "calibrated", "augmented")
    if far is None:
        return {
            **dict.fromkeys(steps),
            "noise_floor": [None, None],
            "shrinkage_of_explainable": _interval(nothing),
            "shrinkage_from_nominal": _interval(nothing),
            "per_output": {},
            "carries_over": None,
        }
    return {
        **{step: getattr(far, step) for step in steps},
        "noise_floor": far.noise_floor,
        "shrinkage_of_explainable": _interval(far.of_explainable or nothing),
        "shrinkage_from_nominal": _interval(far.from_nominal),
        "per_output": {
            name: dict(zip(steps, gaps, strict=True)) for name, gaps in far.per_output.items()
        },
        "carries_over": far.carries_over,
    }

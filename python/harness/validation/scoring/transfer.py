# SPDX-License-Identifier: MIT
"""Shrinkage that the augmented rig realises on the transfer record, which the diagnosis never saw.

The transfer record is the third one of the same machine, under another excitation. It is simulated
in the windows of the diagnosis with the rig as configured, with the augmented rig, and with the
augmented rig without its effects. The last one replaces the calibrated rig, which a diagnosis does
not write. Its values were fitted together with the effects, so its gap is, as a rule, larger than
that of a separate calibration, and `of_explainable` is too large. `from_nominal` does not need this
replacement.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

import ehsid
from ehsid.harness.catalogue.channels import CHANNELS, POSITION, REQUIRED_COLUMNS
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.gap.data.floor import floor_of
from ehsid.harness.gap.inference.how_far import how_far, window_sums
from ehsid.harness.gap.model.comparison import compare
from ehsid.harness.gap.model.problem import Problem
from ehsid.harness.gap.schema import Estimate
from ehsid.harness.gap.thresholds import BOOTSTRAP_SEED, DECISION_SUBSTEPS, INDEPENDENT_HZ
from ehsid.harness.records import Record, read_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.validation.blind.seal import CASES, RESULTS, TRANSFER
from ehsid.harness.validation.scoring.reading import Said


@dataclass(frozen=True)
class Transfer:
    """Gaps and shrinkage on the transfer record.

    Attributes
    ----------
    from_nominal, of_explainable
        realised shrinkage; the second is None where no gap lies above the noise floor or no effect
        was named.
    nominal, augmented
        gaps of the rig as configured and of the augmented rig on the transfer record, nrmse.
    """

    from_nominal: Estimate
    of_explainable: Estimate | None
    nominal: float
    augmented: float


def realised(told: Rig, found: Rig, record: Record, said: Said) -> Transfer | None:
    """Simulates the transfer record; returns None where it has none of the compared outputs."""
    settings = said.settings
    compared = compare(
        record,
        window_s=float(settings.get("window_s", 0.5)),
        all_states=settings.get("reset") == "estimate",
    )
    outputs = tuple(name for name in settings.get("outputs", ()) if name in compared.outputs)
    if not outputs:
        return None
    floors = {name: floor_of(record, name) for name in outputs}
    named = [one.id for one in said.named]
    sums = []
    for rig in (told, without(found, told, named), found):
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
    nominal, calibrated, augmented = sums
    far = how_far(nominal, calibrated, augmented, floors, np.random.default_rng(BOOTSTRAP_SEED))
    return Transfer(
        far.from_nominal, far.of_explainable if named else None, far.nominal, far.augmented
    )


def without(found: Rig, told: Rig, effects: list[str]) -> Rig:
    """Returns the augmented rig with the effects set to their values in the rig file, or else 0."""
    off: Mapping[str, float] = {
        name: told.values.get(name, 0.0)
        for name in found.values
        if ParameterKey(name).effect in effects
    }
    return found.with_values(off) if off else found


def transfer_of(out: Path, name: str, said: Said) -> Transfer | None:
    """Computes the transfer of a case in the folder of a check; None where a file is missing."""
    record = out / TRANSFER / f"{name}.csv"
    found = out / RESULTS / name / "rig.augmented.toml"
    told = out / CASES / name / "rig.toml"
    if not (record.is_file() and found.is_file() and told.is_file()):
        return None
    rig = read_rig(told)
    needed = (*REQUIRED_COLUMNS, POSITION)
    read = read_record(record, columns=list(CHANNELS), required=needed, layout=rig.columns)
    return realised(rig, read_rig(found), read, said)


def independent_samples(out: Path, name: str, said: Said) -> float | None:
    """Number of independent errors in the fitted record, as the cost of a fit counts them.

    n = INDEPENDENT_HZ T for each output, where T is the length of the record, s. Returns None where
    the record was not kept.
    """
    path = out / CASES / name / "train.csv"
    if not path.is_file():
        return None
    time_s = pl.read_csv(path, columns=["time_s"])["time_s"].to_numpy()
    seconds = float(time_s[-1] - time_s[0])
    return INDEPENDENT_HZ * seconds * max(1, len(said.settings.get("outputs", ())))

# SPDX-License-Identifier: MIT
"""Result of a diagnosis: the parts of its file, and what the file does not hold, such as arrays."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

import ehsid

from ..base.encoding import to_plain
from ..base.numbers import FloatArray, plain_number
from ..records import Record
from ..rigs import Rig
from ..rigs.rig import OF_TERM
from .schema import (
    NOT_COMPARED,
    NOWHERE,
    SCHEMA_VERSION,
    Calibrated,
    Candidate,
    CannotJudge,
    CouldBeSeen,
    DiagnosisFile,
    Effect,
    Estimate,
    HowFar,
    MissingLaw,
    NextExperiment,
    Provenance,
    RecordFile,
    Remark,
    Verdict,
    Where,
    Which,
    file_text,
)

# What a diagnosis does: it fits the values of the rig, each effect alone and briefly, the best of
# them at length, then sets of them; it weighs the sets, looks for missing laws, tells where, and
# designs the experiment that separates what it cannot tell apart.
Stage = Literal[
    "values", "alone", "at length", "together", "deciding", "laws", "where", "experiment"
]


@dataclass(frozen=True, eq=False)
class UnknownInput:
    """What would have to be added to an equation for the simulator to follow the fitted records.

    It is given at M nodes, one each 20 ms inside the windows of the diagnosis.
    """

    adds_to: str
    """Name of the equation, as in a table of a rig file; it tells the unit."""
    record: npt.NDArray[np.int64]
    window: npt.NDArray[np.int64]
    """Number of the record, and of the window in it, of each node, shape (M,)."""
    time_s: FloatArray
    """Time in the record, shape (M,)."""
    value: FloatArray
    deviation: FloatArray
    """Mean and standard deviation, shape (M,)."""
    of: str
    at: FloatArray
    """The variable of which it is most nearly a smooth function, and its values, shape (M,)."""
    explained: float
    """Share of the squares that such a function has, 0 to 1."""


@dataclass(frozen=True, eq=False)
class Wandering:
    """A term that an equation lacks and that follows the time alone, another one in each record."""

    adds_to: str
    """Name of the equation, as in a table of a rig file."""
    gain: float
    """By which the errors become smaller in the fitted or in the held-out data, ln on the average,
    whichever is less."""
    curves: Mapping[str, tuple[FloatArray, FloatArray]]
    """By name of the record: the middle of each window, s, and the term there, in SI units."""

    @property
    def looks_like(self) -> str:
        """How far the term goes, in words that follow "it"."""
        unit, scale = OF_TERM[self.adds_to]
        furthest = scale * max(float(np.ptp(value)) for _, value in self.curves.values())
        return (
            f"wanders over {plain_number(furthest, 3)} {unit} in the course of a record, whatever "
            "the motion is"
        )


@dataclass(frozen=True, eq=False)
class HeldOutRun:
    """A held-out record beside its simulations; arrays of shape (N,)."""

    record: str
    """Name of the record (file stem)."""
    time_s: FloatArray
    """Time of the samples, s."""
    window: npt.NDArray[np.int64]
    """Number of the simulation window, -1 where a sample is not compared."""
    command_v: FloatArray
    """Command as logged, V."""
    measured: Mapping[str, FloatArray]
    nominal: Mapping[str, FloatArray]
    calibrated: Mapping[str, FloatArray]
    augmented: Mapping[str, FloatArray]
    """Measured and simulated signals by output."""


@dataclass(frozen=True, eq=False)
class Interim:
    """What is known when a stage of a diagnosis begins; none of it is a result yet."""

    stage: Stage
    """What is done now."""
    runs: tuple[HeldOutRun, ...]
    """Held-out data, measured and simulated: as configured, with the values of the rig fitted, and
    with the set that is ahead so far."""
    how_far: HowFar
    """The gaps of these simulations."""
    ahead: tuple[str, ...]
    """Ids of the effects of the set that is ahead; none where the rig alone is."""
    sets: tuple[tuple[tuple[str, ...], float], ...]
    """Sets of effects that were fitted, each with the nrmse that it leaves on held-out data,
    smallest first."""


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """All results of a diagnosis.

    Attributes
    ----------
    where, effects, ambiguity_set, candidates, cannot_judge, next_experiment, how_far, calibration
        as the contract defines them; how_far is None where the data are insufficient.
    """

    verdict: Verdict
    """One of the six verdicts."""
    sentence: str
    """The verdict in one plain sentence."""
    reasons: tuple[str, ...]
    """What the verdict rests on, one sentence each."""
    where: Where
    effects: tuple[Effect, ...]
    ambiguity_set: tuple[tuple[str, ...], ...]
    candidates: tuple[Candidate, ...]
    cannot_judge: tuple[CannotJudge, ...]
    outside_probability: float | None
    """That the cause is outside of the catalogue; None where the data are insufficient."""
    missing_laws: tuple[MissingLaw, ...]
    """Laws of a cause outside of the catalogue; empty where the catalogue suffices, or where no law
    can be told."""
    next_experiment: NextExperiment | None
    how_far: HowFar | None
    calibration: Mapping[str, Calibrated]
    remarks: tuple[Remark, ...]
    """Remarks of the gate on the data."""
    runs: tuple[HeldOutRun, ...]
    """Held-out records beside their simulations."""
    rig: Rig
    """The rig as configured."""
    augmented_rig: Rig
    """The rig with the estimated values and effects."""
    outputs: tuple[str, ...]
    outputs_left_out: tuple[str, ...]
    """Outputs that were compared, and those that were not."""
    records: Mapping[str, str]
    """Role of each record by its name: "fit", "held out" or "fit and held out"."""
    settings: Mapping[str, object]
    """Settings of the diagnosis by name."""
    seconds: float
    """Duration of the diagnosis, s."""
    unknown_inputs: tuple[UnknownInput, ...] = ()
    """What the equations with a large share lack over the time."""
    wandering: Wandering | None = None
    """A term that follows the time alone; it is looked for where no value of the rig drifts."""
    could_be_seen: tuple[CouldBeSeen, ...] = ()
    """For the effects that are not named: from which size on the records would have shown them;
    empty for a user's simulator, whose runs are dear, and where the data are insufficient."""
    law_forms: tuple[tuple[float, ...] | None, ...] = ()
    """For each of `missing_laws` the values at its knots of the simple form that `looks_like`
    names; None where none fits."""
    next_record: Record | None = None
    """The record of `next_experiment`: time_s and command_v, ready to be sent; position_m as the
    best candidate predicts it."""
    of_traces: bool = False
    """Whether only traces of a simulator were compared, so that nothing was fitted in it."""
    in_sigmas: Mapping[str, Estimate | None] = field(default_factory=dict)
    """By name of `calibration`: what was found minus the centre of the prior that the fit used, in
    standard deviations of this prior; None where the prior has no bounded deviation."""


def diagnosis_file(diagnosis: Diagnosis, records: Sequence[Record], rig_file: str) -> DiagnosisFile:
    """Returns the content of the file, with all fields for every verdict.

    Parameters
    ----------
    diagnosis
        result of the diagnosis.
    records
        all records that were used, as they were read.
    rig_file
        path of the rig file, as the caller gives it.
    """
    used = [
        RecordFile(
            str(record.source or record.name), record.sha256, diagnosis.records.get(record.name)
        )
        for record in records
    ]
    outputs = {"outputs": diagnosis.outputs, "outputs_left_out": diagnosis.outputs_left_out}
    return DiagnosisFile(
        SCHEMA_VERSION,
        diagnosis.verdict,
        diagnosis.where,
        Which(
            diagnosis.effects,
            diagnosis.ambiguity_set,
            diagnosis.candidates,
            diagnosis.cannot_judge,
            diagnosis.next_experiment,
            diagnosis.outside_probability,
            diagnosis.missing_laws,
            diagnosis.could_be_seen,
        ),
        diagnosis.how_far or NOT_COMPARED,
        diagnosis.calibration,
        Provenance(
            ehsid.__version__,
            tuple(used),
            to_plain({**diagnosis.settings, **outputs}),
            diagnosis.seconds,
            rig_file,
        ),
        diagnosis.sentence,
        diagnosis.reasons,
        diagnosis.remarks,
    )


def diagnosis_text(diagnosis: Diagnosis, records: Sequence[Record], rig_file: str) -> str:
    """Returns the text of the file; see `diagnosis_file` for the parameters."""
    return file_text(diagnosis_file(diagnosis, records, rig_file))


def insufficient(
    rig: Rig,
    roles: Mapping[str, str],
    remarks: Sequence[Remark],
    reasons: Sequence[str],
    settings: Mapping[str, object],
    seconds: float,
    *,
    of_traces: bool = False,
) -> Diagnosis:
    """Returns the result of data that cannot carry a diagnosis; `reasons` has at least one."""
    return Diagnosis(
        verdict="insufficient_data",
        sentence=f"These data cannot carry a diagnosis. {reasons[0]}",
        reasons=tuple(reasons),
        where=NOWHERE,
        effects=(),
        ambiguity_set=(),
        candidates=(),
        cannot_judge=(),
        outside_probability=None,
        missing_laws=(),
        next_experiment=None,
        how_far=None,
        calibration={},
        remarks=tuple(remarks),
        runs=(),
        rig=rig,
        augmented_rig=rig,
        outputs=(),
        outputs_left_out=(),
        records=roles,
        settings=settings,
        seconds=seconds,
        of_traces=of_traces,
    )

# SPDX-License-Identifier: MIT
"""Fields of the contract's `diagnosis.json`, schema version 1, for writers and readers.

The classes below define the file: a class is an object, a field is a key. They determine the text
that is written, the check of a file that is read, and the JSON Schema in docs/schemas, which quotes
their docstrings. Fields with a default go beyond the contract, so a file may lack them. A number
that is not known is null.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import msgspec

import ehsid

from ..base.encoding import from_json, to_plain
from ..records import Record
from . import schema as findings

SCHEMA_VERSION: Literal[1] = 1
NEXT_EXPERIMENT = "next_experiment.csv"
# All files of a diagnosis; that of the next experiment only where there is one.
RESULT_FILES = (
    "diagnosis.json",
    "simulation.csv",
    "rig.augmented.toml",
    NEXT_EXPERIMENT,
    "report.html",
)

Number = float | None
Interval = tuple[Number, Number]


class Value(msgspec.Struct, frozen=True):
    """A value with its interval of 90 %, in the unit of what it belongs to."""

    value: Number
    ci90: Interval

    @classmethod
    def of(cls, estimate: findings.Estimate | None) -> Value:
        """Converts an estimate to plain numbers; all are null where there is no estimate."""
        if estimate is None:
            return cls(None, (None, None))
        return cls(_number(estimate.value), (_number(estimate.low), _number(estimate.high)))

    def estimate(self) -> findings.Estimate:
        """Converts the value to an estimate, with NaN where a number is not known."""
        return findings.Estimate(known(self.value), *map(known, self.ci90))


class Regime(msgspec.Struct, frozen=True):
    """Share of the structural gap under a condition, e.g. "|velocity| < 0.004 m/s"."""

    condition: str
    share_of_gap: Number
    share_of_time: Number
    ci90: Interval = (None, None)


class Band(msgspec.Struct, frozen=True):
    """Share of the structural gap in a band of frequencies, Hz."""

    band_hz: tuple[float, float]
    share_of_gap: Number
    ci90: Interval = (None, None)


class Span(msgspec.Struct, frozen=True):
    """Share of the structural gap in a stretch of a held-out record, s."""

    span_s: tuple[float, float]
    share_of_gap: Number
    record: str = ""


class Equation(msgspec.Struct, frozen=True):
    """How much an equation asks for a term that it lacks.

    `equation` and `of` are names as in a table of a rig file; `gain` is in nats. `of` is the
    variable of which the missing term is most nearly a smooth function, with `explained` as its
    share; both are there where the share is large. Files of earlier versions have neither share nor
    gain.
    """

    equation: str
    subsystem: str
    share: Number = None
    gain: Number = None
    of: str | None = None
    explained: Number = None


class Where(msgspec.Struct, frozen=True):
    """Where the structural gap lies; `subsystem` has shares with sum 1, or nothing."""

    subsystem: dict[str, float]
    regimes: list[Regime]
    frequency: list[Band]
    time: list[Span]
    equations: list[Equation] = []
    notes: list[str] = []


class Effect(msgspec.Struct, frozen=True):
    """An effect of the best set, with its sizes in SI by the names of its parameters."""

    id: str
    probability: Number
    parameters: dict[str, Value]
    share_of_shrinkage: Number


class Candidate(msgspec.Struct, frozen=True):
    """A set of effects that was fitted; scores and costs in nats.

    `standing` tells what the decision made of the set, and `why` the condition that decided. `left`
    is the mean of ln(errors / tolerated errors), `small` how far its effects fall short of sizes
    that are beyond doubt, and `probability` that of just this set; null for a set that the decision
    did not weigh.
    """

    effects: list[str]
    score: Number
    held_out_shrinkage: Number
    parameters: dict[str, Number] = {}
    in_confidence_set: bool = False
    fitted_cost: Number = None
    held_out_cost: Number = None
    free: int | None = None
    standing: str | None = None
    why: str = ""
    left: Number = None
    small: Number = None
    probability: Number = None


class CannotJudge(msgspec.Struct, frozen=True):
    """An effect of which the records cannot speak, and what they lack."""

    id: str
    why: str


class NextExperiment(msgspec.Struct, frozen=True):
    """The experiment that separates the candidates; `record` is the file with its command."""

    separates: list[str]
    record: str
    description: str
    power: Number = None
    sensors: list[str] = []


class MissingLaw(msgspec.Struct, frozen=True):
    """A term that an equation lacks: linear between the knots of a variable, in SI units.

    `visited` is the share of the samples around each knot, and `rivals` are equations and variables
    of laws that explain the gap nearly as well.
    """

    adds_to: str
    of: str
    knots: list[Number]
    values: list[Number]
    band90: list[Interval]
    share_of_shrinkage: Number
    looks_like: str
    visited: list[Number] = []
    rivals: list[tuple[str, str]] = []


class Which(msgspec.Struct, frozen=True):
    """Which effects cause the gap; `ambiguity_set` and `candidates` have the best first.

    `outside_probability` is that of a cause outside of the catalogue, and `missing_law` the laws of
    such a cause, as far as they can be told.
    """

    effects: list[Effect]
    ambiguity_set: list[list[str]]
    candidates: list[Candidate]
    cannot_judge: list[CannotJudge]
    next_experiment: NextExperiment | None
    outside_probability: Number = None
    missing_law: list[MissingLaw] = []


class Gaps(msgspec.Struct, frozen=True):
    """Gaps of one output, nrmse."""

    nominal: Number
    calibrated: Number
    augmented: Number


class HowFar(msgspec.Struct, frozen=True):
    """Gaps on held-out data, nrmse averaged over the outputs, and how far they shrink."""

    nominal: Number
    calibrated: Number
    augmented: Number
    noise_floor: Interval
    shrinkage_of_explainable: Value
    shrinkage_from_nominal: Value
    per_output: dict[str, Gaps]
    carries_over: Interval | None = None


class Calibrated(msgspec.Struct, frozen=True):
    """A value of the rig file, or the prior centre of a nuisance, and what the fit found."""

    rig: Number
    found: Number
    ci90: Interval
    moved: bool = False


class Remark(msgspec.Struct, frozen=True):
    """What the reader must know of the data; `record` is "" where it concerns all of them."""

    record: str
    what: str
    serious: bool = False


class RecordFile(msgspec.Struct, frozen=True):
    """A record that was used; its role is "fit", "held out" or "fit and held out"."""

    file: str
    sha256: str | None
    role: str | None = None


class Provenance(msgspec.Struct, frozen=True):
    """What the diagnosis was made from, with what, and how long it took."""

    ehsid_version: str
    records: list[RecordFile]
    settings: dict[str, Any]
    seconds: Number
    rig: str = ""


class DiagnosisFile(msgspec.Struct, frozen=True):
    """The file as a whole."""

    schema_version: Literal[1]
    verdict: findings.Verdict
    where: Where
    which: Which
    how_far: HowFar
    calibration: dict[str, Calibrated]
    provenance: Provenance
    sentence: str = ""
    reasons: list[str] = []
    remarks: list[Remark] = []


def known(number: Number) -> float:
    """Returns the number, or NaN where it is null."""
    return math.nan if number is None else number


def _number(value: float | None) -> Number:
    return float(value) if value is not None and math.isfinite(value) else None


def diagnosis_file(
    diagnosis: findings.Diagnosis, records: Sequence[Record], rig_file: str
) -> DiagnosisFile:
    """Returns the content of the file, with all fields for every verdict.

    Parameters
    ----------
    diagnosis
        findings of the diagnosis.
    records
        all records that were used, as they were read.
    rig_file
        path of the rig file, as the caller gives it.
    """
    return DiagnosisFile(
        schema_version=SCHEMA_VERSION,
        verdict=diagnosis.verdict,
        where=_where(diagnosis.where),
        which=_which(diagnosis),
        how_far=_how_far(diagnosis.how_far),
        calibration={name: _calibrated(value) for name, value in diagnosis.calibration.items()},
        provenance=Provenance(
            ehsid_version=ehsid.__version__,
            records=[
                RecordFile(
                    str(record.source or record.name),
                    record.sha256,
                    diagnosis.records.get(record.name),
                )
                for record in records
            ],
            settings=to_plain(
                {
                    **diagnosis.settings,
                    "outputs": diagnosis.outputs,
                    "outputs_left_out": diagnosis.outputs_left_out,
                }
            ),
            seconds=_number(diagnosis.seconds),
            rig=rig_file,
        ),
        sentence=diagnosis.sentence,
        reasons=list(diagnosis.reasons),
        remarks=[
            Remark(remark.record, remark.what, remark.serious) for remark in diagnosis.remarks
        ],
    )


def diagnosis_text(diagnosis: findings.Diagnosis, records: Sequence[Record], rig_file: str) -> str:
    """Returns the text of the file; see `diagnosis_file` for the parameters."""
    encoded = msgspec.json.encode(diagnosis_file(diagnosis, records, rig_file))
    return msgspec.json.format(encoded, indent=2).decode() + "\n"


def read_diagnosis_file(path: Path) -> DiagnosisFile:
    """Reads and checks a file; keys that this version does not know are ignored.

    Raises
    ------
    ValueError
        the file is not JSON, lacks a key, or has a value of another type; the message says where.
    OSError
        the file cannot be read.
    """
    try:
        return from_json(path.read_bytes(), DiagnosisFile)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a diagnosis of version {SCHEMA_VERSION}: {error}") from None


def json_schema() -> dict[str, Any]:
    """Returns the JSON Schema of the file, which is also stored in docs/schemas/diagnosis.json."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "diagnosis.json of ehsid gap, schema version 1",
        **msgspec.json.schema(DiagnosisFile),
    }


def _where(where: findings.Where) -> Where:
    return Where(
        subsystem={name: float(share) for name, share in where.subsystem.items()},
        regimes=[
            Regime(entry.condition, share.value, _number(entry.share_of_time), share.ci90)
            for entry in where.regimes
            for share in (Value.of(entry.share_of_gap),)
        ],
        frequency=[
            Band((float(entry.band_hz[0]), float(entry.band_hz[1])), share.value, share.ci90)
            for entry in where.frequency
            for share in (Value.of(entry.share_of_gap),)
        ],
        time=[
            Span(
                (float(entry.span_s[0]), float(entry.span_s[1])),
                _number(entry.share_of_gap),
                entry.record,
            )
            for entry in where.time
        ],
        equations=[
            Equation(
                entry.equation,
                entry.subsystem,
                _number(entry.share),
                _number(entry.gain),
                *(
                    ()
                    if entry.unknown_input is None
                    else (entry.unknown_input.of, _number(entry.unknown_input.explained))
                ),
            )
            for entry in where.equations
        ],
        notes=list(where.notes),
    )


def _which(diagnosis: findings.Diagnosis) -> Which:
    experiment = diagnosis.next_experiment
    return Which(
        effects=[
            Effect(
                effect.id,
                _number(effect.probability),
                {name: Value.of(size) for name, size in effect.parameters.items()},
                _number(effect.share_of_shrinkage),
            )
            for effect in diagnosis.effects
        ],
        ambiguity_set=[list(effects) for effects in diagnosis.ambiguity_set],
        candidates=[_candidate(candidate) for candidate in diagnosis.candidates],
        cannot_judge=[CannotJudge(effect.id, effect.why) for effect in diagnosis.cannot_judge],
        next_experiment=None
        if experiment is None
        else NextExperiment(
            list(experiment.separates),
            NEXT_EXPERIMENT,
            experiment.description,
            _number(experiment.power),
            list(experiment.sensors),
        ),
        outside_probability=_number(diagnosis.outside_probability),
        missing_law=[_missing_law(law) for law in diagnosis.missing_laws],
    )


def _missing_law(found: findings.MissingLaw) -> MissingLaw:
    law = found.law
    return MissingLaw(
        law.adds_to,
        law.of,
        [_number(knot) for knot in law.knots],
        [_number(value) for value in law.values],
        [(_number(low), _number(high)) for low, high in found.band],
        _number(found.share_of_shrinkage),
        found.looks_like,
        [_number(share) for share in found.visited],
        list(found.rivals),
    )


def _candidate(candidate: findings.Candidate) -> Candidate:
    return Candidate(
        list(candidate.effects),
        _number(candidate.score),
        _number(candidate.held_out_shrinkage),
        {name: _number(value) for name, value in candidate.parameters.items()},
        bool(candidate.in_confidence_set),
        _number(candidate.fitted_cost),
        _number(candidate.held_out_cost),
        int(candidate.free),
        candidate.standing.kind,
        candidate.standing.why,
        _number(candidate.left),
        _number(candidate.small),
        _number(candidate.probability),
    )


def _how_far(reduction: findings.HowFar | None) -> HowFar:
    """Returns the figures in one form; all numbers are null where nothing could be compared."""
    if reduction is None:
        nothing = Value.of(None)
        return HowFar(None, None, None, (None, None), nothing, nothing, {}, None)
    low, high = reduction.noise_floor
    return HowFar(
        _number(reduction.nominal),
        _number(reduction.calibrated),
        _number(reduction.augmented),
        (_number(low), _number(high)),
        Value.of(reduction.of_explainable),
        Value.of(reduction.from_nominal),
        {name: Gaps(*map(_number, gaps)) for name, gaps in reduction.per_output.items()},
        None
        if reduction.carries_over is None
        else (_number(reduction.carries_over[0]), _number(reduction.carries_over[1])),
    )


def _calibrated(calibrated: findings.CalibratedValue) -> Calibrated:
    value = Value.of(calibrated.found)
    return Calibrated(_number(calibrated.rig), value.value, value.ci90, bool(calibrated.moved))

# SPDX-License-Identifier: MIT
"""The parts of a diagnosis as the contract's `diagnosis.json`, schema version 1, has them.

Names and order of the fields are those of the file: the classes determine the text that is written,
the check of a file that is read, and the JSON Schema in docs/schemas, which quotes their
docstrings. Fields with a default go beyond the contract, so a file may lack them. A number that is
not known is NaN, and null in the file.
"""

from __future__ import annotations

import inspect
import math
from abc import ABC
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import msgspec
import numpy as np

from ..base.encoding import from_json, to_plain
from ..rigs.rig import TableLaw

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
# Length of a simulation window, s, and the time that is skipped at the start of a record, s.
WINDOW_S = 0.5
SKIP_S = 0.3

SUBSYSTEMS = ("valve", "hydraulics", "mechanics", "sensor", "timing")
# A subsystem with a quarter of the gap takes part in it.
SUBSYSTEM_TAKES_PART = 0.25

Verdict = Literal[
    "no_gap", "parameters", "effects", "ambiguous", "outside_catalogue", "insufficient_data"
]

if TYPE_CHECKING:
    Number = float
else:

    class Number(ABC):  # noqa: B024
        """A float of the file, with a class of its own so that `read_number` makes NaN of null."""

    Number.register(float)

Interval = tuple[Number, Number]
NO_INTERVAL: Interval = (math.nan, math.nan)


@dataclass(frozen=True)
class Estimate:
    """A value with its confidence interval of 90 %, from `low` to `high`, in the same unit."""

    value: float
    low: float
    high: float

    @property
    def ci90(self) -> tuple[float, float]:
        """Both ends of the interval."""
        return self.low, self.high


class Value(msgspec.Struct, frozen=True):
    """A value with its interval of 90 %, in the unit of what it belongs to."""

    value: Number
    ci90: Interval

    @classmethod
    def of(cls, estimate: Estimate | None) -> Value:
        """Returns an estimate as the file has it; of none nothing is known."""
        return (
            cls(math.nan, NO_INTERVAL) if estimate is None else cls(estimate.value, estimate.ci90)
        )

    @property
    def estimate(self) -> Estimate:
        """The same as an estimate."""
        return Estimate(self.value, *self.ci90)


class Regime(msgspec.Struct, frozen=True):
    """Share of the structural gap under a condition, e.g. "|velocity| < 0.004 m/s".

    Shares are in [0, 1].
    """

    condition: str
    share: Number = msgspec.field(name="share_of_gap")
    share_of_time: Number
    ci90: Interval = NO_INTERVAL

    @property
    def share_of_gap(self) -> Estimate:
        """The share with its interval."""
        return Estimate(self.share, *self.ci90)


class Band(msgspec.Struct, frozen=True):
    """Share of the structural gap in a band of frequencies, Hz."""

    band_hz: tuple[float, float]
    share: Number = msgspec.field(name="share_of_gap")
    ci90: Interval = NO_INTERVAL

    @property
    def share_of_gap(self) -> Estimate:
        """The share with its interval."""
        return Estimate(self.share, *self.ci90)


class Span(msgspec.Struct, frozen=True):
    """Share of the structural gap in a stretch of a held-out record, s."""

    span_s: tuple[float, float]
    share_of_gap: Number
    record: str = ""


class Equation(msgspec.Struct, frozen=True):
    """How much an equation asks for a term that it lacks.

    `equation` and `of` are names as in a table of a rig file; `gain` is the logarithm of the
    evidence of smooth terms in this equation above none, in nats. `of` is the variable of which the
    missing term is most nearly a smooth function, with `explained` as its share; both are there
    where the share is large. Files of earlier versions have neither share nor gain.
    """

    equation: str
    subsystem: str
    share: Number = math.nan
    gain: Number = math.nan
    of: str | None = None
    explained: Number = math.nan


class Where(msgspec.Struct, frozen=True):
    """Where the structural gap lies; `subsystem` has shares with sum 1, or nothing.

    Shares are of the calibrated gap above the noise floor; regimes and equations have the largest
    first. Notes are sentences: where this contradicts the selected effects, or what it rests on.
    """

    subsystem: Mapping[str, float]
    regimes: tuple[Regime, ...]
    frequency: tuple[Band, ...]
    time: tuple[Span, ...]
    equations: tuple[Equation, ...] = ()
    notes: tuple[str, ...] = ()


NOWHERE = Where({}, (), (), ())


class Effect(msgspec.Struct, frozen=True):
    """An effect of the best set, with its sizes in SI by the names of its parameters.

    `probability` is that the machine has the effect: of all effects with 0.9, nine in ten are
    right. `share_of_shrinkage` is the share in the held-out gain of the whole set, from the set
    without this effect; all effects together have 1.
    """

    id: str
    probability: Number
    sizes: Mapping[str, Value] = msgspec.field(name="parameters")
    share_of_shrinkage: Number

    @property
    def parameters(self) -> dict[str, Estimate]:
        """The sizes as estimates."""
        return {name: size.estimate for name, size in self.sizes.items()}


class Candidate(msgspec.Struct, frozen=True):
    """A set of effects that was fitted; scores and costs in nats.

    `score` is the distance of the held-out log-likelihood from that of the first candidate, and
    `held_out_shrinkage` the share of the explainable gap that the set removes. Costs are known up
    to a constant of the record, less is better: on the fitted records with the priors, and on the
    held-out records without them. `free` is the number of fitted values.

    `standing` tells what the decision made of the set, and `why` the condition that decided: it is
    "named", the best set; "equivalent", the data cannot separate it from the best; "sufficient",
    the calibrated rig where no effect is named; "not_sufficient", the same where the cause is
    outside of the catalogue; "improbable", too much so to be named beside such a cause;
    "not_needed"; "too_small", an effect is no larger than in every servo, or has sizes that no
    servo has; "worse", its errors on held-out data are larger; or "screened", only a short fit was
    made. `left` is the mean of ln(errors / tolerated errors), `small` how far its effects fall
    short of sizes that are beyond doubt, `price` what its values cost, those of the rig and those
    that no data sheet gives, and `probability` that of just this set; null for a set that the
    decision did not weigh.
    """

    effects: tuple[str, ...]
    score: Number
    held_out_shrinkage: Number
    parameters: Mapping[str, Number] = {}
    in_confidence_set: bool = False
    fitted_cost: Number = math.nan
    held_out_cost: Number = math.nan
    free: int | None = None
    standing: str | None = None
    why: str = ""
    left: float | None = None
    small: float | None = None
    probability: float | None = None
    price: float | None = None


class CannotJudge(msgspec.Struct, frozen=True):
    """An effect of which the records cannot speak, and what they lack."""

    id: str
    why: str


class CouldBeSeen(msgspec.Struct, frozen=True):
    """From which size on these records would have shown an effect that is not named.

    `size` is that of `parameter`, and `sizes` has all sizes of the effect there, in SI. `limit`
    tells what it rests on: "record", a smaller effect would not have been named; "least_size",
    every larger one would have been, and every sound servo has what is smaller; "none", no size
    would have been, and `size` is null.
    """

    id: str
    parameter: str
    size: Number
    limit: Literal["record", "least_size", "none"]
    sizes: Mapping[str, Number] = {}


class NextExperiment(msgspec.Struct, frozen=True):
    """The experiment that separates the candidates; `record` is the file with its command.

    A candidate is the id of an effect, or the ids of a set joined with "+". `power` is the
    predicted probability that the diagnosis separates them with this record, `nats` the evidence
    that is expected between the best candidate and the one that is hardest to separate from it, and
    `sensors` are the columns that must be measured.
    """

    separates: tuple[str, ...]
    record: str
    description: str
    power: Number = math.nan
    sensors: tuple[str, ...] = ()
    nats: Number = math.nan


class MissingLaw(msgspec.Struct, frozen=True):
    """A term that an equation lacks: linear between the knots of a variable, in SI units.

    It acts besides the named effects. `visited` is the share of the samples around each knot, and
    `rivals` are equations and variables of laws that explain the gap nearly as well.
    """

    adds_to: str
    of: str
    knots: tuple[Number, ...]
    values: tuple[Number, ...]
    band: tuple[Interval, ...] = msgspec.field(name="band90")
    share_of_shrinkage: Number
    looks_like: str
    visited: tuple[Number, ...] = ()
    rivals: tuple[tuple[str, str], ...] = ()

    @property
    def law(self) -> TableLaw:
        """The law as a table of a rig file."""
        return TableLaw(self.adds_to, self.of, self.knots, self.values)


class Which(msgspec.Struct, frozen=True):
    """Which effects cause the gap; `ambiguity_set` and `candidates` have the best first.

    `outside_probability` is that of a cause outside of the catalogue, and `missing_law` the laws of
    such a cause, as far as they can be told.
    """

    effects: tuple[Effect, ...]
    ambiguity_set: tuple[tuple[str, ...], ...]
    candidates: tuple[Candidate, ...]
    cannot_judge: tuple[CannotJudge, ...]
    next_experiment: NextExperiment | None
    outside_probability: float | None = None
    missing_law: tuple[MissingLaw, ...] = ()
    could_be_seen: tuple[CouldBeSeen, ...] = ()


class Gaps(msgspec.Struct, frozen=True):
    """Gaps of one output, nrmse."""

    nominal: Number
    calibrated: Number
    augmented: Number


class HowFar(msgspec.Struct, frozen=True):
    """Gaps on held-out data, nrmse averaged over the outputs, and how far they shrink.

    They are those of the simulator as configured, with its values fitted, and with the selected
    effects. `carries_over` is the shrinkage as a share of the explainable gap, on the half of the
    held-out windows with the smaller commands and on the other half; null where there are too few
    windows, or where one half has no gap above the floor.
    """

    nominal: Number
    calibrated: Number
    augmented: Number
    noise_floor: Interval
    shrinkage_of_explainable: Value
    shrinkage_from_nominal: Value
    gaps: Mapping[str, Gaps] = msgspec.field(name="per_output")
    carries_over: Interval | None = None

    @property
    def of_explainable(self) -> Estimate | None:
        """(calibrated - augmented) / (calibrated - floor); None where nothing is above the floor.

        Where effects are named, the intervals of both shares are for other motions of the machine.
        """
        share = self.shrinkage_of_explainable
        return None if math.isnan(share.value) else share.estimate

    @property
    def from_nominal(self) -> Estimate:
        """(nominal - augmented) / nominal."""
        return self.shrinkage_from_nominal.estimate

    @property
    def per_output(self) -> dict[str, tuple[float, float, float]]:
        """The three gaps of each output."""
        return {name: msgspec.structs.astuple(gaps) for name, gaps in self.gaps.items()}


NOT_COMPARED = HowFar(math.nan, math.nan, math.nan, NO_INTERVAL, Value.of(None), Value.of(None), {})


class Calibrated(msgspec.Struct, frozen=True):
    """A value of the rig file, or the prior centre of a nuisance, and what the fit found.

    It has moved where that matters in size and in significance.
    """

    rig: Number
    value: Number = msgspec.field(name="found")
    ci90: Interval
    moved: bool = False

    @property
    def found(self) -> Estimate:
        """What the fit found, with its interval."""
        return Estimate(self.value, *self.ci90)


class Remark(msgspec.Struct, frozen=True):
    """What the reader must know of the data; `record` is "" where it concerns all of them.

    `what` is one plain sentence: what was observed and what it means. The diagnosis cannot rest on
    a record with a serious remark.
    """

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
    records: tuple[RecordFile, ...]
    settings: Mapping[str, Any]
    seconds: Number
    rig: str = ""


class DiagnosisFile(msgspec.Struct, frozen=True):
    """The file as a whole."""

    schema_version: Literal[1]
    verdict: Verdict
    where: Where
    which: Which
    how_far: HowFar
    calibration: Mapping[str, Calibrated]
    provenance: Provenance
    sentence: str = ""
    reasons: tuple[str, ...] = ()
    remarks: tuple[Remark, ...] = ()


def file_text(file: DiagnosisFile) -> str:
    """Returns the text of a file."""
    encoded = msgspec.json.encode(file, enc_hook=np.generic.item)
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
        return from_json(path.read_bytes(), DiagnosisFile, read_number)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a diagnosis of version {SCHEMA_VERSION}: {error}") from None


def read_number(kind: type, found: Any) -> float:
    """Returns a number of the file; `kind` can only be `Number`."""
    if found is None:
        return math.nan
    if isinstance(found, bool) or not isinstance(found, int | float):
        raise ValueError(f"Expected `float | null`, got `{type(found).__name__}`")
    return float(found)


def _number_schema(kind: type) -> dict[str, Any]:
    """Returns the schema of a number; `kind` can only be `Number`."""
    return {"anyOf": [{"type": "number"}, {"type": "null"}]}


def json_schema() -> dict[str, Any]:
    """Returns the JSON Schema of the file, which is also stored in docs/schemas/diagnosis.json."""
    schema = to_plain(msgspec.json.schema(DiagnosisFile, schema_hook=_number_schema))
    for part in schema["$defs"].values():
        if "description" in part:
            part["description"] = inspect.cleandoc(part["description"])
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "diagnosis.json of ehsid gap, schema version 1",
        **schema,
    }

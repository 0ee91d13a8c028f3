# SPDX-License-Identifier: MIT
"""What a diagnosis finds, as typed data; names follow the contract of the diagnosis file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from ehsid.harness.arrays import FloatArray
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig

Verdict = Literal[
    "no_gap", "parameters", "effects", "ambiguous", "outside_catalogue", "insufficient_data"
]
SUBSYSTEMS = ("valve", "hydraulics", "mechanics", "sensor", "timing")


@dataclass(frozen=True)
class Estimate:
    """A value with its interval of 90 %."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Remark:
    """Something about the data that a reader must know.

    Attributes
    ----------
    record
        name, or "" for all.
    what
        one plain sentence: what was found and what it means.
    serious
        the diagnosis cannot rest on this record.
    """

    record: str
    what: str
    serious: bool = False


@dataclass(frozen=True)
class RegimeShare:
    """A condition in words with formula, e.g. "|velocity| < 0.004 m/s"; shares in [0, 1]."""

    condition: str
    share_of_gap: Estimate
    share_of_time: float


@dataclass(frozen=True)
class BandShare:
    """From and to, Hz."""

    band_hz: tuple[float, float]
    share_of_gap: Estimate


@dataclass(frozen=True)
class SpanShare:
    """A stretch of a held-out record."""

    record: str
    span_s: tuple[float, float]
    share_of_gap: float


@dataclass(frozen=True)
class EquationShare:
    """What an equation of the servo leaves over, from measured signals, without any fit of effects.

    Attributes
    ----------
    equation
        "valve and cap-side continuity", "force balance", ...
    subsystem
        to which it belongs.
    residual
        rms of what remains after the equation's own parameters, as a share of its largest term.
    noise
        what the noise of the sensors alone would leave, the same share.
    """

    equation: str
    subsystem: str
    residual: Estimate
    noise: float


@dataclass(frozen=True)
class Where:
    """Where the structural gap lies.

    Attributes
    ----------
    subsystem
        shares, sum 1; empty where there is no structural gap.
    regimes, frequency, time
        shares of the calibrated gap above the floor, largest first (frequency and time in order).
    equations
        of the measured signals; empty without pressures.
    notes
        where this contradicts the effects that were found, or what it rests on.
    """

    subsystem: Mapping[str, float] = field(default_factory=dict)
    regimes: tuple[RegimeShare, ...] = ()
    frequency: tuple[BandShare, ...] = ()
    time: tuple[SpanShare, ...] = ()
    equations: tuple[EquationShare, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class FoundEffect:
    """An effect of the best set.

    Attributes
    ----------
    id
        of the catalogue.
    probability
        that it is there: of all named with 0.9, nine in ten are right.
    parameters
        by their own name, SI.
    share_of_shrinkage
        of the held-out gain of the whole set, by leaving this one out; they sum to 1.
    """

    id: str
    probability: float
    parameters: Mapping[str, Estimate]
    share_of_shrinkage: float


@dataclass(frozen=True)
class Candidate:
    """A set of effects that was fitted.

    Attributes
    ----------
    effects
        ids.
    score
        held-out log-likelihood below the best, nats; 0 is the best.
    held_out_shrinkage
        of the explainable gap.
    parameters
        of the effects, "id.parameter".
    in_confidence_set
        the data cannot tell it from the best.
    fitted_cost, held_out_cost
        nats: on the fitted records with the priors, and on the held-out ones without; up to a
        constant of the record, less is better.
    free
        values that were fitted.
    """

    effects: tuple[str, ...]
    score: float
    held_out_shrinkage: float
    parameters: Mapping[str, float]
    in_confidence_set: bool
    fitted_cost: float
    held_out_cost: float
    free: int


@dataclass(frozen=True)
class CannotJudge:
    """An effect, and what is missing."""

    id: str
    why: str


@dataclass(frozen=True, eq=False)
class NextExperiment:
    """A command that separates rivals.

    Attributes
    ----------
    separates
        ids, or "+"-joined ids of a set.
    record
        time_s and command_v, ready to be sent; position_m as the best rival predicts it.
    description
        one line for the operator.
    power
        predicted probability that the diagnosis then tells them apart.
    sensors
        columns that must be measured.
    """

    separates: tuple[str, ...]
    record: Record
    description: str
    power: float
    sensors: tuple[str, ...]


@dataclass(frozen=True)
class HowFar:
    """The contract's figures: nrmse averaged over the outputs.

    Attributes
    ----------
    nominal, calibrated, augmented
        of the rig as configured, with its values fitted, and with the effects that were found.
    noise_floor
        lowest and highest.
    of_explainable
        (calibrated - augmented) / (calibrated - floor); None where nothing is above the floor.
    from_nominal
        (nominal - augmented) / nominal.
    per_output
        the three gaps of each output.
    carries_over
        share of the explainable gap on held-out windows by the size of their command: the smaller
        and the larger half; None where there are too few.
    """

    nominal: float
    calibrated: float
    augmented: float
    noise_floor: tuple[float, float]
    of_explainable: Estimate | None
    from_nominal: Estimate
    per_output: Mapping[str, tuple[float, float, float]]
    carries_over: tuple[float, float] | None = None


@dataclass(frozen=True)
class CalibratedValue:
    """A value of the rig or a nuisance after the fit.

    Attributes
    ----------
    rig
        as told, or typical of a nuisance.
    found
        in the same unit.
    moved
        the move matters in size and in significance.
    in_sigmas
        `found` less the centre of the prior that the fit used, in standard deviations of this
        prior; None where the prior has no bounded deviation.
    """

    rig: float
    found: Estimate
    moved: bool
    in_sigmas: Estimate | None = None


@dataclass(frozen=True, eq=False)
class HeldOutRun:
    """A held-out record beside its simulations; arrays of shape (N,).

    Attributes
    ----------
    record
        name (file stem).
    time_s
        of the samples.
    window
        number of the simulation window, -1 where a sample is not compared.
    command_v
        as logged.
    measured, nominal, calibrated, augmented
        by output.
    """

    record: str
    time_s: FloatArray
    window: npt.NDArray[np.int64]
    command_v: FloatArray
    measured: Mapping[str, FloatArray]
    nominal: Mapping[str, FloatArray]
    calibrated: Mapping[str, FloatArray]
    augmented: Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """The answer.

    Attributes
    ----------
    verdict
        one of six.
    sentence
        the same in one plain sentence.
    reasons
        what the verdict rests on, one sentence each.
    where, effects, ambiguity_set, candidates, cannot_judge, next_experiment, how_far, calibration
        as the contract has them; how_far is None where the data are insufficient.
    remarks
        of the gate.
    runs
        held-out records beside their simulations.
    rig
        as told.
    augmented_rig
        with the found values and effects.
    outputs, outputs_left_out
        that were compared, and those that were not.
    records
        all records with their role, "fit" or "held out" or "fit and held out".
    settings
        what was used, by name.
    seconds
        it took.
    """

    verdict: Verdict
    sentence: str
    reasons: tuple[str, ...]
    where: Where
    effects: tuple[FoundEffect, ...]
    ambiguity_set: tuple[tuple[str, ...], ...]
    candidates: tuple[Candidate, ...]
    cannot_judge: tuple[CannotJudge, ...]
    next_experiment: NextExperiment | None
    how_far: HowFar | None
    calibration: Mapping[str, CalibratedValue]
    remarks: tuple[Remark, ...]
    runs: tuple[HeldOutRun, ...]
    rig: Rig
    augmented_rig: Rig
    outputs: tuple[str, ...]
    outputs_left_out: tuple[str, ...]
    records: Mapping[str, str]
    settings: Mapping[str, object]
    seconds: float

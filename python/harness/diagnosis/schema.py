# SPDX-License-Identifier: MIT
"""Results of a diagnosis as typed data; names follow the contract of the diagnosis file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
import numpy.typing as npt

from ..base.arrays import FloatArray
from ..records import Record
from ..rigs import Rig
from ..rigs.table_law import TableLaw

# Length of a simulation window, s, and the time that is skipped at the start of a record, s. The
# contract of the diagnosis file fixes both.
WINDOW_S = 0.5
SKIP_S = 0.3

Verdict = Literal[
    "no_gap", "parameters", "effects", "ambiguous", "outside_catalogue", "insufficient_data"
]
# What a diagnosis does: it fits the values of the rig, each effect alone and briefly, the best of
# them at length, then sets of them; it weighs the sets, looks for missing laws, tells where, and
# designs the experiment that separates what it cannot tell apart.
Stage = Literal[
    "values", "alone", "at length", "together", "deciding", "laws", "where", "experiment"
]
SUBSYSTEMS = ("valve", "hydraulics", "mechanics", "sensor", "timing")
# A subsystem with a quarter of the gap takes part in it.
SUBSYSTEM_TAKES_PART = 0.25


@dataclass(frozen=True)
class Estimate:
    """A value with its confidence interval of 90 %, from `low` to `high`, in the same unit."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Remark:
    """Something about the data that a reader must know.

    Attributes
    ----------
    record
        name of the record, or "" where the remark concerns all of them.
    what
        one plain sentence: what was observed and what it means.
    serious
        true where the diagnosis cannot rest on this record.
    """

    record: str
    what: str
    serious: bool = False


@dataclass(frozen=True)
class RegimeShare:
    """Share of the structural gap under a condition; shares are in [0, 1].

    The condition is in words with its formula, e.g. "|velocity| < 0.004 m/s".
    """

    condition: str
    share_of_gap: Estimate
    share_of_time: float


@dataclass(frozen=True)
class BandShare:
    """Share of the structural gap in a band of frequencies; both ends of the band are in Hz."""

    band_hz: tuple[float, float]
    share_of_gap: Estimate


@dataclass(frozen=True)
class SpanShare:
    """Share of the structural gap in a stretch of a held-out record; begin and end are in s."""

    record: str
    span_s: tuple[float, float]
    share_of_gap: float


@dataclass(frozen=True, eq=False)
class UnknownInput:
    """What would have to be added to an equation for the simulator to follow the fitted records.

    It is given at M nodes, one each 20 ms inside the windows of the diagnosis.

    Attributes
    ----------
    adds_to
        name of the equation, as in a table of a rig file; it tells the unit.
    record, window
        number of the record, and of the window in it, of each node, shape (M,).
    time_s
        time in the record, shape (M,).
    value, deviation
        mean and standard deviation, shape (M,).
    of, at
        the variable of which it is most nearly a smooth function, and its values, shape (M,).
    explained
        share of the squares that such a function has, 0 to 1.
    """

    adds_to: str
    record: npt.NDArray[np.int64]
    window: npt.NDArray[np.int64]
    time_s: FloatArray
    value: FloatArray
    deviation: FloatArray
    of: str
    at: FloatArray
    explained: float


@dataclass(frozen=True)
class EquationShare:
    """How much an equation of the simulator asks for a term that it does not have.

    Attributes
    ----------
    equation
        its name, as in a table of a rig file.
    subsystem
        part of the machine to which its terms belong.
    share
        share of the gap, 0 to 1.
    gain
        logarithm of the evidence of smooth terms in this equation above none, nats.
    unknown_input
        the term over the time; None where the equation has a small share.
    """

    equation: str
    subsystem: str
    share: float
    gain: float
    unknown_input: UnknownInput | None = None


@dataclass(frozen=True)
class Where:
    """Where the structural gap lies.

    Attributes
    ----------
    subsystem
        share of each subsystem, with sum 1; empty where there is no structural gap, or where notes
        say that it could not be told.
    regimes, frequency, time
        shares of the calibrated gap above the noise floor; regimes have the largest share first,
        frequency and time are in their own order.
    equations
        what each equation lacks beside the rig without effects, largest share first.
    notes
        sentences: where this contradicts the selected effects, or what it rests on.
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
        id of the effect in the catalogue.
    probability
        that the machine has the effect: of all effects with 0.9, nine in ten are right.
    parameters
        estimates by the parameters' own names, in SI units.
    share_of_shrinkage
        share in the held-out gain of the whole set, from the set without this effect; the shares of
        all effects have the sum 1.
    """

    id: str
    probability: float
    parameters: Mapping[str, Estimate]
    share_of_shrinkage: float


StandingKind = Literal[
    "named", "equivalent", "sufficient", "not_needed", "too_small", "worse", "screened"
]


@dataclass(frozen=True)
class MissingLaw:
    """A term that an equation lacks, as a table over the variable that explains the gap best.

    Attributes
    ----------
    law
        equation, variable, knots and values, in SI units; it acts besides the named effects.
    band
        90 % interval of the value at each knot.
    visited
        share of the samples that are nearer to this knot than to any other.
    share_of_shrinkage
        share in the shrinkage of the held-out gap, from the calibrated rig to that with all effects
        and laws.
    looks_like
        its form in words, such as "falls 160 N per metre".
    rivals
        equations and variables of other laws that explain the gap nearly as well.
    form
        values at the knots of the simple form that `looks_like` names; None where none fits.
    """

    law: TableLaw
    band: tuple[tuple[float, float], ...]
    visited: tuple[float, ...]
    share_of_shrinkage: float
    looks_like: str
    rivals: tuple[tuple[str, str], ...] = ()
    form: tuple[float, ...] | None = None


@dataclass(frozen=True)
class Standing:
    """What the decision made of a candidate, and why.

    Attributes
    ----------
    kind
        "named": the best set; "equivalent": the data cannot separate it from the best set;
        "sufficient": the calibrated rig, where no effect is named; "not_needed": the data do not
        require it; "too_small": an effect is no larger than in every servo, or has sizes that no
        servo has; "worse": its errors on held-out data are larger; "screened": only a short fit was
        made.
    why
        the condition that decided, as a clause; empty where `kind` says all.
    """

    kind: StandingKind
    why: str


@dataclass(frozen=True)
class Candidate:
    """A set of effects that was fitted.

    Attributes
    ----------
    effects
        ids of the effects.
    score
        distance of the held-out log-likelihood from that of the first candidate, nats; 0 for the
        first.
    held_out_shrinkage
        share of the explainable gap that the set removes on held-out data, as in
        `HowFar.of_explainable`; negative where its errors are larger than those of the calibrated
        rig.
    parameters
        fitted parameters of the effects, by "id.parameter".
    in_confidence_set
        true where the data cannot separate the set from the best.
    fitted_cost, held_out_cost
        cost in nats: on the fitted records with the priors, and on the held-out records without
        them; known up to a constant of the record, less is better.
    free
        number of fitted values.
    standing
        what the decision made of the set.
    left, small, probability
        as in `decision.posterior.Hypothesis`; None for a set that the decision did not weigh,
        because one of its effects is too small or it got a short fit only.
    """

    effects: tuple[str, ...]
    score: float
    held_out_shrinkage: float
    parameters: Mapping[str, float]
    in_confidence_set: bool
    fitted_cost: float
    held_out_cost: float
    free: int
    standing: Standing
    left: float | None = None
    small: float | None = None
    probability: float | None = None


@dataclass(frozen=True)
class CannotJudge:
    """An effect that the records cannot show or exclude, and what they lack for it."""

    id: str
    why: str


@dataclass(frozen=True, eq=False)
class NextExperiment:
    """A command whose record separates candidates that the records so far do not.

    Attributes
    ----------
    separates
        candidates: the id of an effect, or the ids of a set joined with "+".
    record
        time_s and command_v, ready to be sent; position_m as the best candidate predicts it.
    description
        one line for the operator.
    power
        predicted probability that the diagnosis separates the candidates with this record.
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
    """Gaps on held-out data as the contract defines them: nrmse averaged over the outputs.

    Attributes
    ----------
    nominal, calibrated, augmented
        gap of the simulator as configured, with its values fitted, and with the selected effects.
    noise_floor
        lower and upper end of the noise floor, as nrmse.
    of_explainable
        (calibrated - augmented) / (calibrated - floor); None where nothing is above the floor.
    from_nominal
        (nominal - augmented) / nominal. Both shares are of these data; where effects are named,
        their intervals are for other motions of the machine.
    per_output
        the three gaps of each output.
    carries_over
        shrinkage as a share of the explainable gap, on the half of the held-out windows with the
        smaller commands and on the other half; None where there are too few windows, or where one
        half has no gap above the floor.
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
        value in the rig file, or the prior centre of a nuisance.
    found
        estimate of the fit, in the same unit.
    moved
        true where the move matters in size and in significance.
    in_sigmas
        `found` minus the centre of the prior that the fit used, in standard deviations of this
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
        name of the record (file stem).
    time_s
        time of the samples, s.
    window
        number of the simulation window, -1 where a sample is not compared.
    command_v
        command as logged, V.
    measured, nominal, calibrated, augmented
        measured and simulated signals by output.
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
class Interim:
    """What is known when a stage of a diagnosis begins; none of it is a result yet.

    Attributes
    ----------
    stage
        what is done now.
    runs
        held-out data, measured and simulated: as configured, with the values of the rig fitted,
        and with the set that is ahead so far.
    how_far
        the gaps of these simulations.
    ahead
        ids of the effects of the set that is ahead; none where the rig alone is.
    sets
        sets of effects that were fitted, each with the nrmse that it leaves on held-out data,
        smallest first.
    """

    stage: Stage
    runs: tuple[HeldOutRun, ...]
    how_far: HowFar
    ahead: tuple[str, ...]
    sets: tuple[tuple[tuple[str, ...], float], ...]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """All results of a diagnosis.

    Attributes
    ----------
    verdict
        one of the six verdicts.
    sentence
        the verdict in one plain sentence.
    reasons
        what the verdict rests on, one sentence each.
    where, effects, ambiguity_set, candidates, cannot_judge, next_experiment, how_far, calibration
        as the contract defines them; how_far is None where the data are insufficient.
    outside_probability
        that the cause is outside of the catalogue; None where the data are insufficient.
    missing_laws
        laws of a cause outside of the catalogue; empty where the catalogue suffices, or where no
        law can be told.
    remarks
        remarks of the gate on the data.
    runs
        held-out records beside their simulations.
    rig
        the rig as configured.
    augmented_rig
        the rig with the estimated values and effects.
    outputs, outputs_left_out
        outputs that were compared, and those that were not.
    records
        role of each record by its name: "fit", "held out" or "fit and held out".
    settings
        settings of the diagnosis by name.
    seconds
        duration of the diagnosis, s.
    """

    verdict: Verdict
    sentence: str
    reasons: tuple[str, ...]
    where: Where
    effects: tuple[FoundEffect, ...]
    ambiguity_set: tuple[tuple[str, ...], ...]
    candidates: tuple[Candidate, ...]
    cannot_judge: tuple[CannotJudge, ...]
    outside_probability: float | None
    missing_laws: tuple[MissingLaw, ...]
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

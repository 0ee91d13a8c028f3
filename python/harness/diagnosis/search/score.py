# SPDX-License-Identifier: MIT
"""What a hypothesis leaves of the gap, and what it costs: the one scale on which they compete.

The score of a set S of k laws (`law_count`), nats, is

    u(S) = -EVIDENCE left(S) - price(S) - k EFFECT - SMALL sum_i max(0, 1 - margin_i)

with the margin of an effect: ln of the factor by which it is larger than what every servo has, and
the price of the values of the rig. The search extends sets by it, and laws without a name earn
their place on it, both with values that cost nothing; the probabilities follow from it. The cost of
a fit, nats, only tells where a fit of one set ended lower.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np
import numpy.typing as npt

from ...base.numbers import FloatArray
from ...catalogue.families import CONTACT, law_count
from ...catalogue.spellings import ParameterKey
from .. import deciding
from ..deciding import EVIDENCE, LEAST_SHARE, OCTAVES_WITHIN, VALUES
from ..model.case import Case
from ..model.spectrum import OutputLikelihood
from .candidates import FittedCandidate
from .intervals import margin, matters

Data = Literal["all", "fitted", "held out"]

# A rod that touches something is free for this share of a record at least. Of nine machines of
# which a contact was thought, it was 0.19 and 0.26 on the two that have one, and 0.03 at most else.
LEAST_FREE = 0.05

# What a simulation that diverges leaves: more than any errors that are finite.
DIVERGED = math.log(sys.float_info.max)


def left(case: Case, candidate: FittedCandidate, data: Data = "all", share: float = 1.0) -> float:
    """Mean of ln(errors / tolerated errors) over all octaves, windows and outputs, >= 0.

        left = sum_b (n_b / 2) ln((P_b + t_b) / t_b) / sum_b n_b

    with the power P_b of the errors in band b, the tolerated power t_b and the number n_b of
    independent coefficients, over all outputs: the negative log-likelihood of `model.likelihood`,
    less that of a perfect simulator, for each independent error. A mean and not a sum, because
    errors of a model repeat. It is DIVERGED where a simulation diverges. data: which records or
    blocks count. share: of the tolerance, see `share_of_tolerance`.
    """
    cost, count = 0.0, 0.0
    for _, mean, likelihood in _by_output(case, candidate, data):
        narrowed = likelihood.narrowed(share)
        cost += narrowed.cost_of(mean) - narrowed.cost_of(np.zeros_like(mean))
        count += float(likelihood.counts.sum())
    return cost / count if math.isfinite(cost) else DIVERGED


def _by_output(
    case: Case, candidate: FittedCandidate, data: Data
) -> Iterator[tuple[str, FloatArray, OutputLikelihood]]:
    """Each output: name, mean power of the errors in each band, (BANDS,), and its likelihood."""
    for part, powers in (("fitted", candidate.fit_powers), ("held out", candidate.powers)):
        if data not in ("all", part):
            continue
        likelihoods = case.problem(held_out=part == "held out").likelihoods
        for by_band, (name, likelihood) in zip(
            powers.sum(axis=0), likelihoods.items(), strict=True
        ):
            yield name, by_band / np.maximum(likelihood.spectrum.sizes, 1.0), likelihood


def above_noise(case: Case, candidate: FittedCandidate, share: float = 1.0) -> float:
    """Returns what a candidate leaves beyond errors that are only the noise of the sensors.

    case, candidate, share: as of `left`. No set can leave much less than 0. Where motion hides the
    noise it does not count: it may be less than what is assumed.
    """
    by_noise, count = 0.0, 0.0
    for name, _, likelihood in _by_output(case, candidate, "all"):
        narrowed = likelihood.narrowed(share)
        noise = narrowed.tolerated - (0.0 if narrowed.of_motion is None else narrowed.of_motion)
        noise *= case.floors[name].seen
        by_noise += narrowed.cost_of(noise) - narrowed.cost_of(np.zeros_like(noise))
        count += float(likelihood.counts.sum())
    return left(case, candidate, share=share) - by_noise / count


def share_of_tolerance(case: Case, candidates: Sequence[FittedCandidate]) -> float:
    """Share of a tolerance that may be too large which the best candidate shows to be enough.

    It is that of a user's simulator, or of commands that nobody logged. In each band where it is
    above the noise, what the candidate leaves above the noise is compared with it; `OCTAVES_WITHIN`
    of all bands are within the share. 1 for our simulator on a log of all commands, and where the
    rig file states the tolerance.
    """
    stated = case.engine is not None and case.engine.runs.section.tolerance is not None
    if stated or (case.engine is None and not any(case.unknown.values())):
        return 1.0
    best = min(candidates, key=lambda candidate: left(case, candidate))
    shares: list[float] = []
    for _, mean, likelihood in _by_output(case, best, "all"):
        assert likelihood.of_motion is not None
        noise = likelihood.tolerated - likelihood.of_motion
        told = (likelihood.of_motion > noise) & (likelihood.counts > 0.0)
        above = np.maximum(mean - noise, 0.0)[told]
        shares += np.sqrt(above / likelihood.of_motion[told]).tolist()
    most = float(np.quantile(shares, OCTAVES_WITHIN)) if shares else 1.0
    return min(max(most, LEAST_SHARE), 1.0)


@dataclass(frozen=True)
class Price:
    """Prior cost of the values with which a set leaves what it leaves, nats."""

    anything: float
    """Where values of the rig file are wrong, and may be anything."""
    as_filed: float
    """Where they are right within their uncertainty."""

    @property
    def total(self) -> float:
        """The cost where nobody knows which of the two is so."""
        # total = -ln(exp(-anything) + exp(-as_filed))
        return -float(np.logaddexp(-self.anything, -self.as_filed))

    @property
    def differ(self) -> float:
        """Probability, 0 to 1, that values of the rig differ from the rig file."""
        return math.exp(self.total - self.anything)


NO_PRICE = Price(math.inf, 0.0)


def price_of_values(
    case: Case, freely: FittedCandidate, held: FittedCandidate, share: float = 1.0
) -> Price:
    """Prices the values of the rig, and what no data sheet gives.

        anything = VALUES + min(prior(nuisances, freely), VALUES)
        as_filed = EVIDENCE (left(held) - left(freely)) + prior(held)

    with prior = 1/2 sum ((x - centre) / sigma)^2. The fit `held` keeps to the rig file and to usual
    nuisances, and leaves more; `freely` does not. A wrong value in a rig file is no reason for an
    unusual valve: nuisances cost what their priors take there, too, VALUES at most. Where no fit
    keeps to the rig file, `freely` may take its place: the price is then not too low. share: as of
    `left`.
    """
    more = EVIDENCE * (left(case, held, share=share) - left(case, freely, share=share))
    unusual = _prior(case, freely, nuisances_only=True)
    return Price(VALUES + min(unusual, VALUES), more + _prior(case, held))


def _prior(case: Case, candidate: FittedCandidate, *, nuisances_only: bool = False) -> float:
    """1/2 sum ((x - centre) / sigma)^2, nats; sigma is infinite without a prior."""
    return 0.5 * math.fsum(
        ((x - each.centre) / each.sigma) ** 2
        for each, x in zip(case.parameters(candidate.effects), candidate.x, strict=False)
        if ParameterKey(each.name).is_nuisance or not nuisances_only
    )


@dataclass(frozen=True)
class Constants:
    """Constants of the equations; `deciding` has each by its name in capitals, with its reason.

    As one value, so that others can be put in their place.
    """

    evidence: float
    least_left: float
    effect: float
    small: float
    outside: float
    outside_beside: float
    outside_left: float
    outside_explained: float
    outside_position: float
    lapse: float


IN_USE = Constants(
    **{each.name: getattr(deciding, each.name.upper()) for each in fields(Constants)}
)


def score(
    left: npt.ArrayLike,
    laws: npt.ArrayLike,
    small: npt.ArrayLike,
    price: npt.ArrayLike = 0.0,
    constants: Constants = IN_USE,
) -> FloatArray:
    """Scores u(S), nats, of sets of so many laws; the arrays have one shape."""
    evidence = constants.evidence * np.asarray(left)
    prior = constants.effect * np.asarray(laws) + constants.small * np.asarray(small)
    # u(S) = -EVIDENCE left(S) - price(S) - k EFFECT - SMALL sum_i max(0, 1 - margin_i)
    return np.asarray(-evidence - np.asarray(price) - prior)


def smallness(case: Case, candidate: FittedCandidate) -> float:
    """Returns the sum over the effects of max(0, 1 - margin); each of them matters."""
    margins = (margin(effect, candidate.values, case.rig) for effect in candidate.effects)
    return sum((max(0.0, 1.0 - each) for each in margins), start=0.0)


def always_touches(case: Case, candidate: FittedCandidate) -> bool:
    """Whether the rod hardly ever leaves the contact of a candidate: it is a load spring then."""
    if CONTACT not in candidate.effects:
        return False
    touches_m = candidate.values[ParameterKey.of_effect(CONTACT, "position_m")]
    positions = (record.column("position_m") for record in case.records)
    return max(float(np.mean(position < touches_m)) for position in positions) < LEAST_FREE


def score_of(case: Case, candidate: FittedCandidate, share: float = 1.0) -> float:
    """Score u(S), nats, of a fitted set, with values that cost nothing.

    It is -inf where an effect is no larger than in every servo, or where the rod never leaves a
    contact.
    """
    if not all(matters(effect, candidate.values, case.rig) for effect in candidate.effects):
        return -math.inf
    if always_touches(case, candidate):
        return -math.inf
    laws = law_count(candidate.effects)
    return float(score(left(case, candidate, share=share), laws, smallness(case, candidate)))

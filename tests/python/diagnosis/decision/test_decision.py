# SPDX-License-Identifier: MIT
"""The answer that loses least, against all answers and the table of losses written out."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from made_candidates import candidate

from ehsid.harness.diagnosis import deciding
from ehsid.harness.diagnosis.deciding import TOLD
from ehsid.harness.diagnosis.decision.hypotheses import Hypothesis, Posterior, least_loss

SETS = (
    ("coulomb_friction",),
    ("stribeck_friction",),
    ("sensor_lag",),
    ("coulomb_friction", "sensor_lag"),
    ("stribeck_friction", "sensor_lag"),
    ("transport_delay",),
    ("valve_dead_band",),
    ("sensor_lag", "valve_dead_band"),
)
FITTED = {effects: candidate(*effects, rms=1e-6) for effects in ((), *SETS)}
# Of no effect, of each set, and of a cause outside of the catalogue.
WEIGHTS = st.lists(st.floats(0.0, 1.0), min_size=len(SETS) + 2, max_size=len(SETS) + 2).filter(
    lambda weights: sum(weights) > 0.01
)

# A truth or a set that is named: its effects, with all laws of friction as "friction".
Cause = frozenset[str] | str


def family(effects: tuple[str, ...]) -> frozenset[str]:
    laws = ("coulomb_friction", "stribeck_friction")
    return frozenset("friction" if each in laws else each for each in effects)


def loss(answer: str, named: tuple[Cause, ...], truth: Cause) -> float:
    """The table of the module, cell by cell; the truth is "healthy", "outside", or a set."""
    if answer == "healthy":
        return 0.0 if truth == "healthy" else deciding.MISSED
    if truth == "healthy":
        return deciding.FALSE_ALARM
    if answer == "outside":
        return 0.0 if truth == "outside" else deciding.NEEDLESS_OUTSIDE
    if answer == "ambiguous":
        if truth in named:
            return (len(named) - 1) * deciding.FURTHER_MEMBER
        return deciding.SET_WITHOUT_TRUTH
    if truth == named[0]:
        return 0.0
    if truth != "outside" and set(truth) & set(named[0]):
        return deciding.MISSED
    return deciding.WRONG_NAME


def of_set(effects: tuple[str, ...], probability: float) -> Hypothesis:
    return Hypothesis(
        "effects" if effects else "nothing",
        0.0,
        effects,
        FITTED[effects],
        probability=probability,
    )


def posterior_of(weights: list[float]) -> Posterior:
    total = sum(weights)
    shares = [weight / total for weight in weights]
    hypotheses = [of_set(*each) for each in zip(((), *SETS), shares, strict=False)]
    hypotheses.append(Hypothesis("outside", 0.0, probability=shares[-1]))
    return Posterior(tuple(sorted(hypotheses, key=lambda each: -each.probability)))


def expected_losses(found: Posterior) -> dict[tuple[str, frozenset[Cause]], float]:
    """The expected loss of every answer that can be given."""
    truths: dict[Cause, float] = {"outside": found.outside}
    for each in found.sets:
        truth: Cause = family(each.effects) or "healthy"
        truths[truth] = truths.get(truth, 0.0) + each.probability
    causes = [truth for truth in truths if not isinstance(truth, str)]
    answers = [("healthy", ()), ("outside", ()), *(("effects", (one,)) for one in causes)]
    for count in range(2, len(causes) + 1):
        answers += [("ambiguous", named) for named in itertools.combinations(causes, count)]
    return {
        (answer, frozenset(named)): sum(
            probability * loss(answer, named, truth) for truth, probability in truths.items()
        )
        for answer, named in answers
    }


# Both laws of friction together are the second most probable cause; neither of them alone is.
FRICTION_IN_SECOND_PLACE = [0.0, 0.15, 0.12, 0.18, 0.33, 0.04, 0.15, 0.0, 0.03, 0.0]


@given(weights=WEIGHTS)
@example(weights=FRICTION_IN_SECOND_PLACE)
def test_no_answer_loses_less(weights: list[float]) -> None:
    found = posterior_of(weights)
    answer, losses = least_loss(found), expected_losses(found)
    if found.healthy.probability < TOLD:
        del losses["healthy", frozenset()]
    assert answer.loss == pytest.approx(min(losses.values()), rel=1e-9, abs=1e-12)
    named = frozenset(each.families for each in answer.named)
    key = (answer.kind, frozenset() if answer.kind == "outside" else named)
    # The loss that it states is that of what it says.
    assert answer.loss == pytest.approx(losses[key], rel=1e-9, abs=1e-12)


@given(weights=WEIGHTS)
@example(weights=FRICTION_IN_SECOND_PLACE)
def test_sets_are_named_by_their_most_probable_law_most_probable_set_first(
    weights: list[float],
) -> None:
    found = posterior_of(weights)
    answer = least_loss(found)
    assert len({each.families for each in answer.named}) == len(answer.named)
    shares = []
    for named in answer.named:
        laws = [each for each in found.sets if each.families == named.families]
        assert named.probability == max(each.probability for each in laws)
        shares.append(sum(each.probability for each in laws))
    assert shares == sorted(shares, reverse=True)


def certain(**probabilities: float) -> Posterior:
    """No probability but these; "healthy" and "outside", or the id of an effect."""
    weights = [probabilities.get("healthy", 0.0)]
    weights += [probabilities.get("+".join(effects), 0.0) for effects in SETS]
    return posterior_of([*weights, probabilities.get("outside", 0.0)])


@pytest.mark.parametrize("effects", SETS, ids="+".join)
def test_a_certain_set_is_named(effects: tuple[str, ...]) -> None:
    answer = least_loss(certain(**{"+".join(effects): 1.0}))
    assert answer.kind == "effects"
    assert [each.effects for each in answer.named] == [effects]
    assert answer.loss == 0.0


def test_a_sound_machine_is_sound() -> None:
    answer = least_loss(certain(healthy=1.0))
    assert (answer.kind, answer.named, answer.loss) == ("healthy", (), 0.0)


def test_a_cause_that_nothing_explains_is_outside() -> None:
    answer = least_loss(certain(outside=1.0))
    assert (answer.kind, answer.loss) == ("outside", 0.0)


def test_of_two_equal_sets_none_is_named_alone() -> None:
    answer = least_loss(certain(sensor_lag=1.0, transport_delay=1.0))
    assert answer.kind == "ambiguous"
    assert {each.effects for each in answer.named} == {
        ("sensor_lag",),
        ("transport_delay",),
    }
    assert answer.loss == deciding.FURTHER_MEMBER


def test_two_laws_of_friction_are_no_ambiguity() -> None:
    answer = least_loss(certain(coulomb_friction=0.4, stribeck_friction=0.6))
    assert answer.kind == "effects"
    assert [each.effects for each in answer.named] == [("stribeck_friction",)]
    assert answer.loss == pytest.approx(0.0, abs=1e-12)


def test_no_missing_effect_is_no_answer_where_it_is_hardly_possible() -> None:
    """It loses least beside one set and a cause outside that are both likely, at 1 % for itself."""
    lag, nothing = of_set(("sensor_lag",), 0.61), of_set((), 0.01)
    found = Posterior((lag, Hypothesis("outside", 0.0, probability=0.38), nothing))
    answer, losses = least_loss(found), expected_losses(found)
    assert losses["healthy", frozenset()] < answer.loss
    assert answer.kind != "healthy"
    assert least_loss(certain(healthy=0.9, sensor_lag=0.1)).kind == "healthy"


@pytest.mark.parametrize("share", [0.099, 0.101])
def test_an_effect_is_named_beside_a_cause_outside_from_the_stated_probability_on(
    share: float,
) -> None:
    answer = least_loss(certain(sensor_lag=share, outside=1.0 - share))
    assert answer.kind == "outside"
    named = [each.effects for each in answer.named]
    assert named == ([("sensor_lag",)] if share >= TOLD else [])

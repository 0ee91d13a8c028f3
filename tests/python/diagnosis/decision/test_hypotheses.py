# SPDX-License-Identifier: MIT
"""Properties of the probabilities that hold whatever the values of their constants."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_candidates import CASE, FLOOR, LIKELIHOOD, MadeCase, candidate, search_result

from ehsid.harness.catalogue.families import (
    effect_families,
    friction_laws,
    law_count,
    repeats_a_law,
    spelled_out,
)
from ehsid.harness.diagnosis.deciding import (
    AGREES,
    EFFECT,
    EVIDENCE,
    LAPSE,
    LEAST_SHARE,
    SMALL,
    VALUES,
)
from ehsid.harness.diagnosis.decision import hypotheses
from ehsid.harness.diagnosis.decision.effect_selection import select_effects, standing
from ehsid.harness.diagnosis.decision.hypotheses import (
    SHOWN,
    Posterior,
    outside_score,
    posterior,
)
from ehsid.harness.diagnosis.model.case import Case
from ehsid.harness.diagnosis.model.spectrum import BANDS
from ehsid.harness.diagnosis.search.candidates import FittedCandidate
from ehsid.harness.diagnosis.search.refit import FittedToAll
from ehsid.harness.diagnosis.search.score import (
    IN_USE,
    always_touches,
    left,
    price_of_values,
    score,
    score_of,
    share_of_tolerance,
)

POSITION_ONLY = type("PositionOnly", (MadeCase,), {"pressures": False})
SETS = (
    ("coulomb_friction",),
    ("stribeck_friction",),
    ("sensor_lag",),
    ("transport_delay",),
    ("valve_dead_band", "coulomb_friction"),
    ("coulomb_friction", "sensor_lag"),
)
# From below the noise floor to a thousand times it.
RMS = st.floats(1e-8, 1e-3)
ALL_RMS = st.lists(RMS, min_size=len(SETS) + 1, max_size=len(SETS) + 1)
LEFT = st.floats(0.0, 10.0)


def candidates(sizes: list[float]) -> tuple[FittedCandidate, list[FittedCandidate]]:
    """The calibrated rig, and each of the sets."""
    calibrated = candidate(rms=sizes[0])
    return calibrated, [candidate(*s, rms=rms) for s, rms in zip(SETS, sizes[1:], strict=True)]


def by_set(found: Posterior) -> dict[tuple[str, ...], float]:
    return {each.effects: each.probability for each in found.sets}


@given(sizes=ALL_RMS, pressures=st.booleans())
def test_probabilities_are_those_of_all_there_is(sizes: list[float], pressures: bool) -> None:
    case = CASE if pressures else cast(Case, cast(Any, POSITION_ONLY()))
    found = posterior(case, *candidates(sizes))
    probabilities = [each.probability for each in found.hypotheses]
    assert math.fsum(probabilities) == pytest.approx(1.0, abs=1e-12)
    assert min(probabilities) >= 0.0
    assert probabilities == sorted(probabilities, reverse=True)
    assert set(by_set(found)) == {(), *SETS}
    assert (found.healthy.kind, found.healthy.effects) == ("nothing", ())


@given(sizes=ALL_RMS, data=st.data())
def test_the_order_of_the_sets_does_not_matter(sizes: list[float], data: st.DataObject) -> None:
    calibrated, fitted = candidates(sizes)
    shuffled = data.draw(st.permutations(fitted))
    first, second = (posterior(CASE, calibrated, each) for each in (fitted, shuffled))
    assert second.outside == pytest.approx(first.outside, rel=1e-9)
    assert by_set(second) == pytest.approx(by_set(first), rel=1e-9)


def test_effects_beside_which_a_cause_outside_is_seen_have_its_probability() -> None:
    found = posterior(CASE, *candidates([1e-6] * (len(SETS) + 1)))
    seen = found.with_evidence(3.0, ("sensor_lag",))
    assert seen.outside == found.with_evidence(3.0).outside > found.outside
    of_sets = sum(each.probability for each in seen.sets if "sensor_lag" in each.effects)
    assert seen.of_effect("sensor_lag") == pytest.approx(of_sets + seen.outside)


@given(sizes=ALL_RMS, law=st.floats(-3.0, 3.0), outside=st.floats(0.0, 3.0))
def test_a_small_gap_as_configured_speaks_for_nothing_missing_and_for_nothing_else(
    sizes: list[float], law: float, outside: float
) -> None:
    """A law, and further evidence, count as they do without it, in any order."""
    found = posterior(CASE, *candidates(sizes))
    agreed = found.with_agreement()

    def scores(of: Posterior) -> dict[tuple[str, tuple[str, ...]], float]:
        return {(each.kind, each.effects): each.score for each in of.hypotheses}

    more = scores(found.with_laws([(("sensor_lag",), law)]).with_evidence(outside))
    more["nothing", ()] += AGREES
    for after in (
        agreed.with_laws([(("sensor_lag",), law)]).with_evidence(outside),
        agreed.with_evidence(outside).with_laws([(("sensor_lag",), law)]),
    ):
        assert scores(after) == pytest.approx(more, rel=1e-12, abs=1e-12)
        assert (after.share, after.agreement) == (found.share, AGREES)
    assert agreed.healthy.probability >= found.healthy.probability


@given(less=LEFT, more=st.floats(1e-3, 5.0), effects=st.integers(0, 3), small=st.floats(0.0, 3.0))
def test_a_score_falls_with_errors_effects_and_doubtful_sizes(
    less: float, more: float, effects: int, small: float
) -> None:
    here = score(less, effects, small)
    assert score(less + more, effects, small) < here
    assert score(less, effects + 1, small) < here
    assert score(less, effects, small + more) <= here


@given(sizes=ALL_RMS)
def test_of_two_sets_alike_the_one_that_leaves_more_is_never_more_probable(
    sizes: list[float],
) -> None:
    found = posterior(CASE, *candidates(sizes)).sets
    for one in found:
        for other in found:
            is_alike = (
                law_count(one.effects) == law_count(other.effects) and one.small == other.small
            )
            if is_alike and one.left < other.left:
                assert one.probability >= other.probability


@given(best=LEFT, more=st.floats(1e-3, 5.0), explained=st.floats(0.0, 5.0), pressures=st.booleans())
def test_outside_grows_with_what_is_left(
    best: float, more: float, explained: float, pressures: bool
) -> None:
    """What is left beside the same best score, which explains as much of what was there."""
    less, greater = (
        outside_score(0.0, left, left + explained, pressures=pressures)
        for left in (best, best + more)
    )
    assert greater > less


def test_outside_is_as_probable_as_stated_alone_and_beside_effects() -> None:
    """Effects that explain something are the best set where it leaves less than the rig alone."""
    stated = replace(IN_USE, outside=1.0, outside_beside=3.0, outside_explained=0.0)
    alone, beside = (
        float(outside_score(0.0, 1.0, none, pressures=True, constants=stated))
        for none in (1.0, 2.0)
    )
    assert beside - alone == pytest.approx(2.0)


@given(rms=st.floats(1e-7, 1e-4), factor=st.floats(1.1, 10.0))
def test_a_rig_that_no_effect_helps_is_less_probable_the_more_it_leaves(
    rms: float, factor: float
) -> None:
    near, far = (posterior(CASE, candidate(rms=each), []) for each in (rms, rms * factor))
    assert far.outside > near.outside
    assert far.healthy.probability < near.healthy.probability


def test_an_effect_that_every_servo_has_is_no_hypothesis() -> None:
    small = candidate("transport_delay", rms=1e-6, **{"transport_delay.delay_s": 3e-4})
    large = candidate("transport_delay", rms=1e-6)
    calibrated = candidate(rms=1e-4)
    assert set(by_set(posterior(CASE, calibrated, [small]))) == {()}
    assert set(by_set(posterior(CASE, calibrated, [large]))) == {(), ("transport_delay",)}


def test_a_size_beyond_doubt_is_more_probable() -> None:
    """The same errors, once by a delay just above what every servo has, once by a large one."""
    found = []
    for delay_s in (1.1e-3, 5e-3):
        delay = candidate("transport_delay", rms=1e-5, **{"transport_delay.delay_s": delay_s})
        found.append(posterior(CASE, candidate(rms=1.1e-5), [delay]))
    doubtful, large = (each.of_effect("transport_delay") for each in found)
    assert doubtful <= large
    smalls = [one.small for each in found for one in each.sets if one.effects]
    assert smalls[1] == 0.0 < smalls[0]


@given(sizes=ALL_RMS)
def test_both_laws_of_friction_are_one_effect(sizes: list[float]) -> None:
    found = posterior(CASE, *candidates(sizes))
    probabilities = by_set(found)
    friction = sum(p for s, p in probabilities.items() if {*s} & {*SETS[0], *SETS[1]})
    for law in ("coulomb_friction", "stribeck_friction"):
        assert found.of_effect(law) == pytest.approx(friction, rel=1e-12)
    lag = probabilities[("sensor_lag",)] + probabilities[("coulomb_friction", "sensor_lag")]
    assert found.of_effect("sensor_lag") == pytest.approx(lag, rel=1e-12)


def test_families() -> None:
    assert effect_families(["coulomb_friction"]) == effect_families(["stribeck_friction"])
    assert effect_families(["coulomb_friction"]) != effect_families(["sensor_lag"])
    pairs = (["sensor_lag", "coulomb_friction"], ["stribeck_friction", "sensor_lag"])
    assert effect_families(pairs[0]) == effect_families(pairs[1])
    assert effect_families([]) == frozenset()
    # A cause outside of the catalogue is its own family.
    assert effect_families(["valve_stiction"]) == {"valve_stiction"}


def test_every_law_that_contains_coulomb_friction_is_friction() -> None:
    assert friction_laws() == {
        "coulomb_friction",
        "coulomb_friction_sides",
        "stribeck_friction",
        "position_friction",
    }


def test_unequal_overlaps_are_a_dead_band_and_a_null_bias() -> None:
    two = ("valve_dead_band", "valve_null_bias")
    assert spelled_out(["valve_dead_band_sides", "sensor_lag"]) == (*two, "sensor_lag")
    assert effect_families(["valve_dead_band_sides"]) == effect_families(two)
    assert effect_families(["valve_dead_band_sides"]) != effect_families(two[:1])
    assert law_count(["valve_dead_band_sides"]) == law_count(two) + 1


def test_friction_by_direction_is_coulomb_friction_and_a_constant_force() -> None:
    assert spelled_out(["coulomb_friction_sides"]) == ("coulomb_friction", "load_force")
    assert effect_families(["coulomb_friction_sides"]) == {"friction", "load_force"}
    assert law_count(["coulomb_friction_sides"]) == 3


def test_an_error_of_each_of_two_transducers_is_two_errors() -> None:
    assert law_count(["pressure_sensor_gain"]) == law_count(["pressure_sensor_offset"]) == 2
    assert law_count(["pressure_sensor_lag", "sensor_lag"]) == 2


def test_a_contact_counts_as_a_spring_over_the_whole_stroke() -> None:
    assert law_count(["contact_spring"]) == law_count(["load_spring"]) == 2


def test_a_set_has_no_law_twice() -> None:
    for effects in (
        ("stribeck_friction", "coulomb_friction"),
        ("stribeck_friction", "position_friction"),
        ("load_force", "load_spring"),
        ("valve_dead_band_sides", "valve_dead_band"),
        ("valve_dead_band_sides", "sensor_lag", "valve_null_bias"),
    ):
        assert repeats_a_law(effects), effects
    assert not repeats_a_law(("valve_dead_band", "valve_null_bias", "coulomb_friction"))
    assert not repeats_a_law(("load_spring", "position_friction", "valve_dead_band_sides"))


class _Record:
    dt_s = 1e-3

    def __init__(self, free: float) -> None:
        self._free = free

    def column(self, _name: str) -> Any:
        """Shares of a record below and above 0.1 m."""
        return np.where(np.arange(1000) < 1000 * self._free, 0.09, 0.11)


@pytest.mark.parametrize(("free", "touches"), [(0.04, True), (0.06, False)])
def test_a_contact_that_the_rod_never_leaves_is_a_load_spring(free: float, touches: bool) -> None:
    class Touching(MadeCase):
        records = (_Record(0.0), _Record(free))

    case = cast(Case, cast(Any, Touching()))
    values = {"contact_spring.position_m": 0.1, "contact_spring.stiffness_n_m": 1e6}
    contact = candidate("contact_spring", rms=1e-6, **values)
    found = search_result(candidate(rms=1e-4), contact)
    probabilities = posterior(case, found.calibrated, found.refined)
    assert (("contact_spring",) in by_set(probabilities)) == (not touches)
    assert (score_of(case, contact) == -math.inf) == touches
    told = standing(case, found, select_effects(found, probabilities), contact)
    assert ("a load spring then" in told.why) == touches
    # What touches nothing is not asked where the rod is.
    assert not always_touches(case, candidate("sensor_lag", rms=1e-6))


def test_errors_laws_and_small_effects_cost_what_the_formula_says() -> None:
    base = float(score(0.5, 1, 0.25))
    assert base - float(score(0.7, 1, 0.25)) == pytest.approx(0.2 * EVIDENCE, rel=1e-9)
    assert base - float(score(0.5, 2, 0.25)) == pytest.approx(EFFECT, rel=1e-9)
    assert base - float(score(0.5, 1, 1.0)) == pytest.approx(0.75 * SMALL, rel=1e-9)


def test_a_fitted_set_has_the_score_of_what_it_leaves_and_costs() -> None:
    pair = candidate("coulomb_friction", "sensor_lag", rms=5e-6)
    assert score_of(CASE, pair) == pytest.approx(float(score(left(CASE, pair), 2, 0.0)), rel=1e-12)
    small = candidate("transport_delay", rms=1e-6, **{"transport_delay.delay_s": 3e-4})
    assert score_of(CASE, small) == -math.inf


@pytest.mark.parametrize("evidence", [-3.0, 0.0, 2.0, 5.0, 1e5])
def test_a_law_without_a_name_competes_with_all_others(evidence: float) -> None:
    """It is a cause outside; no evidence takes the share LAPSE of the others away."""
    found = posterior(CASE, candidate(rms=1.5e-6), [])
    after = found.with_laws([((), evidence)])
    assert math.fsum(each.probability for each in after.hypotheses) == pytest.approx(1.0, rel=1e-12)
    (law,) = (each for each in after.hypotheses if each.kind == "law")
    # ln of the odds against the rig without effects, whose values cost next to nothing, less the
    # share LAPSE / K of K = 3.
    evidence += found.healthy.price.total
    here, healthy = (p - LAPSE / 3 for p in (law.probability, after.healthy.probability))
    assert healthy == pytest.approx(here * math.exp(-evidence), rel=1e-6, abs=1e-12)
    assert after.outside > law.probability


def test_an_effect_beside_a_law_is_as_probable_as_both_together() -> None:
    found = posterior(CASE, candidate(rms=1e-5), [candidate("coulomb_friction", rms=5e-6)])
    after = found.with_laws([(("coulomb_friction",), 40.0), ((), 40.0 - math.log(3.0))])
    laws = {each.effects: each.probability for each in after.hypotheses if each.kind == "law"}
    assert laws[("coulomb_friction",)] == pytest.approx(3.0 * laws[()], rel=0.1)
    expected = by_set(after)[("coulomb_friction",)] + laws[("coulomb_friction",)]
    for effect in ("coulomb_friction", "stribeck_friction"):  # one family
        assert after.of_effect(effect) == pytest.approx(expected, rel=1e-12)
    assert after.of_effect("sensor_lag") == 0.0


def moved(fit: FittedCandidate, deviations: float) -> FittedCandidate:
    """The fit with the first value so many deviations from the rig file."""
    x = fit.x.copy()
    x[0] = deviations
    return replace(fit, x=x)


@given(freely=st.floats(0.0, 30.0), more=st.floats(0.0, 30.0), deviations=st.floats(0.0, 4.0))
def test_values_cost_what_their_priors_and_errors_take_and_no_more_than_other_values_do(
    freely: float, more: float, deviations: float
) -> None:
    fits = candidate(rms=freely * FLOOR), candidate(rms=(freely + more) * FLOOR)
    gain = left(CASE, fits[1]) - left(CASE, fits[0])
    price = price_of_values(CASE, fits[0], moved(fits[1], deviations))
    by_file = math.exp(-EVIDENCE * gain - 0.5 * deviations**2)
    anything = math.exp(-VALUES)
    assert math.exp(-price.total) == pytest.approx(anything + by_file, rel=1e-9)
    assert price.differ == pytest.approx(anything / (anything + by_file), rel=1e-9)
    # How far the values of the free fit are is of no interest.
    assert price_of_values(CASE, moved(fits[0], 4.0), moved(fits[1], deviations)) == price


class _Unusual(MadeCase):
    def parameters(self, effects: Any = ()) -> Any:
        first, *others = super().parameters(effects)
        return (replace(first, name="nuisance.edge_gain_direction"), *others)


@pytest.mark.parametrize(("deviations", "cost"), [(2.0, 2.0), (3.0, 4.5), (4.0, VALUES)])
def test_an_unusual_servo_costs_what_its_priors_take_whatever_the_rig_file_says(
    deviations: float, cost: float
) -> None:
    case = cast(Case, cast(Any, _Unusual()))
    fit = candidate(rms=2.0 * FLOOR)
    unusual, wrong = moved(fit, deviations), fit.x.copy()
    wrong[1] = 30.0
    # As the rig file says, but for the nuisance.
    price = price_of_values(case, unusual, unusual)
    assert price.as_filed == pytest.approx(0.5 * deviations**2, rel=1e-12)
    assert price.anything == pytest.approx(VALUES + cost, rel=1e-12)
    # A wrong value in the file does not pay for the nuisance.
    both = replace(unusual, x=np.concatenate([unusual.x[:1], wrong[1:]]))
    assert price_of_values(case, both, both).total == pytest.approx(VALUES + cost, rel=1e-9)


def test_a_set_whose_values_are_those_of_the_rig_file_is_the_more_probable_one() -> None:
    far = moved(candidate("sensor_lag", rms=3.0 * FLOOR), 4.0)
    near = candidate("transport_delay", rms=3.0 * FLOOR)
    found = posterior(CASE, candidate(rms=1e3 * FLOOR), [far, near])
    # The share LAPSE / K of K = 4 hypotheses is that of all.
    odds = [by_set(found)[each.effects] - LAPSE / 4 for each in (near, far)]
    cost = -math.log(math.exp(-VALUES) + math.exp(-8.0))
    assert math.log(odds[0] / odds[1]) == pytest.approx(cost, abs=0.01)
    # A fit that keeps to the rig file and leaves as little takes the cost away.
    held = FittedToAll(far, moved(far, 0.0))
    again = by_set(posterior(CASE, candidate(rms=1e3 * FLOOR), [far, near], [held]))
    assert again[far.effects] == pytest.approx(again[near.effects], rel=1e-9)


def test_a_law_is_weighed_against_the_rig_whatever_its_values_cost() -> None:
    near, far = candidate(rms=3.0 * FLOOR), moved(candidate(rms=3.0 * FLOOR), 4.0)
    scores = []
    for calibrated in (near, far):
        after = posterior(CASE, calibrated, []).with_laws([((), 2.0)])
        (law,) = (each for each in after.hypotheses if each.kind == "law")
        scores.append(law.score)
    assert scores[0] == pytest.approx(scores[1], rel=1e-12)


def test_what_the_record_shows_leaves_the_share_of_a_lapse() -> None:
    assert pytest.approx(1.0 - LAPSE / 2) == SHOWN


class _WithSimulator(MadeCase):
    """A case of a user's simulator that counts as exact to 1,000 floors of the motion."""

    def __init__(self, tolerance: float | None = None) -> None:
        section = SimpleNamespace(tolerance=tolerance)
        self.engine = SimpleNamespace(runs=SimpleNamespace(section=section))

    def problem(self, *, held_out: bool = False) -> Any:
        of_motion = np.full(BANDS, (1e3 * FLOOR) ** 2)
        likelihood = replace(
            LIKELIHOOD, tolerated=LIKELIHOOD.tolerated + of_motion, of_motion=of_motion
        )
        return SimpleNamespace(likelihoods={"position_m": likelihood})


@pytest.mark.parametrize(("best", "share"), [(10.0, LEAST_SHARE), (500.0, 0.5), (2e3, 1.0)])
def test_a_set_that_leaves_less_than_the_tolerance_narrows_it(best: float, share: float) -> None:
    """The errors are white: above the noise every octave has the same."""
    case = cast(Case, cast(Any, _WithSimulator()))
    sets = [candidate(rms=3e3 * FLOOR), candidate("transport_delay", rms=best * FLOOR)]
    assert share_of_tolerance(case, sets) == pytest.approx(share, rel=1e-4)
    assert posterior(case, sets[0], sets[1:]).share == pytest.approx(share, rel=1e-4)
    # left = ln(1 + (e / t)^2) / 2 of each octave, with the tolerance t of this share.
    tolerated = 1.0 + (1e3 * share) ** 2
    expected = 0.5 * math.log1p(best**2 / tolerated)
    assert left(case, sets[1], share=share) == pytest.approx(expected, rel=1e-3)


def test_a_tolerance_that_the_rig_file_states_stays() -> None:
    case = cast(Case, cast(Any, _WithSimulator(tolerance=0.02)))
    assert share_of_tolerance(case, [candidate(rms=10.0 * FLOOR)]) == 1.0
    assert share_of_tolerance(CASE, [candidate(rms=10.0 * FLOOR)]) == 1.0


def test_effects_that_cannot_be_tried_count_less_the_more_is_explained(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Their nats times left(S*) / left(none), on the whole tolerance, are added to u(outside)."""
    case = cast(Case, cast(Any, _WithSimulator()))
    sets = [candidate(rms=3e3 * FLOOR), candidate("transport_delay", rms=700.0 * FLOOR)]
    ratio = left(case, sets[1]) / left(case, sets[0])

    def odds() -> float:
        found = posterior(case, sets[0], sets[1:])
        # LAPSE / K of the probability is spread over the K = 3 answers.
        best, outside = (p - LAPSE / 3 for p in (found.sets[0].probability, found.outside))
        return math.log(outside / best)

    without = odds()
    monkeypatch.setattr(hypotheses, "uncarried_odds", lambda rig: 2.0)
    assert odds() - without == pytest.approx(2.0 * ratio, rel=1e-9)


def test_what_a_set_leaves_with_its_values_fitted_to_all_data_counts() -> None:
    calibrated, lag = candidate(rms=30.0 * FLOOR), candidate("sensor_lag", rms=10.0 * FLOOR)
    delay = candidate("transport_delay", rms=10.0 * FLOOR)
    apart = posterior(CASE, calibrated, [lag, delay])
    of_all = candidate("sensor_lag", rms=5.0 * FLOOR)
    found = posterior(CASE, calibrated, [lag, delay], [FittedToAll(of_all, of_all)])
    assert by_set(found)[("sensor_lag",)] > by_set(apart)[("sensor_lag",)]
    (told,) = (each for each in found.sets if each.effects == ("sensor_lag",))
    # What is named is the fit to a part, whose errors on the other part are told.
    assert told.candidate is lag
    assert told.left == left(CASE, of_all)
    # The cause outside is judged by what all data leave as well.
    best = posterior(CASE, calibrated, [of_all, delay])
    assert found.outside == pytest.approx(best.outside, rel=1e-12)
    none = candidate(rms=20.0 * FLOOR)
    together = [FittedToAll(each, each) for each in (none, of_all)]
    found = posterior(CASE, calibrated, [lag, delay], together)
    assert found.healthy.left == left(CASE, none)
    assert found.outside == pytest.approx(posterior(CASE, none, [of_all, delay]).outside, rel=1e-12)

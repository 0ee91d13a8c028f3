# SPDX-License-Identifier: MIT
"""What the decision says of each candidate agrees with what it did."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from made_candidates import CASE, candidate, chosen, search_result
from msgspec.structs import replace

from ehsid.harness.diagnosis.deciding import LAPSE, WORSENED
from ehsid.harness.diagnosis.decision.effect_selection import (
    chance,
    standing,
)
from ehsid.harness.diagnosis.decision.results import caveats, worse_outputs
from ehsid.harness.diagnosis.schema import Gaps, HowFar, Value
from ehsid.harness.diagnosis.search.intervals import likelihood_gain

SETS = (
    ("coulomb_friction",),
    ("sensor_lag",),
    ("transport_delay",),
    ("valve_dead_band", "coulomb_friction"),
    ("coulomb_friction", "sensor_lag"),
)


def reduction(nominal: float, calibrated: float, augmented: float) -> HowFar:
    whole = Value(0.9, (0.8, 0.95))
    return HowFar(nominal, calibrated, augmented, (0.001, 0.0012), whole, whole, {})


# From the noise floor to a hundred times it.
SIZES = st.lists(st.floats(1.0e-6, 1.0e-4), min_size=len(SETS) + 1, max_size=len(SETS) + 1)


@given(SIZES)
def test_every_candidate_has_the_standing_that_the_selection_gave_it(sizes: list[float]) -> None:
    calibrated, fitted = (
        candidate(rms=max(sizes)),
        [candidate(*effects, rms=rms) for effects, rms in zip(SETS, sizes, strict=False)],
    )
    result = search_result(calibrated, *fitted)
    selection = chosen(result)
    kinds = {
        each.effects: standing(CASE, result, selection, each) for each in (calibrated, *fitted)
    }
    alone = "not_sufficient" if selection.answer.kind == "outside" else "sufficient"
    assert kinds[selection.best.effects].kind == ("named" if selection.best.effects else alone)
    equivalent = {other.effects for other in selection.equivalent}
    assert {effects for effects, said in kinds.items() if said.kind == "equivalent"} == equivalent
    for each in (calibrated, *fitted):
        said = kinds[each.effects]
        if said.kind in ("named", "sufficient", "not_sufficient"):
            continue
        # Each of the others has a reason, and "larger errors" is said of no better candidate.
        assert said.why
        gain = likelihood_gain(CASE, selection.best, each)
        if said.kind == "worse":
            assert gain.relative > 0.0
        if said.kind in ("not_needed", "improbable"):
            assert gain.relative <= 0.0
        hypothesis = selection.hypothesis(each)
        assert (said.kind == "too_small") == (hypothesis is None)
        if hypothesis is not None:
            assert chance(hypothesis.probability) in said.why


@pytest.mark.slow
@given(SIZES)
def test_a_better_candidate_that_is_not_named_is_explained(sizes: list[float]) -> None:
    # Of candidates with the same errors either may come first.
    assume(len(set(sizes)) == len(sizes))
    calibrated, fitted = (
        candidate(rms=1.01 * max(sizes)),
        [candidate(*effects, rms=rms) for effects, rms in zip(SETS, sizes, strict=False)],
    )
    result = search_result(calibrated, *fitted)
    selection = chosen(result)
    sentences = caveats(CASE, result, selection, reduction(0.3, 0.2, 0.1))
    first = result.refined[0]
    listed = (selection.best, *selection.equivalent)
    is_unnamed = first.held_out_cost < selection.best.held_out_cost and first not in listed
    said = [sentence for sentence in sentences if "smallest errors" in sentence]
    assert len(said) == is_unnamed
    assert all("is not named: " in sentence and sentence.endswith(".") for sentence in said)


@pytest.mark.parametrize(
    ("rms", "effects", "sizes", "kind", "why"),
    [
        (0.9e-7, ("coulomb_friction", "sensor_lag"), {}, "not_needed", "do not outweigh"),
        (1.01e-7, ("sensor_lag",), {}, "equivalent", "its probability is "),
        (5.0e-5, ("sensor_lag",), {}, "worse", "times as large; its probability is"),
        (
            0.5e-7,
            ("transport_delay",),
            {"transport_delay.delay_s": 3e-4},
            "too_small",
            "transport delay of this size is part of every servo",
        ),
        (
            0.5e-7,
            ("stribeck_friction",),
            {
                "stribeck_friction.coulomb_n": 583.4,
                "stribeck_friction.static_n": 23272.6,
                "stribeck_friction.stribeck_velocity_m_s": 1e-4,
            },
            "too_small",
            "no servo has Stribeck friction of these sizes (force at high speed 583.4 N, force at "
            "rest 23273 N, Stribeck velocity 0.0001 m/s), and Coulomb friction, which it contains, "
            "is judged by itself; the limits are: seals have friction",
        ),
        (
            0.5e-7,
            ("stribeck_friction",),
            {"stribeck_friction.coulomb_n": 583.0, "stribeck_friction.static_n": 600.0},
            "too_small",
            "Stribeck friction differs from Coulomb friction by no more than in every servo",
        ),
        (
            0.5e-7,
            ("stribeck_friction",),
            {"stribeck_friction.coulomb_n": 0.1, "stribeck_friction.static_n": 0.2},
            "too_small",
            "Stribeck friction of this size is part of every servo",
        ),
    ],
)
def test_reasons(
    rms: float, effects: tuple[str, ...], sizes: dict[str, float], kind: str, why: str
) -> None:
    """Beside Coulomb friction, whose errors are a tenth of the noise floor."""
    other = candidate(*effects, rms=rms, **sizes)
    calibrated = candidate(rms=1e-4)
    result = search_result(calibrated, candidate("coulomb_friction", rms=1e-7), other)
    selection = chosen(result)
    said = standing(CASE, result, selection, other)
    assert said.kind == kind
    assert why in said.why


def test_a_large_share_without_a_name_is_explained() -> None:
    """A delay of 0.3 ms is part of every servo, but here it removes most of the gap."""
    small = candidate("transport_delay", rms=1e-5, **{"transport_delay.delay_s": 3e-4})
    less_small = candidate("sensor_lag", rms=2e-5, **{"sensor_lag.time_constant_s": 1e-4})
    result = search_result(candidate(rms=1e-4), small, less_small)
    selection = chosen(result)
    assert selection.best.effects == ()
    first, second = caveats(CASE, result, selection, reduction(0.1, 0.1, 0.1))
    assert "transport delay, is not named: transport delay of this size" in first
    assert "sensor lag would remove 81 % of the gap" in second


def test_a_calibration_that_is_worse_than_the_rig_file_is_said() -> None:
    result = search_result(candidate(rms=1e-5))
    selection = chosen(result)
    (sentence,) = caveats(CASE, result, selection, reduction(0.405, 0.538, 0.538))
    assert "54 % in place of 40 %" in sentence or "54 % in place of 41 %" in sentence
    assert "Values are fitted to some data and judged by others; the cause of the gap" in sentence
    assert caveats(CASE, result, selection, reduction(0.405, 0.41, 0.41)) == ()
    # Below the noise floor a change says nothing.
    assert caveats(CASE, result, selection, reduction(0.0005, 0.001, 0.001)) == ()


def test_a_missing_effect_is_the_reason_why_the_calibration_is_worse() -> None:
    result = search_result(candidate(rms=1e-4), candidate("coulomb_friction", rms=1e-7))
    selection = chosen(result)
    (sentence,) = caveats(CASE, result, selection, reduction(0.18, 0.28, 0.005))
    assert (
        "without Coulomb friction the fit makes the values of the rig stand in for it" in sentence
    )


def test_values_at_an_end_of_their_range_are_said() -> None:
    calibrated = candidate(rms=1e-5)
    calibrated.x[[3, 7]] = -4.0, 4.0
    result = search_result(calibrated)
    low, high = caveats(CASE, result, chosen(result), reduction(0.1, 0.001, 0.001))
    assert low.startswith("load.value_3 = -4 is at the lower end of what the uncertainty")
    assert high.startswith("load.value_7 = 4 is at the upper end of what the uncertainty")
    effect = candidate("sensor_lag", rms=1e-6)
    effect.x[20] = 4.0
    result = search_result(candidate(rms=1e-4), effect)
    (sentence,) = caveats(CASE, result, chosen(result), reduction(0.1, 0.1, 0.001))
    assert sentence.startswith("effects.sensor_lag.size = 4 is at the upper end of the range of")
    assert np.all(np.abs(calibrated.x) <= 4.0)


def test_a_cause_that_is_not_excluded_is_said() -> None:
    # 1.5 times the floor leaves ln(1 + 1.5^2) / 2 = 0.59, where sound machines and others meet.
    result = search_result(candidate(rms=1.5e-6))
    selection = chosen(result)
    assert selection.answer.kind == "healthy"
    assert 0.2 < selection.posterior.outside < 0.8
    (sentence,) = caveats(CASE, result, selection, reduction(0.1, 0.1, 0.1))
    assert f"its probability is {chance(selection.posterior.outside)}" in sentence
    sound = search_result(candidate(rms=0.3e-6))
    assert caveats(CASE, sound, chosen(sound), reduction(0.1, 0.1, 0.1)) == ()


def test_beside_a_cause_outside_no_set_is_sufficient_and_an_improbable_one_has_its_reason() -> None:
    lag = candidate("sensor_lag", rms=0.9e-4)
    calibrated = candidate(rms=1e-4)
    result = search_result(calibrated, lag)
    selection = chosen(result)
    assert (selection.answer.kind, selection.best) == ("outside", calibrated)
    assert standing(CASE, result, selection, calibrated).kind == "not_sufficient"
    said = standing(CASE, result, selection, lag)
    assert (said.kind, said.why.endswith("below 10 % a name is a guess")) == ("improbable", True)


def test_an_output_that_the_found_values_make_worse_is_said() -> None:
    result = search_result(candidate(rms=0.3e-6))
    selection = chosen(result)
    gaps = {"position_m": Gaps(0.01, 0.04, 0.04), "pressure_a_pa": Gaps(0.3, 0.1, 0.1)}
    of_all = replace(reduction(0.155, 0.07, 0.07), gaps=gaps)
    (sentence,) = caveats(CASE, result, selection, of_all)
    assert sentence.startswith("position_m gets worse: its gap on held-out data is 4.0 % in place")
    assert worse_outputs(of_all) == ("position_m",)
    further = selection.posterior.with_evidence(WORSENED)
    # ln of the odds, without the share of a lapse, grows by what WORSENED says.
    before, after = (
        math.log((each.outside - LAPSE / 2) / (each.healthy.probability - LAPSE / 2))
        for each in (selection.posterior, further)
    )
    assert after - before == pytest.approx(WORSENED, rel=1e-9)
    smaller = {**gaps, "position_m": Gaps(0.01, 0.04, 0.0105)}
    assert caveats(CASE, result, selection, replace(of_all, gaps=smaller)) == ()

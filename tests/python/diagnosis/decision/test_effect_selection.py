# SPDX-License-Identifier: MIT
"""Selection of effects and verdict, with candidates made by hand, whose errors are known.

Errors are either far below the noise floor or far above it, so that no test depends on the values
of the constants of the probabilities.
"""

from __future__ import annotations

import math
from typing import cast

import pytest
from made_candidates import CASE, FLOOR, MadeCase, candidate, chosen, search_result
from msgspec.structs import replace

from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.diagnosis.deciding import VALUES
from ehsid.harness.diagnosis.decision.effect_selection import (
    chance,
    in_words,
    percent,
)
from ehsid.harness.diagnosis.decision.results import selected_effects
from ehsid.harness.diagnosis.decision.verdict import Decision, decide
from ehsid.harness.diagnosis.model.case import Case
from ehsid.harness.diagnosis.schema import Calibrated, Estimate, HowFar, Value
from ehsid.harness.diagnosis.search.candidates import FittedCandidate
from ehsid.harness.diagnosis.search.search import SearchResult

# Errors that noise hides, and a gap of a hundred and of a thousand noise floors.
HIDDEN, GAP, LARGE_GAP = 0.1 * FLOOR, 100.0 * FLOOR, 1000.0 * FLOOR


def test_the_effect_that_explains_the_records_is_selected() -> None:
    selection = chosen(
        search_result(
            candidate(rms=GAP),
            candidate("coulomb_friction", rms=HIDDEN),
            candidate("valve_dead_band", rms=0.5 * GAP),
        ),
    )
    assert selection.best.effects == ("coulomb_friction",)
    assert selection.equivalent == ()
    assert selection.answer.kind == "effects"


def test_equivalent_candidates_are_all_returned() -> None:
    selection = chosen(
        search_result(
            candidate(rms=GAP),
            candidate("transport_delay", rms=HIDDEN),
            candidate("sensor_lag", rms=1.01 * HIDDEN),
            candidate("valve_dead_band", rms=0.9 * GAP),
        ),
    )
    assert selection.best.effects == ("transport_delay",)
    assert [candidate.effects for candidate in selection.equivalent] == [("sensor_lag",)]


def test_no_effect_is_selected_without_a_gain() -> None:
    selection = chosen(
        search_result(candidate(rms=HIDDEN), candidate("coulomb_friction", rms=0.9 * HIDDEN))
    )
    assert selection.best.effects == ()
    assert selection.answer.kind == "healthy"


def test_a_second_effect_needs_a_large_gain() -> None:
    pair = ("coulomb_friction", "sensor_lag")
    small_gain = chosen(
        search_result(
            candidate(rms=GAP),
            candidate("coulomb_friction", rms=HIDDEN),
            candidate(*pair, rms=0.9 * HIDDEN),
        ),
    )
    assert small_gain.best.effects == ("coulomb_friction",)
    large_gain = chosen(
        search_result(
            candidate(rms=LARGE_GAP),
            candidate("coulomb_friction", rms=GAP),
            candidate(*pair, rms=HIDDEN),
        ),
    )
    assert large_gain.best.effects == pair


def test_a_pair_is_selected_where_neither_effect_alone_gains() -> None:
    pair = ("valve_dead_band", "coulomb_friction")
    selection = chosen(
        search_result(
            candidate(rms=GAP),
            candidate("coulomb_friction", rms=0.99 * GAP),
            candidate(*pair, rms=HIDDEN),
        ),
    )
    assert selection.best.effects == pair


def test_two_laws_of_friction_that_fit_alike_are_one_answer() -> None:
    """Stribeck friction contains the other law, and has to be worth its name."""
    for first, second, law in (
        (HIDDEN, 10.0 * FLOOR, "stribeck_friction"),
        (HIDDEN, HIDDEN, "coulomb_friction"),
        (0.9 * HIDDEN, HIDDEN, "coulomb_friction"),
    ):
        selection = chosen(
            search_result(
                candidate(rms=GAP),
                candidate("stribeck_friction", rms=first, parameters=3),
                candidate("coulomb_friction", rms=second),
            ),
        )
        assert selection.best.effects == (law,)
        assert selection.equivalent == ()


def test_sizes_that_every_servo_has_are_not_selected() -> None:
    small = candidate("transport_delay", rms=HIDDEN, **{"transport_delay.delay_s": 3e-4})
    result = search_result(candidate(rms=GAP), small)
    selection = chosen(result)
    assert selection.best.effects == ()
    assert selection.hypothesis(small) is None
    assert selection.hypothesis(result.calibrated) is not None


def _reduction(
    nominal: float, calibrated: float, augmented: float, floor: float = 0.0012
) -> HowFar:
    whole = Value(0.9, (0.8, 0.95))
    share = (nominal - augmented) / nominal
    from_nominal = Value(share, (share - 0.02, share + 0.02))
    return HowFar(nominal, calibrated, augmented, (0.9 * floor, floor), whole, from_nominal, {})


def _decided(
    result: SearchResult,
    reduction: HowFar,
    calibration: dict[str, Calibrated],
    step: Estimate | None = None,
) -> Decision:
    return decide(CASE, result, chosen(result), reduction, calibration, (), step)


def _with_value(rms: float, deviations: float, *effects: str) -> FittedCandidate:
    """A candidate with a value of the rig so many deviations from the rig file."""
    made = candidate(*effects, rms=rms)
    made.x[0] = deviations
    return made


def _moved(moved: bool) -> dict[str, Calibrated]:
    return {"load.mass_kg": Calibrated(120.0, 150.0, (148.0, 152.0), moved)}


@pytest.mark.parametrize(
    ("calibrated_m", "candidates", "moved", "verdict"),
    [
        (GAP, [candidate("sensor_lag", rms=HIDDEN)], False, "effects"),
        (
            GAP,
            [candidate("sensor_lag", rms=HIDDEN), candidate("transport_delay", rms=1.01 * HIDDEN)],
            False,
            "ambiguous",
        ),
        (
            GAP,
            [
                candidate("stribeck_friction", rms=HIDDEN),
                candidate("coulomb_friction", rms=1.01 * HIDDEN),
            ],
            False,
            "effects",
        ),
        (LARGE_GAP, [candidate("sensor_lag", rms=0.99 * LARGE_GAP)], False, "outside_catalogue"),
        (LARGE_GAP, [], True, "outside_catalogue"),
        (HIDDEN, [], True, "parameters"),
        (HIDDEN, [_with_value(HIDDEN, 3.5, "sensor_lag")], True, "parameters"),
        # An effect beside values of the rig file is more probable than other values.
        (HIDDEN, [candidate("sensor_lag", rms=HIDDEN)], True, "effects"),
    ],
)
def test_verdicts(
    calibrated_m: float, candidates: list[FittedCandidate], moved: bool, verdict: str
) -> None:
    result = search_result(_with_value(calibrated_m, 3.5 if moved else 0.0), *candidates)
    decision = _decided(result, _reduction(0.5, 0.1, 0.01), _moved(moved))
    assert decision.verdict == verdict
    assert decision.sentence.endswith(".")
    assert decision.reasons
    assert all(reason.endswith(".") for reason in decision.reasons)


def test_values_within_their_uncertainty_are_no_parameter_gap() -> None:
    """A value has moved: once a little less and once a little more than costs VALUES."""
    for share, verdict in ((0.9, "no_gap"), (1.1, "parameters")):
        # 1/2 deviations^2 is the cost of the prior.
        result = search_result(_with_value(0.0, math.sqrt(2.0 * share * VALUES)))
        decision = _decided(result, _reduction(0.04, 0.001, 0.001), _moved(True))
        assert decision.verdict == verdict


def test_values_that_moved_are_told_though_others_within_their_uncertainty_do_as_well() -> None:
    within = "Values within the uncertainty that the rig file states do nearly as well."
    for deviations, is_within in ((1.5, True), (3.5, False)):
        result = search_result(_with_value(HIDDEN, deviations))
        decision = _decided(result, _reduction(0.5, 0.001, 0.001), _moved(True))
        assert decision.verdict == "parameters"
        assert "differ from the rig file: load.mass_kg 150 (file 120)." in decision.sentence
        assert (within in decision.reasons) == is_within


@pytest.mark.parametrize(
    ("nominal", "calibrated", "floor", "verdict", "told"),
    [
        # The configured simulator is near the floor, or its gap is small.
        (0.013, 0.006, 0.005, "no_gap", "The simulator agrees with the machine."),
        (0.13, 0.06, 0.05, "no_gap", "The simulator agrees with the machine."),
        (
            0.04,
            0.001,
            0.001,
            "no_gap",
            "Its gap of 4.0 % is small, and fitted values leave 0.10 %.",
        ),
        # Nothing makes the gap smaller; what stays is said.
        (0.055, 0.060, 0.006, "no_gap", "make the gap of 5.5 % clearly smaller. A gap of 5.5 % s"),
        (0.40, 0.32, 0.05, "no_gap", "make the gap of 40 % clearly smaller. A gap of 32 % stays"),
        # The fit takes it away, within the uncertainty of all values.
        (0.13, 0.026, 0.014, "parameters", "take the gap from 13 % to 2.6 %."),
        (0.17, 0.0015, 0.0009, "parameters", "take the gap from 17 % to 0.15 %."),
        (0.17, 0.030, 0.005, "parameters", "to 3.0 %. A gap of 3.0 % stays above the noise floor"),
    ],
)
def test_no_gap_is_told_only_near_the_floor_or_where_nothing_makes_it_smaller(
    nominal: float, calibrated: float, floor: float, verdict: str, told: str
) -> None:
    for deviations in (0.0, 3.5):
        result = search_result(_with_value(HIDDEN, deviations))
        reduction = _reduction(nominal, calibrated, calibrated, floor)
        decision = _decided(result, reduction, _moved(False))
        assert decision.verdict == verdict
        assert told in decision.sentence
        assert "No effect is missing" not in decision.sentence


@pytest.mark.parametrize(
    ("missing", "rms", "told"),
    [
        (True, HIDDEN, "Commands that the log does not have can cause most of it."),
        (False, HIDDEN, "No further effect of the catalogue explains it."),
        # Of what stays, such commands cannot cause more than half.
        (True, 1.5 * FLOOR, "The cause is open"),
    ],
)
def test_what_commands_can_cause_that_nobody_logged_is_said(
    missing: bool, rms: float, told: str
) -> None:
    made = MadeCase()
    made.commands_are_missing = missing
    result = search_result(candidate(rms=rms))
    reduction = _reduction(0.17, 0.030, 0.030, 0.005)
    selection = chosen(result)
    decision = decide(cast(Case, made), result, selection, reduction, _moved(False), ())
    stays = "A gap of 3.0 % stays above the noise floor of 0.45 % to 0.50 %."
    assert stays in decision.sentence
    assert decision.sentence.split(stays)[1].strip().startswith(told)
    for word in ("Commands", "No further effect"):
        assert (word in decision.sentence) == told.startswith(word)


def test_a_bound_of_the_noise_as_large_as_the_motion_is_no_agreement() -> None:
    """Fitted values that leave less show that the noise is no larger."""
    wide = replace(_reduction(0.25, 0.008, 0.008), noise_floor=(0.006, 1.2))
    decision = _decided(search_result(_with_value(HIDDEN, 0.0)), wide, _moved(False))
    assert decision.verdict == "parameters"
    assert "take the gap from 25 % to 0.80 %." in decision.sentence
    # Where as much stays as the bound says, it may be noise.
    noisy = replace(_reduction(0.25, 0.2, 0.2), noise_floor=(0.006, 1.2))
    decision = _decided(search_result(_with_value(HIDDEN, 0.0)), noisy, _moved(False))
    assert decision.verdict == "no_gap"
    assert decision.sentence.startswith("The simulator agrees with the machine.")


# Errors, in noise floors, with which nothing, one cause and another are about as probable.
DOUBT = 1.8


@pytest.mark.parametrize(
    ("selected", "told"),
    [
        (
            False,
            ["from 50 % to 10 %: load.mass_kg", "The cause is open", "no missing"],
        ),
        (True, ["valve dead band alone (", "valve dead band and Coulomb friction ("]),
    ],
)
def test_the_first_sentence_says_what_the_probabilities_say(
    selected: bool, told: list[str]
) -> None:
    if selected:
        fits = [
            candidate(rms=LARGE_GAP),
            candidate("valve_dead_band", rms=0.32 * FLOOR),
            candidate("valve_dead_band", "coulomb_friction", rms=HIDDEN),
        ]
    else:
        fits = [_with_value(DOUBT * FLOOR, 3.5)]
    result = search_result(*fits)
    selection = chosen(result)
    assert selection.answer.kind == ("effects" if selected else "healthy")
    assert selection.is_open
    assert [each.effects for each in selection.rivals] == (
        [("valve_dead_band", "coulomb_friction")] if selected else []
    )
    decision = _decided(result, _reduction(0.5, 0.1, 0.1), _moved(True))
    for words in told:
        assert words in decision.sentence
    assert "No effect is missing" not in decision.sentence
    assert "A gap of 10 % stays above the noise floor of 0.11 % to 0.12 %." in decision.sentence


@pytest.mark.parametrize(
    ("ends", "told", "check"),
    [
        ({}, "", ""),
        ({3: -4.0}, "load.value_3 = -4 is at the lower end of what", "check this value on"),
        (
            {3: -4.0, 7: 4.0},
            "load.value_3 = -4 is at the lower end and load.value_7 = 4 is at the upper end of",
            "check these values on the machine",
        ),
    ],
)
def test_the_first_sentence_says_which_value_is_not_to_trust(
    ends: dict[int, float], told: str, check: str
) -> None:
    fitted = _with_value(HIDDEN, 3.5)
    for index, x in ends.items():
        fitted.x[index] = x
    result = search_result(fitted)
    reduction = _reduction(0.5, 0.001, 0.001)
    decision = _decided(result, reduction, _moved(True))
    assert decision.verdict == "parameters"
    first, _, _ = decision.sentence.partition(". ")
    assert told in first
    assert check in first
    assert ("No effect is missing" in first) == (not ends)
    assert "may be something else" in first or not ends
    assert "(file " in decision.sentence


def test_a_coarse_sensor_is_the_effect_where_nothing_else_is() -> None:
    result = search_result(candidate(rms=HIDDEN))
    step = Estimate(1e-5, 0.9e-5, 1.1e-5)
    decision = _decided(result, _reduction(0.1, 0.001, 0.001), {}, step)
    assert decision.verdict == "effects"
    assert "steps of 1e-05 m" in decision.sentence


def test_sets_in_words() -> None:
    assert in_words(["coulomb_friction"]) == "Coulomb friction"
    assert (
        in_words(["load_spring", "sensor_lag", "valve_lag"])
        == "load spring, sensor lag and valve lag"
    )


def test_shares_and_probabilities_in_words() -> None:
    assert [percent(each) for each in (0.0123, 0.123, 0.9949, 0.9951, 1.52)] == [
        "1.2 %",
        "12 %",
        "99 %",
        "100 %",
        "152 %",
    ]
    assert [chance(each) for each in (0.0, 9e-4, 0.012, 0.5, 0.98, 0.995, 1.0)] == [
        "less than 0.1 %",
        "less than 0.1 %",
        "1.2 %",
        "50 %",
        "98 %",
        "more than 99 %",
        "more than 99 %",
    ]


def test_the_effect_that_most_sets_have_is_named_first() -> None:
    """Delay or dead band beside a lag of the sensor: that lag is the surest of the three."""
    found = search_result(
        candidate(rms=LARGE_GAP),
        candidate("transport_delay", "sensor_lag", rms=HIDDEN),
        candidate("valve_dead_band", "sensor_lag", rms=HIDDEN),
    )
    selection = chosen(found)
    assert set(selection.best.effects) == {"transport_delay", "sensor_lag"}
    named = selected_effects(CASE, found, selection, {})
    assert [effect.id for effect in named] == ["sensor_lag", "transport_delay"]
    assert named[0].probability > named[1].probability
    # Without another set both are as probable, and the order of the search stays.
    pair = candidate("transport_delay", "sensor_lag", rms=HIDDEN)
    alone = search_result(candidate(rms=LARGE_GAP), pair)
    selection = chosen(alone)
    named = selected_effects(CASE, alone, selection, {})
    assert [effect.id for effect in named] == list(selection.best.effects)


def test_every_effect_reads_as_words() -> None:
    assert in_words(["coulomb_friction_sides"]) == "Coulomb friction by direction"
    for effect in catalogue():
        words = in_words([effect])
        assert "_" not in words
        assert "sides" not in words

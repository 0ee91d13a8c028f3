# SPDX-License-Identifier: MIT
"""Selection of effects and verdict, with candidates made by hand, whose errors are known."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType
from typing import Any, cast

import numpy as np
import pytest
from made_candidates import CASE, FLOOR, VARIATION, MadeCase, candidate, search_result

from ehsid.harness.gap.data.floor import NoiseFloor
from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.effect_selection import (
    effect_families,
    is_justified,
    is_significant,
    objection,
    select_effects,
)
from ehsid.harness.gap.inference.likelihood_gain import likelihood_gain
from ehsid.harness.gap.inference.verdict import decide
from ehsid.harness.gap.inference.words import in_words
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.schema import CalibratedValue, Estimate, HowFar


def test_the_effect_that_explains_the_records_is_selected() -> None:
    selection = select_effects(
        CASE,
        search_result(
            candidate(rms=1e-4),
            candidate("coulomb_friction", rms=2e-6),
            candidate("valve_dead_band", rms=4e-5),
        ),
    )
    assert selection.best.effects == ("coulomb_friction",)
    assert selection.equivalent == ()


def test_equivalent_candidates_are_all_returned() -> None:
    selection = select_effects(
        CASE,
        search_result(
            candidate(rms=1e-4),
            candidate("transport_delay", rms=2.00e-6),
            candidate("sensor_lag", rms=2.02e-6),
            candidate("valve_dead_band", rms=9e-5),
        ),
    )
    assert selection.best.effects == ("transport_delay",)
    assert [candidate.effects for candidate in selection.equivalent] == [("sensor_lag",)]


def test_no_effect_is_selected_without_a_gain() -> None:
    selection = select_effects(
        CASE, search_result(candidate(rms=2e-6), candidate("coulomb_friction", rms=1.98e-6))
    )
    assert selection.best.effects == ()


def test_a_second_effect_needs_a_large_gain() -> None:
    single, pair = candidate("coulomb_friction", rms=2e-5), ("coulomb_friction", "sensor_lag")
    small_gain = select_effects(
        CASE, search_result(candidate(rms=1e-4), single, candidate(*pair, rms=1.95e-5))
    )
    assert small_gain.best.effects == ("coulomb_friction",)
    large_gain = select_effects(
        CASE, search_result(candidate(rms=1e-4), single, candidate(*pair, rms=1.5e-6))
    )
    assert large_gain.best.effects == pair


class _TwoOutputs(MadeCase):
    outputs = ("position_m", "pressure_a_pa")
    floors = MappingProxyType({name: NoiseFloor(FLOOR, FLOOR, FLOOR) for name in outputs})

    def variation(self) -> np.ndarray:
        return np.array([VARIATION, VARIATION])


def _with_pressure(position: FittedCandidate, pressure: FittedCandidate) -> FittedCandidate:
    """The first candidate, with the errors of the second in the other output."""
    squares = np.concatenate([position.squares, pressure.squares], axis=1)
    return replace(position, squares=squares)


@pytest.mark.parametrize(
    ("smaller_m", "larger_m", "justified"),
    [
        (4e-4, 1e-4, True),  # a sensor's effect: three tenths of the errors of its own output
        (1e-4, 6e-5, False),  # 4 % of them
        (4e-6, 1e-6, False),  # three quarters of what is left, which is no motion to speak of
    ],
)
def test_an_effect_of_one_sensor_counts_in_the_output_of_that_sensor(
    smaller_m: float, larger_m: float, justified: bool
) -> None:
    """The pressure's large error has another cause, which both sets have already."""
    case = cast(Case, cast(Any, _TwoOutputs()))
    calibrated = _with_pressure(candidate(rms=1e-3), candidate(rms=9e-3))
    smaller = _with_pressure(
        candidate("coulomb_friction", rms=smaller_m), candidate("coulomb_friction", rms=2e-6)
    )
    pair = ("coulomb_friction", "sensor_lag")
    larger = _with_pressure(candidate(*pair, rms=larger_m), candidate(*pair, rms=2e-6))
    why = objection(case, larger, smaller, calibrated)
    assert (why is None) == justified
    if not justified:
        assert why == "it removes less than 5 % of the errors of the calibrated rig in every output"


def test_errors_next_to_the_floor_need_no_effect() -> None:
    """The second effect removes half of the errors, but a fortieth of those of the rig alone."""
    single, pair = candidate("coulomb_friction", rms=5e-6), ("coulomb_friction", "sensor_lag")
    selection = select_effects(
        CASE, search_result(candidate(rms=1e-4), single, candidate(*pair, rms=2.5e-6))
    )
    assert selection.best.effects == ("coulomb_friction",)


def test_a_pair_is_selected_where_neither_effect_alone_gains() -> None:
    pair = ("valve_dead_band", "coulomb_friction")
    selection = select_effects(
        CASE,
        search_result(
            candidate(rms=1e-4),
            candidate("coulomb_friction", rms=9.9e-5),
            candidate(*pair, rms=2e-6),
        ),
    )
    assert selection.best.effects == pair


def test_coulomb_is_enough_where_stribeck_adds_little() -> None:
    selection = select_effects(
        CASE,
        search_result(
            candidate(rms=1e-4),
            candidate("stribeck_friction", rms=2e-6, parameters=3),
            candidate("coulomb_friction", rms=2.04e-6),
        ),
    )
    assert selection.best.effects == ("coulomb_friction",)
    assert selection.equivalent == ()


def test_sizes_that_every_servo_has_are_not_selected() -> None:
    small = candidate("transport_delay", rms=1e-5, **{"transport_delay.delay_s": 3e-4})
    assert select_effects(CASE, search_result(candidate(rms=1e-4), small)).best.effects == ()


def test_a_gain_is_significant_in_one_direction_only() -> None:
    better, worse = candidate(rms=2e-6), candidate("sensor_lag", rms=3e-6)
    assert is_significant(likelihood_gain(CASE, better, worse))
    assert not is_significant(likelihood_gain(CASE, worse, better))
    assert not is_justified(CASE, worse, better, better)


def test_both_laws_of_friction_are_one_family() -> None:
    assert effect_families(["coulomb_friction"]) == effect_families(["stribeck_friction"])
    assert effect_families(["coulomb_friction"]) != effect_families(["sensor_lag"])


def _reduction(nominal: float, calibrated: float, augmented: float) -> HowFar:
    whole = Estimate(0.9, 0.8, 0.95)
    return HowFar(nominal, calibrated, augmented, (0.001, 0.0012), whole, whole, {})


def _moved(moved: bool) -> dict[str, CalibratedValue]:
    return {"load.mass_kg": CalibratedValue(120.0, Estimate(150.0, 148.0, 152.0), moved)}


@pytest.mark.parametrize(
    ("candidates", "gaps", "moved", "verdict"),
    [
        ([candidate("sensor_lag", rms=2e-6)], (0.5, 0.1, 0.002), False, "effects"),
        (
            [candidate("sensor_lag", rms=2e-6), candidate("transport_delay", rms=2.02e-6)],
            (0.5, 0.1, 0.002),
            False,
            "ambiguous",
        ),
        (
            [
                candidate("stribeck_friction", rms=2e-6),
                candidate("coulomb_friction", rms=2.04e-6),
            ],
            (0.5, 0.1, 0.002),
            False,
            "effects",
        ),
        ([candidate("sensor_lag", rms=9e-5)], (0.5, 0.4, 0.4), False, "outside_catalogue"),
        ([candidate("sensor_lag", rms=5e-5)], (0.5, 0.4, 0.3), False, "outside_catalogue"),
        ([], (0.5, 0.002, 0.002), True, "parameters"),
        ([], (0.002, 0.002, 0.002), False, "no_gap"),
    ],
)
def test_verdicts(
    candidates: list[FittedCandidate], gaps: tuple[float, float, float], moved: bool, verdict: str
) -> None:
    result = search_result(candidate(rms=1e-4), *candidates)
    selection = select_effects(CASE, result)
    # With the values of the rig file, the errors are three times those with fitted values.
    nuisance_fit = candidate(rms=3e-4) if moved else result.calibrated
    decision = decide(CASE, result, selection, _reduction(*gaps), _moved(moved), (), nuisance_fit)
    assert decision.verdict == verdict
    assert decision.sentence.endswith(".")
    assert decision.reasons


def test_values_of_the_rig_file_that_fit_as_well_are_no_parameter_gap() -> None:
    """A value has moved, but the gain is due to values that no data sheet gives."""
    result = search_result(candidate(rms=1e-5))
    for nuisance_rms, verdict in ((1.2e-5, "no_gap"), (3e-4, "parameters")):
        decision = decide(
            CASE,
            result,
            select_effects(CASE, result),
            _reduction(0.1, 0.001, 0.001),
            _moved(True),
            (),
            candidate(rms=nuisance_rms),
        )
        assert decision.verdict == verdict


def test_a_gain_below_a_visible_gap_selects_no_effect() -> None:
    """The errors fall from 4e-4 of the variation to the floor of 1e-4."""
    tiny = search_result(candidate(rms=4e-6), candidate("coulomb_friction", rms=1e-6))
    assert select_effects(CASE, tiny).best.effects == ()


class _SmallMotion(MadeCase):
    """The variation is small, so that gains near the floor are still large beside it."""

    def variation(self) -> np.ndarray:
        return np.array([1e-4])


def test_a_set_that_leaves_most_of_the_gap_is_no_explanation() -> None:
    """Of 2 um above the floor of 1 um, 1.7 um remain: significant, but only 15 %; then 1 um."""
    case = cast(Case, cast(Any, _SmallMotion()))
    calibrated = candidate(rms=3e-6)
    small_gain, large_gain = (candidate("coulomb_friction", rms=rms) for rms in (2.7e-6, 2e-6))
    assert is_justified(case, small_gain, calibrated, calibrated)
    assert select_effects(case, search_result(calibrated, small_gain)).best.effects == ()
    assert select_effects(case, search_result(calibrated, large_gain)).best.effects == (
        "coulomb_friction",
    )


def test_sets_in_words() -> None:
    assert in_words(["coulomb_friction"]) == "Coulomb friction"
    assert in_words(["a_b", "sensor_lag", "valve_lag"]) == "a b, sensor lag and valve lag"

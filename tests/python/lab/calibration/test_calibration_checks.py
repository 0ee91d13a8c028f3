# SPDX-License-Identifier: MIT
"""The whole calibration: meant probabilities look meant, a strange family is found, and files."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from made_machines import TRUE, drawn_machines, made_calibration
from published_schemas import check_file

from ehsid.harness.base.encoding import json_text
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.lab.calibration.checking import LEAST_MACHINES, Calibration, calibrate, left_out_families
from ehsid.lab.calibration.choices import choices_of
from ehsid.lab.calibration.fitting import NAMES
from ehsid.lab.calibration.intervals import intervals
from ehsid.lab.calibration.machines import Found, Machine, Promised, Size, WeighedSet
from ehsid.lab.scoring.judging import SENSORS

NOTHING = (WeighedSet((), 1.0, 0.0),)


@pytest.fixture(scope="module")
def machines() -> list[Machine]:
    """Machines of three kinds of seals; in those of Dahl, effects are named by chance."""
    rng = np.random.default_rng(9)
    return [
        replace(one, kind="one", truth=one.sets[int(rng.integers(1, len(one.sets)))].effects)
        if one.families["seals"] == "Dahl"
        else one
        for one in drawn_machines(400, 8)
    ]


@pytest.fixture(scope="module")
def strange(machines: list[Machine]) -> Calibration:
    return calibrate(Found(tuple(machines), {"not finished": 3}))


@pytest.mark.thorough
def test_the_family_that_differs_is_the_worst(strange: Calibration) -> None:
    worst = strange.families[0]
    assert (worst.trait, worst.family) == ("seals", "Dahl")
    assert worst.coverage.met == "missed"
    assert worst.reliability.error.value > 2.0 * worst.reliability.meant_most
    # The others were fitted beside machines that follow no constants, and hold all the same.
    others = [one for one in strange.families if one.family != "Dahl"]
    assert {one.family for one in others} == {"LuGre", "Bouc-Wen"}
    assert all(one.coverage.high > one.promised for one in others)


@pytest.mark.thorough
def test_fitted_probabilities_are_meant_and_those_in_use_are_not() -> None:
    found = calibrate(Found(tuple(drawn_machines(800, 7))))
    in_use, fitted = found.probabilities
    assert fitted.log_loss.value < in_use.log_loss.value
    assert fitted.reliability[0].error.value < fitted.reliability[0].meant_most
    # The machines follow other constants, of which some are then far from those in use.
    far = {one.name for one in found.constants if abs(one.deviation) > 2.0}
    assert {"evidence", "outside_left"} <= far
    for one in found.constants:
        assert one.deviation == pytest.approx((one.fitted - one.in_use) / one.error)
        assert abs(one.fitted - getattr(TRUE, one.name)) < 4.0 * one.error
    assert [one.name for one in found.constants] == list(NAMES)


@pytest.mark.thorough
def test_intervals_are_counted_by_class_of_sensors(strange: Calibration) -> None:
    assert [one.measured for one in strange.intervals] == ["pressures", "position only"]
    kinds = [kind for one in strange.intervals for kind in one.each]
    assert [kind.words for kind in kinds[:3]] == [
        "sizes of effects",
        "shrinkage of the explainable gap",
        "shrinkage from the simulator as configured",
    ]
    assert sum(kind.in_use.n for kind in kinds[1::3]) == strange.machines
    assert sum(kind.in_use.n for kind in kinds[2::3]) == 0
    assert all(kind.low == kind.high == math.inf for kind in kinds[2::3])


def test_ends_that_other_machines_have_moved_hold_what_they_promise() -> None:
    """Truths scatter more than the intervals say; the share that holds is then nine in ten."""
    rng = np.random.default_rng(3)

    def one(i: int) -> Machine:
        measured = SENSORS[i % 2]
        wrong = rng.normal(0.0, 1.0 + i % 2)
        size = Size("valve_lag", "bandwidth_hz", Estimate(-4.0, -5.0, -3.0), -4.0 * (1.0 + wrong))
        # Realised shrinkage is skewed: promises are rarely exceeded.
        promise = Promised("from_nominal", Estimate(0.9, 0.8, 0.95), 0.95 - rng.exponential(0.2))
        return Machine(f"{i:04d}", "one", "wide", measured, ("valve_lag",), NOTHING,
                       sizes=(size,), promises=(promise,))  # fmt: skip

    # Of 40 machines a part has 8, too few for ends of their own: those would hold all of it.
    few = intervals([one(i) for i in range(80)])
    assert any(kind.corrected.value < 1.0 for of_class in few for kind in of_class.each)
    found = intervals([one(i) for i in range(1200)])
    for number, of_class in enumerate(found):
        sizes, _, shrinkage = of_class.each
        for kind in (sizes, shrinkage):
            assert kind.in_use.value < 0.6
            # Four standard errors of a share of 0.9 in 600.
            assert kind.corrected.value == pytest.approx(0.9, abs=4.0 * math.sqrt(0.09 / 600.0))
        # Distances in shares of the size: the 95 % quantile of a normal error less the quarter.
        # The quantile of 600 has a standard error of sqrt(0.05 0.95 / 600) / density there.
        error, deviation = math.sqrt(0.05 * 0.95 / 600.0), 1.0 + number
        expected = pytest.approx(1.645 * deviation - 0.25, abs=4.0 * error * deviation / 0.103)
        assert sizes.low == expected
        assert sizes.high == expected
        # -ln 0.05 means of 0.2 below 0.95, less what the interval reaches already; none above.
        expected = pytest.approx(-0.2 * math.log(0.05) - 0.15, abs=4.0 * error / (0.05 / 0.2))
        assert shrinkage.low == expected
        assert shrinkage.high < 0.0


@pytest.mark.thorough
def test_the_order_of_the_machines_is_nothing(
    machines: list[Machine], strange: Calibration
) -> None:
    found = Found(tuple(reversed(machines)), {"not finished": 3})
    assert json_text(calibrate(found)) == json_text(strange)


@pytest.mark.slow
def test_the_file_is_as_its_schema_has_it(made_once: Any, tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    path.write_text(json_text(made_once("calibration", made_calibration)))
    check_file(path)


@pytest.mark.slow
def test_a_few_machines_are_enough_for_a_result_and_none_are_not() -> None:
    few = calibrate(Found(tuple(drawn_machines(5, 1))))
    assert few.families == ()
    assert [one.threshold for one in few.sets] == [float("inf")] * 2
    with pytest.raises(ValueError, match="4 machines: expected at least 5"):
        calibrate(Found(tuple(drawn_machines(4, 1))))


@pytest.mark.slow
def test_small_families_are_not_left_out() -> None:
    made = drawn_machines(2 * LEAST_MACHINES, 2)
    named = [
        replace(one, families={"seals": "rare" if i < LEAST_MACHINES - 1 else "common"})
        for i, one in enumerate(made)
    ]
    assert left_out_families(named, choices_of(named), TRUE, None) == ()
    named[-1] = replace(named[-1], families={"seals": "rare"})
    shares: list[float] = []
    found = left_out_families(named, choices_of(named), TRUE, shares.append)
    assert {one.family for one in found} == {"rare", "common"}
    assert shares == [0.5, 1.0]

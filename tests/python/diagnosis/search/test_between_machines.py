# SPDX-License-Identifier: MIT

from dataclasses import replace

import pytest
from msgspec.structs import replace as replace_part

from ehsid.harness.diagnosis.model.parameters import Parameter
from ehsid.harness.diagnosis.schema import Estimate, HowFar, Value
from ehsid.harness.diagnosis.search.gap_reduction import (
    SHRINKAGE_FURTHER,
    SHRINKAGE_FURTHER_FROM_NOMINAL,
    reduction_between_machines,
)
from ehsid.harness.diagnosis.search.intervals import SIZE_FURTHER, size_between_machines

FORCE = Parameter("effects.load_force.force_n", False, 0.0, 1.0, -500.0, 500.0)
GAP = HowFar(2.0, 1.0, 0.1, (0.05, 0.06), Value(0.95, (0.94, 0.96)), Value(0.95, (0.93, 0.97)), {})


@pytest.mark.parametrize("pressures", [True, False])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_ends_of_a_size_move_by_shares_of_the_size(pressures: bool, sign: float) -> None:
    value = sign * 200.0
    found = size_between_machines(Estimate(value, value - 1.0, value + 2.0), FORCE, pressures)
    low, high = SIZE_FURTHER[pressures]
    assert found.value == value
    assert found.low == pytest.approx(value - 1.0 - 200.0 * low)
    assert found.high == pytest.approx(value + 2.0 + 200.0 * high)


def test_ends_of_a_size_stay_within_the_bounds() -> None:
    found = size_between_machines(Estimate(-499.0, -500.0, -498.0), FORCE, False)
    assert found.low == -500.0
    held = Estimate(499.0, 490.0, 500.0)
    assert size_between_machines(held, FORCE, False).high == 500.0
    positive = replace(FORCE, logarithmic=True, low=0.0, high=1.0)  # values of 1 to e
    assert size_between_machines(Estimate(1.0, 1.0, 1.1), positive, False).low == 1.0


def test_a_value_of_the_rig_keeps_its_interval() -> None:
    mass = replace(FORCE, name="load.mass_kg")
    estimate = Estimate(120.0, 119.0, 121.0)
    assert size_between_machines(estimate, mass, True) is estimate


@pytest.mark.parametrize("pressures", [True, False])
def test_a_promise_holds_for_other_motions(pressures: bool) -> None:
    found = reduction_between_machines(GAP, pressures)
    low, high = SHRINKAGE_FURTHER[pressures]
    # More than the whole gap is no promise.
    assert found.of_explainable == Estimate(0.95, pytest.approx(0.94 - low), 1.0)
    low, _ = SHRINKAGE_FURTHER_FROM_NOMINAL[pressures]
    assert found.from_nominal == Estimate(0.95, pytest.approx(0.93 - low), 1.0)
    assert (found.nominal, found.augmented) == (GAP.nominal, GAP.augmented)
    none = reduction_between_machines(
        replace_part(GAP, shrinkage_of_explainable=Value.of(None)), pressures
    )
    assert none.of_explainable is None
    half = replace_part(GAP, shrinkage_of_explainable=Value(0.5, (0.45, 0.55)))
    moved = reduction_between_machines(half, pressures).of_explainable
    assert moved is not None
    assert moved.high == pytest.approx(0.55 + high)
    # Noise that was estimated too large: the interval was beyond the whole gap before.
    beyond = replace_part(GAP, shrinkage_of_explainable=Value(1.01, (0.99, 1.03)))
    kept = reduction_between_machines(beyond, pressures).of_explainable
    assert kept is not None
    assert kept.high == 1.03

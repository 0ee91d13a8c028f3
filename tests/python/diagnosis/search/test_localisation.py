# SPDX-License-Identifier: MIT
"""Where the gap lies, from the shares of equations, of effects, or of both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from servo_records import OTHER, RIG, full, made

from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.fit import fit
from ehsid.harness.diagnosis.model.spectrum import BANDS
from ehsid.harness.diagnosis.schema import SUBSYSTEMS, Equation
from ehsid.harness.diagnosis.search.candidates import FittedCandidate
from ehsid.harness.diagnosis.search.gap_reduction import WindowSums
from ehsid.harness.diagnosis.search.maps import localise

MECHANICS = (
    Equation("force", "mechanics", 0.92, 200.0),
    Equation("flow_a", "hydraulics", 0.05, 130.0),
    Equation("flow_b", "hydraulics", 0.03, 110.0),
)
EITHER = (
    Equation("delay", "timing", 0.5, 40.0),
    Equation("spool", "valve", 0.4, 35.0),
    Equation("force", "mechanics", 0.1, 3.0),
)


@cache
def rubbing() -> tuple[Case, FittedCandidate]:
    """A case with friction, and a fit without from the centres of the priors."""
    records = [made({**OTHER, **full("coulomb_friction")}, seed=seed) for seed in (1, 2)]
    case = make_case(RIG, records[:1], records[1:])
    problem = case.problem()
    fitted = fit(problem, problem.centre())
    values = {p.name: p.value(float(x)) for p, x in zip(problem.parameters, fitted.x, strict=True)}
    # Without the costs and errors that only the selection reads.
    nothing, powers, count = np.zeros((1, 1)), np.zeros((1, 1, BANDS)), np.ones(1)
    sums = WindowSums({}, {}, count)
    return case, FittedCandidate(
        (), fitted.x, values, 0.0, 0.0, True, nothing, count, powers, powers, sums
    )


def with_effects(effect_ids: Sequence[str]) -> FittedCandidate:
    return replace(rubbing()[1], effects=tuple(effect_ids))


def test_where_without_effects_rests_on_the_equations() -> None:
    where = localise(*rubbing(), None, equations=MECHANICS)
    assert set(where.subsystem) == set(SUBSYSTEMS)
    assert where.subsystem["mechanics"] == 0.92
    assert where.subsystem["hydraulics"] == pytest.approx(0.08)
    assert where.equations == MECHANICS
    assert where.notes == ()
    assert sum(share.share_of_gap.value for share in where.frequency) == pytest.approx(
        1.0, abs=0.02
    )
    assert where.regimes


def test_parts_that_cannot_be_told_apart_are_named() -> None:
    (note,) = localise(*rubbing(), None, equations=EITHER).notes
    assert "timing, valve" in note
    assert "mechanics" not in note


def test_nothing_is_said_where_no_equation_lacks_anything() -> None:
    where = localise(*rubbing(), None)
    assert where.subsystem == {}
    assert len(where.notes) == 1


def test_contradictions_of_place_and_effects_are_noted() -> None:
    case, calibrated = rubbing()
    agreeing = localise(case, calibrated, with_effects(["coulomb_friction"]), equations=MECHANICS)
    assert agreeing.subsystem["mechanics"] == 1.0
    assert agreeing.notes == ()
    other = localise(case, calibrated, with_effects(["valve_dead_band"]), equations=MECHANICS)
    assert other.subsystem["valve"] == 1.0
    (note,) = other.notes
    assert "mechanics, 92 %" in note


@pytest.mark.slow
@given(
    shares=st.dictionaries(
        st.sampled_from(["valve_dead_band", "coulomb_friction", "load_force"]),
        st.floats(-1.0, 5.0),
        max_size=3,
    )
)
def test_shares_of_effects_sum_to_one(shares: dict[str, float]) -> None:
    case, calibrated = rubbing()
    best = with_effects(["valve_dead_band", "coulomb_friction", "load_force"])
    subsystem = localise(case, calibrated, best, shares=shares, equations=MECHANICS).subsystem
    assert sum(subsystem.values()) == pytest.approx(1.0)
    assert min(subsystem.values()) >= 0.0
    assert subsystem["hydraulics"] == subsystem["sensor"] == subsystem["timing"] == 0.0


def test_place_is_that_of_all_sets_that_cannot_be_told_apart() -> None:
    case, calibrated = rubbing()
    best = with_effects(["valve_dead_band"])
    others = [(["coulomb_friction"], 0.6), (["coulomb_friction", "valve_null_bias"], 0.4)]
    subsystem = localise(case, calibrated, best, others=others).subsystem
    assert subsystem["valve"] == pytest.approx((1.0 + 0.5 * 0.4) / 2.0)
    assert subsystem["mechanics"] == pytest.approx((0.6 + 0.5 * 0.4) / 2.0)

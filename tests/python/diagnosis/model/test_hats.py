# SPDX-License-Identifier: MIT
"""Hat functions of windows, and the responses to them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from servo_records import OTHER, RIG, made

from ehsid.harness.diagnosis.model.case import make_case
from ehsid.harness.diagnosis.model.comparison import compare
from ehsid.harness.diagnosis.model.fit import SPACING_S, hats
from ehsid.harness.diagnosis.model.problem import Problem

RECORD = made(OTHER, seed=1)


def test_hats_add_up_to_one_in_each_full_window() -> None:
    own = hats(compare(RECORD))
    np.testing.assert_allclose(own.shapes.sum(axis=0), 1.0)
    assert own.spacing_s == pytest.approx(SPACING_S)
    total = own.signals().sum(axis=0)
    inside = compare(RECORD).window >= 0
    assert set(np.unique(total[~inside])) <= {0.0}
    assert total.sum() == pytest.approx(own.begins.size * own.shapes.shape[1])


def test_a_window_takes_the_directions_of_its_own_hats() -> None:
    own = hats(compare(RECORD))
    by_direction = np.arange(own.begins.size * 2 * own.count, dtype=float)
    by_direction = by_direction.reshape(own.begins.size, 2 * own.count)
    taken = own.own(by_direction)
    np.testing.assert_array_equal(taken[0], by_direction[0, : own.count])
    np.testing.assert_array_equal(taken[1], by_direction[1, own.count :])


@given(slope=st.floats(-10.0, 10.0), offset=st.floats(-10.0, 10.0))
def test_means_at_nodes_keep_what_is_constant_and_follow_what_rises(
    slope: float, offset: float
) -> None:
    own = hats(compare(RECORD))
    rising = offset + slope * np.arange(own.samples) * 1e-3
    at_nodes = own.at_nodes(rising)
    assert at_nodes.shape == (own.begins.size, own.count)
    steps = np.diff(at_nodes[:, 1:-1], axis=1)
    np.testing.assert_allclose(steps, slope * own.spacing_s, atol=1e-9)


def test_responses_are_differences_of_simulations() -> None:
    """Of those with and without a load force."""
    problem = make_case(RIG, [RECORD]).problem()
    x = problem.centre()
    signal = np.ones(len(RECORD))
    found = problem.responses(x, [[("force", signal)]])
    loaded = Problem(
        problem.rig,
        problem.records,
        problem.parameters,
        outputs=problem.outputs,
        floors=problem.floors,
        substeps=problem.substeps,
        fixed={"effects.load_force.force_n": 1.0},
    )
    before, after = problem.coefficients(x), loaded.coefficients(x)
    for name in problem.outputs:
        difference = after[name] - before[name]
        error = np.max(np.abs(found[name][:, 0] - difference))
        assert error < 0.05 * np.max(np.abs(difference)), name

# SPDX-License-Identifier: MIT
"""Derivatives by disturbances, against tables over the time, which are another way to add them."""

from __future__ import annotations

import numpy as np
import plant_runs as runs
import pytest
from plant_reference import OUTPUTS, typical

import ehsid

DT_S = runs.DT_S
COMMAND = runs.steps(7, 150, 15, 5.0)
TIME_S = DT_S * np.arange(COMMAND.size)
RNG = np.random.default_rng(4)
SIGNAL = np.interp(TIME_S, TIME_S[::30], RNG.standard_normal(TIME_S[::30].size))
# The size of a difference by each equation: small, but far above rounding.
STEP = {"spool": 1e-5, "flow_a": 1e-9, "flow_b": 1e-9, "force": 1e-2, "sensor": 1e-7}
EQUATIONS = tuple(STEP)
ON_PLANT = {"ehs": EQUATIONS, "axis": ("force", "sensor"), "linear": ("spool", "force", "sensor")}
PAIRS = [(plant, name) for plant, names in ON_PLANT.items() for name in names]


def plain(plant: str, **options: object) -> tuple[np.ndarray, np.ndarray]:
    outputs, slopes = ehsid.simulate_plant(
        plant,
        runs.vector(typical()),
        COMMAND,
        dt_s=DT_S,
        substeps=4,
        **options,  # type: ignore[arg-type]
    )
    return outputs[0], slopes[0]


def with_table(
    plant: str, equation: str, values: np.ndarray, *, varied: bool
) -> tuple[np.ndarray, np.ndarray]:
    """The same signal as a table over the time with a knot at each sample."""
    row = np.hstack([runs.vector(typical()), values[np.newaxis]])
    first = row.shape[1] - values.size
    outputs, slopes = ehsid.simulate_plant(
        plant,
        row,
        COMMAND,
        dt_s=DT_S,
        substeps=4,
        varied=range(first, row.shape[1]) if varied else (),
        tables=[(equation, "time_s", TIME_S)],
    )
    return outputs[0], slopes[0]


@pytest.mark.parametrize(("plant", "equation"), PAIRS)
def test_the_derivative_is_the_difference_of_two_simulations(plant: str, equation: str) -> None:
    _, slopes = plain(plant, disturbances=[(equation, SIGNAL)])
    more, _ = with_table(plant, equation, STEP[equation] * SIGNAL, varied=False)
    less, _ = with_table(plant, equation, -STEP[equation] * SIGNAL, varied=False)
    difference = (more - less) / (2.0 * STEP[equation])
    for j, name in enumerate(OUTPUTS):
        scale = np.max(np.abs(difference[:, j]))
        if np.isfinite(scale):
            # The edges of the valve and the laminar flow bend within the difference.
            error = np.max(np.abs(slopes[:, 0, j] - difference[:, j]))
            assert error <= 2e-4 * scale + 1e-300, name


@pytest.mark.parametrize(("plant", "equation"), [*PAIRS, ("ehs", "delay")])
def test_the_derivative_is_that_by_the_values_of_a_table(plant: str, equation: str) -> None:
    _, slopes = plain(plant, disturbances=[(equation, SIGNAL)])
    _, by_knots = with_table(plant, equation, np.zeros(TIME_S.size), varied=True)
    expected = np.einsum("nkl,k->nl", by_knots, SIGNAL)
    scale = np.max(np.abs(expected), axis=0)
    finite = np.isfinite(scale)
    np.testing.assert_allclose(
        (slopes[:, 0] / np.where(scale > 0.0, scale, 1.0))[:, finite],
        (expected / np.where(scale > 0.0, scale, 1.0))[:, finite],
        atol=1e-9,
    )


def test_nothing_else_changes() -> None:
    varied = [0, 5, 6, 12, 20]
    outputs, slopes = plain("ehs", varied=varied)
    many = [(equation, (k + 1.0) * SIGNAL) for equation in EQUATIONS for k in range(9)]
    with_many, all_slopes = plain("ehs", varied=varied, disturbances=many)
    np.testing.assert_array_equal(with_many, outputs)
    np.testing.assert_allclose(all_slopes[:, :5], slopes, rtol=1e-12, atol=0.0)
    # Linear in the signal, whatever part of the run computes it.
    first = all_slopes[:, 5::9]
    scale = np.max(np.abs(first), axis=0)
    assert np.all(np.abs(all_slopes[:, 13::9] - 9.0 * first) <= 1e-9 * scale)


@pytest.mark.parametrize(
    ("disturbances", "message"),
    [
        ([("friction", SIGNAL)], "adds_to must be one of"),
        ([("force", SIGNAL[:-1])], "signal"),
        ([("force", np.full(SIGNAL.size, np.nan))], "must be finite"),
        ([("force",)], "expected"),
    ],
)
def test_what_is_no_disturbance_is_refused(disturbances: list[object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        plain("ehs", disturbances=disturbances)

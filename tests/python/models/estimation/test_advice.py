# SPDX-License-Identifier: MIT
"""Advice is what helps on the record, and names the setting; where nothing helps, it says why."""

from __future__ import annotations

import model16
import numpy as np
import numpy.typing as npt
import pytest

import ehsid
from ehsid.harness.models.estimation import estimate
from ehsid.harness.models.estimation.advice import Advice, advise
from ehsid.harness.models.estimation.recursion import Recursion
from ehsid.harness.models.identification import ArxOrders, IoData

RNG = np.random.default_rng(2)
U = RNG.choice([-1.0, 1.0], size=3000)
E = 0.02 * RNG.normal(size=U.size)
LATER = np.concatenate([np.zeros(3), U])[: U.size]
USUAL = Recursion(ArxOrders(3, 3, 1, offset=True), ehsid.Exponential())


def advice_on(u: npt.ArrayLike, y: npt.ArrayLike, recursion: Recursion = USUAL) -> Advice:
    data = IoData.from_arrays(np.asarray(u), np.asarray(y))
    return advise(data, recursion, estimate(data, **vars(recursion)))


@pytest.mark.parametrize(
    ("y", "recursion", "why", "options"),
    [
        (model16.output(U, 0.0 * E) + 5.0 * E, USUAL, "not white", "--method riv"),
        (
            model16.output(U, E),
            Recursion(USUAL.orders, ehsid.Constant(0.95)),
            "remembers about 22 samples",
            "--forgetting constant --lambda0 0.999",
        ),
        (
            model16.output(U, E),
            Recursion(ArxOrders(3, 3, 3, offset=True), ehsid.Exponential()),
            "less than the delay of 3",
            "--nk 1",
        ),
        (model16.output(LATER, E), USUAL, "delay of 4 instead of 1", "--nk 4"),
    ],
    ids=["noise of the sensor", "forgets too fast", "delay too long", "delay too short"],
)
def test_the_first_advice_mends_what_is_wrong(
    y: npt.NDArray[np.float64], recursion: Recursion, why: str, options: str
) -> None:
    first = advice_on(U, y, recursion).trials[0]
    assert first.setting.options == options
    assert why in first.why


def test_what_has_converged_with_white_residuals_needs_nothing() -> None:
    assert advice_on(U, model16.output(U, E)) == Advice()


def test_a_needless_reset_and_too_many_coefficients_are_named() -> None:
    rng = np.random.default_rng(5)
    u = np.repeat(rng.choice([-1.0, 1.0], size=60), 10)
    noise = 0.05 * rng.normal(size=u.size)
    y = np.zeros(u.size)
    for k in range(1, u.size):
        y[k] = 0.8 * y[k - 1] + u[k - 1] + noise[k]
    found = advice_on(u, y)
    assert "--na 1 --nb 1" in [trial.setting.options for trial in found.trials]


def test_where_nothing_helps_it_says_what_the_record_lacks() -> None:
    """Nothing tells whether the command is at its limit, so that a larger one is only an "if"."""
    u = np.sin(0.01 * np.arange(400))
    y = np.cumsum(np.random.default_rng(3).normal(size=u.size))
    found = advice_on(u, y)
    assert found.trials == ()
    told = " ".join(found.lacks)
    assert "what counts as converged" in told
    assert "other intervals or, if the valve takes a larger one, moves the machine further" in told


def integrating(at_rest: float) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """A servo that stands still at this command, moved by one whose mean is zero."""
    u = np.repeat(np.random.default_rng(1).permutation([-1.0, 1.0] * 375), 4)
    y = np.zeros(u.size)
    for k in range(2, u.size):
        y[k] = 1.6 * y[k - 1] - 0.6 * y[k - 2] + 0.1 * (u[k - 1] - at_rest) + 0.02 * E[k]
    return u, y


def test_a_constant_term_that_is_missing_is_the_first_advice() -> None:
    u, y = integrating(0.2)
    without = Recursion(ArxOrders(2, 1, 1, offset=False), ehsid.FRatio())
    first = advice_on(u, y, without).trials[0]
    assert first.setting.options == "--offset"
    assert first.setting.arguments == "offset=True"
    assert first.residuals_white


def test_an_estimate_that_has_settled_with_coloured_residuals_may_be_used_within_limits() -> None:
    """The output passes a dead band, so that no linear model has white residuals."""
    u = np.repeat(np.random.default_rng(4).uniform(-1.0, 1.0, 600), 5)
    moved = np.where(np.abs(u) > 0.1, u - 0.1 * np.sign(u), 0.0)
    y = np.zeros(u.size)
    for k in range(1, u.size):
        y[k] = 0.5 * y[k - 1] + moved[k - 1] + 1e-3 * E[k]
    data = IoData.from_arrays(u, y)
    recursion = Recursion(ArxOrders(1, 1, 1, offset=True), ehsid.Constant(1.0), reset=False)
    result = estimate(data, **vars(recursion))
    assert result.settled
    assert not result.converged
    told = " ".join(advise(data, recursion, result).lacks)
    assert "The estimate has settled" in told
    assert "what counts as converged" not in told
    assert f"fits the output by {result.simulation_fit_percent:.1f} %" in told

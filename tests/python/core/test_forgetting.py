# SPDX-License-Identifier: MIT
"""What each forgetting policy promises, and the protection from wind-up behind all of them."""

import model16
import numpy as np
import numpy.typing as npt
import numpy_reference as reference
import policies
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ehsid

FloatArray = npt.NDArray[np.float64]


def white(seed: int, samples: int, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Regressors, output with unit noise, and the true parameters."""
    rng = np.random.default_rng(seed)
    phi, theta = rng.normal(size=(samples, n)), rng.normal(size=n)
    return phi, phi @ theta + rng.normal(size=samples), theta


def unguarded(n: int, forgetting: ehsid.Forgetting, variance: float = 1e6) -> ehsid.Rls:
    return ehsid.Rls(
        n,
        forgetting=forgetting,
        options=policies.UNGUARDED,
        variance0=[variance] * n,
        dtype="float64",
    )


@given(factor=st.floats(0.8, 1.0), n=st.integers(1, 8), seed=st.integers(0, 10_000))
def test_constant_minimises_the_weighted_sum_of_squares(factor: float, n: int, seed: int) -> None:
    samples = 50
    phi, y, _ = white(seed, samples, n)
    rls = unguarded(n, ehsid.Constant(factor), variance=10.0)
    rls.run(phi, y)
    weight = factor ** (0.5 * np.arange(samples - 1, -1, -1))
    prior = np.sqrt(factor**samples / 10.0) * np.eye(n)
    rows = np.vstack((prior, phi * weight[:, None]))
    batch = np.linalg.lstsq(rows, np.concatenate((np.zeros(n), y * weight)), rcond=None)[0]
    # n eps a step, carried by the condition number, and a ten for the growth by 1 / factor that the
    # measurements take off again.
    tolerance = 2.2e-16 * n * samples * np.linalg.cond(rows) ** 2 * 10.0
    np.testing.assert_allclose(rls.theta_hat, batch, rtol=0.0, atol=tolerance)


def test_exponential_follows_equation_15() -> None:
    phi, y, _ = white(1, 500, 3)
    path = unguarded(3, ehsid.Exponential(0.97, 0.9)).run(phi, y)
    factor = 0.9
    for k in range(500):
        factor = 0.97 * factor + (1.0 - 0.97)
        # Each of the recursions rounds by eps a step, and 1 / (1 - 0.97) steps add up.
        assert abs(path.forgetting_factor[k] - factor) < 34 * 2.2e-16


def test_error_driven_forgets_one_part_in_n0_on_average() -> None:
    """Fortescue's point: the information in the estimate stays that of N0 samples."""
    phi, y, _ = white(2, 50_000, 4)
    path = unguarded(4, ehsid.ErrorDriven(200.0, 0.1, 1.0)).run(phi, y)
    forgotten = 1.0 - path.forgetting_factor[1000:].astype(np.float64)
    # E (1 - phi' K) epsilon^2 = sigma0^2, so the mean is 1 / N0; epsilon^2 has the variance 2, and
    # 49000 of them average to sqrt(2 / 49000) = 0.6 %; five of those.
    assert abs(forgotten.mean() * 200.0 - 1.0) < 5.0 * np.sqrt(2.0 / 49_000.0)
    assert forgotten.max() <= 0.9


def test_error_driven_drops_to_its_least_factor_on_a_wild_error() -> None:
    phi, y, _ = white(3, 1000, 4)
    y[900] += 1e3
    path = unguarded(4, ehsid.ErrorDriven(200.0, 0.3)).run(phi, y)
    assert path.forgetting_factor[900] == 0.3
    assert path.forgetting_factor[899] > 0.9


def test_f_ratio_forgets_only_after_the_errors_have_grown() -> None:
    phi, y, theta = white(4, 1000, 3)
    y[600:] += phi[600:] @ (10.0 * np.ones(3))
    path = unguarded(3, ehsid.FRatio(2.0, 3.3)).run(phi, y)
    # 99.9 % of the ratios of like errors are below 3.3, the point of F(10, 100) in the header.
    assert (path.forgetting_factor[:600] == 1.0).mean() > 0.99
    assert (path.forgetting_factor[:99] == 1.0).all()
    least = 1.0 / (1.0 + 2.0 * (np.sqrt(100.0 / 10.0 / 3.3) - 1.0))
    assert least - 1e-15 <= path.forgetting_factor.min() < 0.6
    # Behind the change 400 samples of unit noise: 0.05 a parameter, five of those.
    np.testing.assert_allclose(path.theta[-1], theta + 10.0, rtol=0.0, atol=0.25)


def test_f_ratio_speaks_with_the_hundredth_error() -> None:
    for spike, forgets in ((98, False), (99, True)):
        phi, y, _ = white(4, 100, 3)
        y[spike] += 100.0
        path = unguarded(3, ehsid.FRatio(2.0, 3.3)).run(phi, y)
        assert (path.forgetting_factor[spike] < 1.0) == forgets


@pytest.mark.slow
@pytest.mark.parametrize("name", policies.NAMES)
def test_the_information_margin_skips_what_its_definition_says(name: str) -> None:
    rng = np.random.default_rng(6)
    u = np.concatenate([rng.choice([-1.0, 1.0], 1000), np.zeros(3000), rng.normal(size=500)])
    # From sample 2500 on the errors are about as large as counts for a surprise, twice the usual.
    size = np.where(np.arange(u.size) < 2500, 1e-2, 2.1e-2)
    phi, y = model16.regressors(u, model16.output(u, size * rng.normal(size=u.size)))
    margin = 2.0
    options = ehsid.RlsOptions(information_margin=margin, covariance_ceiling=1e30)
    pair = policies.PAIRS[name]
    rls = ehsid.Rls(6, forgetting=pair.compiled, options=options, dtype="float64")
    path = rls.run(phi, y)
    numpy_rls = reference.Reference(np.zeros(6), np.full(6, 1e6), pair.written(6), margin)
    kept = np.array([numpy_rls.update(phi[k], y[k]) for k in range(y.size)])
    np.testing.assert_array_equal(path.status == ehsid.Status.ok, kept)
    np.testing.assert_allclose(rls.theta_hat, numpy_rls.theta, rtol=1e-9)
    # The others wait for longer than this hold: for two and a half times what they have seen.
    assert kept.all() == (name not in ("constant", "error_driven"))


@pytest.mark.slow
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("noise", [1e-3, 0.1])
@pytest.mark.parametrize("level", [0.0, 0.5])
@pytest.mark.parametrize("name", policies.NAMES)
def test_held_input_winds_nothing_up(name: str, level: float, noise: float, dtype: str) -> None:
    rng = np.random.default_rng(7)
    u = np.concatenate((rng.choice([-1.0, 1.0], size=2203), np.full(100_000, level)))
    phi, y = model16.regressors(u, model16.output(u, noise * rng.normal(size=u.size)))
    rls = ehsid.Rls(6, forgetting=policies.PAIRS[name].compiled, dtype=dtype)
    rls.run(phi[:2200], y[:2200])
    theta, deviation = rls.theta_hat, rls.standard_deviation
    path = rls.run(phi[2200:], y[2200:])

    held = path.theta.astype(np.float64)
    assert np.isfinite(held).all()
    assert np.isfinite(path.standard_deviation).all()
    # The documented ceiling; rounding of some hundred operations on the diagonal.
    assert np.diag(rls.P).mean() <= 1e6 * (1.0 + 100.0 * float(np.finfo(dtype).eps))
    # theta moves no further than its own standard deviations, then and now, allow: 6e5 draws of
    # a normal distribution stay within six of them (odds 1 in 800).
    allowed = 6.0 * np.hypot(path.standard_deviation, deviation)
    assert (np.abs(held - theta) <= allowed).all()
    if name in ("exponential", "f_ratio") and noise == 1e-3:
        # Policies that forget nothing now: the gate of the project, 1e-3.
        assert np.linalg.norm(held - theta, axis=1).max() < 1e-3 * np.linalg.norm(theta)


def test_without_guards_the_same_hold_winds_up() -> None:
    """The test above can fail: it is the guards that keep the covariance down."""
    rng = np.random.default_rng(7)
    u = np.concatenate((rng.choice([-1.0, 1.0], size=2203), np.zeros(10_000)))
    rls = unguarded(6, ehsid.Constant(0.99))
    rls.run(*model16.regressors(u, model16.output(u, 1e-3 * rng.normal(size=u.size))))
    assert np.diag(rls.P).mean() > 1e9


@settings(max_examples=40)
@given(pair=policies.ANY, seed=st.integers(0, 10_000), n=st.integers(1, 6))
def test_no_parameter_of_any_policy_breaks_a_held_regressor(
    pair: policies.Pair, seed: int, n: int
) -> None:
    """The same regressor for ever, the hardest case: rank one out of n."""
    rng = np.random.default_rng(seed)
    phi = np.vstack((rng.normal(size=(20, n)), np.tile(rng.normal(size=n), (3000, 1))))
    rls = ehsid.Rls(n, forgetting=pair.compiled, dtype="float32")
    path = rls.run(phi, phi.sum(axis=1) + 0.1 * rng.normal(size=phi.shape[0]))
    assert np.isfinite(path.theta).all()
    assert np.diag(rls.P).mean() <= 1e6 * (1.0 + 100.0 * float(np.finfo(np.float32).eps))
    assert not (path.status == ehsid.Status.numerical_limit).any()

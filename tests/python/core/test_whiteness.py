# SPDX-License-Identifier: MIT
"""The monitor of white residuals on model (16): statistic, alarms, and what follows from them."""

from __future__ import annotations

from dataclasses import dataclass

import model16
import numpy as np
import numpy.typing as npt
import pytest
import scipy.signal
import scipy.stats
from statsmodels.stats.diagnostic import acorr_ljungbox

import ehsid
from ehsid.lab.studies.noises import plain_deviation

FloatArray = npt.NDArray[np.float64]
ALARM, RELEASE = 22.458, 12.592


def record(noise: str, size: float, n: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Command, measured position; noise white, with C = 1 + 0.7 q^-1, or on the position."""
    rng = np.random.default_rng(seed)
    u = rng.choice([-1.0, 1.0], size=n)
    e = size * rng.normal(size=n)
    if noise == "position":
        return u, model16.output(u, np.zeros(n)) + e
    if noise == "coloured":
        e = np.asarray(scipy.signal.lfilter([1.0, 0.7], [1.0], e))
    return u, model16.output(u, e)


def estimator(lambda_: float = 1.0) -> ehsid.ArxEstimator:
    return ehsid.ArxEstimator(3, 3, 1, forgetting=ehsid.Constant(lambda_), reset=None)


@dataclass(frozen=True)
class Runs:
    """Of each run: share of intervals that hold, the worst parameter, what the monitor says."""

    inside_plain: FloatArray
    inside: FloatArray
    worst: FloatArray
    white: npt.NDArray[np.bool_]
    converged: npt.NDArray[np.bool_]


def behind_records(noise: str, size: float, n: int, count: int) -> list[ehsid.ArxEstimator]:
    """Estimators that have run, side by side, over a record each."""
    bank = ehsid.EstimatorBank([estimator() for _ in range(count)])
    records = [record(noise, size, n, seed) for seed in range(count)]
    bank.run(*(np.column_stack(signals) for signals in zip(*records, strict=True)), every=0)
    return [bank[i] for i in range(count)]


def runs(noise: str, size: float, n: int, count: int) -> Runs:
    rows = []
    limit = scipy.stats.norm.ppf(0.95)
    for servo in behind_records(noise, size, n, count):
        error = np.abs(servo.theta_hat - model16.THETA)
        plain = plain_deviation(servo)
        rows.append(
            (
                np.mean(error < limit * plain),
                np.mean(error < limit * servo.standard_deviation),
                np.max(error / plain),
                servo.residuals_white,
                servo.converged,
            )
        )
    columns = [np.asarray(column) for column in zip(*rows, strict=True)]
    return Runs(columns[0], columns[1], columns[2], columns[3], columns[4])


def test_limits_are_quantiles_of_chi_squared() -> None:
    assert scipy.stats.chi2.sf(ALARM, 6) == pytest.approx(1e-3, rel=1e-3)
    assert scipy.stats.chi2.sf(RELEASE, 6) == pytest.approx(0.05, rel=1e-3)


def test_statistic_of_white_residuals_is_chi_squared() -> None:
    """Kolmogorov-Smirnov over independent runs of 1,800 samples, at the level 1e-3."""
    values = [servo.whiteness for servo in behind_records("equation", 0.1, 1800, 400)]
    assert scipy.stats.kstest(values, scipy.stats.chi2(6).cdf).pvalue > 1e-3


@pytest.mark.parametrize(
    ("noise", "size"), [("equation", 0.1), ("coloured", 0.1), ("position", 0.01)]
)
def test_decision_is_that_of_ljung_and_box(noise: str, size: float) -> None:
    """statsmodels finds the same records coloured, where the colour is in the first lags."""
    for seed in range(10):
        u, y = record(noise, size, 2000, seed)
        servo = estimator()
        path = servo.run(u, y)
        innovation = path.innovation[100:]  # before, their size is that of the error of theta
        p_value = acorr_ljungbox(innovation, lags=[3])["lb_pvalue"].iloc[0]
        assert servo.residuals_white == bool(p_value > 1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("policy", [ehsid.Constant(1.0), ehsid.Constant(0.99), ehsid.FRatio()])
def test_false_alarms_in_a_hundred_thousand_samples(policy: ehsid.Forgetting) -> None:
    """White noise: the alarm is on for at most 1 % of the samples; measured 0.0 to 0.13 %."""
    alarmed = samples = 0
    for seed in range(4):
        servo = ehsid.ArxEstimator(3, 3, 1, forgetting=policy)
        u, y = record("equation", 0.1, 100_000, seed)
        for k in range(0, u.size, 50):
            servo.run(u[k : k + 50], y[k : k + 50])
            alarmed += not servo.residuals_white
            samples += 1
    assert alarmed <= 0.01 * samples


def test_no_false_alarm_in_the_first_200_samples() -> None:
    """0.4 % of runs, as measured: more than this test allows have a probability of 1e-3."""
    alarms = sum(not servo.residuals_white for servo in behind_records("equation", 0.1, 200, 500))
    assert alarms <= scipy.stats.binom.ppf(1 - 1e-3, 500, 0.004)


def test_intervals_hold_or_the_status_says_so() -> None:
    """90 % intervals, 2,000 samples: 85 to 95 % hold, or every run says that they do not."""
    count = 200
    white = runs("equation", 0.1, 2000, count)
    assert 0.85 < white.inside.mean() < 0.95
    # Alarms in at most 2 % of all runs: more than 10 of 200 then have a probability below 1e-3.
    assert np.count_nonzero(~white.white) <= scipy.stats.binom.ppf(1 - 1e-3, count, 0.02)
    for noise, size in (("coloured", 0.1), ("position", 0.01)):
        found = runs(noise, size, 2000, count)
        assert found.inside_plain.mean() < 0.3
        assert not found.white.any()
        assert not found.converged.any()
        assert found.inside.mean() > 0.95  # enlarged by sqrt(1 + Q): wide, but they hold


@pytest.mark.parametrize(
    ("noise", "size"),
    [("coloured", 0.1), ("position", 0.003), ("position", 0.01), ("position", 0.1)],
)
@pytest.mark.parametrize("n", [300, 1000, 5000])
def test_never_converged_while_biased_beyond_three_deviations(
    noise: str, size: float, n: int
) -> None:
    found = runs(noise, size, n, 40)
    assert not (found.converged & (found.worst > 3.0)).any()


@pytest.mark.parametrize("noise", ["equation", "position"])
def test_covariance_and_deviations_say_the_same_of_the_residuals(noise: str) -> None:
    servo = estimator()
    servo.run(*record(noise, 0.1, 3000, 1))
    assert servo.residuals_white == (noise == "equation")
    told = servo.standard_deviation
    np.testing.assert_allclose(told, np.sqrt(np.diag(servo.covariance)), rtol=1e-6)
    enlarged = 1.0 if servo.residuals_white else np.sqrt(1.0 + servo.whiteness)
    unscaled = np.sqrt(servo.residual_variance * np.diag(servo.P))  # nothing is forgotten
    np.testing.assert_allclose(told, enlarged * unscaled, rtol=1e-5)


def test_a_change_of_the_plant_with_a_reset_is_no_lasting_alarm() -> None:
    """20 runs of 4,000 samples: at most 3 end in an alarm, of which 2 % of all runs may be."""
    white = 0
    for seed in range(20):
        servo = ehsid.ArxEstimator(3, 3, 1)
        servo.run(*model16.changing(seed, 4000, {2000: 1.5}, 0.01))
        assert servo.resets >= 1
        assert servo.converged == servo.residuals_white
        white += servo.residuals_white
    assert white >= 20 - scipy.stats.binom.ppf(1 - 1e-3, 20, 0.02)


def test_a_structure_that_is_too_small_is_seen() -> None:
    """Second order for a plant of third order: its residuals can be predicted without noise."""
    servo = ehsid.ArxEstimator(2, 2, 1)
    servo.run(*record("equation", 0.01, 2000, 3))
    assert not servo.residuals_white
    assert not servo.converged


def test_a_wrong_delay_is_seen() -> None:
    u, y = record("equation", 0.01, 2000, 3)
    servo = ehsid.ArxEstimator(3, 3, 3)
    servo.run(u, y)
    assert not servo.residuals_white


def test_the_command_shows_what_the_innovations_do_not() -> None:
    """Strong noise on the position, 300 samples: to Ljung and Box the innovations look white."""
    seen = ljung = 0
    for seed in range(40):
        u, y = record("position", 0.1, 300, seed)
        servo = estimator()
        path = servo.run(u, y)
        seen += not servo.residuals_white
        ljung += acorr_ljungbox(path.innovation[50:], lags=[3])["lb_pvalue"].iloc[0] < 1e-3
    assert ljung < 10
    assert seen > 30

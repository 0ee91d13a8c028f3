# SPDX-License-Identifier: MIT
"""The offline procedure: its loop, what it keeps, and what it says of bad data."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest
import statsmodels.api as sm
from hypothesis import given, settings
from hypothesis import strategies as st
from identification_truth import A16, B16, arx_output, model16
from sources import ROOT

from ehsid.harness.models.identification import (
    ArxOrders,
    IdentificationError,
    IoData,
    Prediction,
    Preprocessing,
    fit_percent,
    identify,
)
from ehsid.harness.records import read_record
from ehsid.lab.studies.attempts import gain
from ehsid.lab.studies.problems import Problem
from ehsid.lab.studies.procedure import Procedure, run_procedure

CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"


def names(procedure: Procedure) -> set[str]:
    return {str(finding.problem) for finding in procedure.problems}


def consistent(procedure: Procedure) -> None:
    """What must hold whatever the data: words for everything, and numbers only where there are."""
    json.dumps(procedure.to_dict(), allow_nan=False)
    assert procedure.stopped
    assert all(finding.text for finding in procedure.problems)
    if procedure.kept is None:
        assert procedure.problems
        with pytest.raises(IdentificationError):
            _ = procedure.best
        return
    best = procedure.best
    assert best.result is not None
    assert best.problems == procedure.problems
    assert procedure.poles_zeros is not None
    assert procedure.response is not None
    assert procedure.meaning
    assert len({attempt.settings for attempt in procedure.attempts}) == len(procedure.attempts)
    # It went on exactly as long as something was wrong.
    assert not any(attempt.sound for attempt in procedure.attempts[:-1]) or best.sound


@pytest.mark.slow
def test_a_plain_record_takes_one_attempt() -> None:
    u, y = model16(seed=1, n=2000, noise=0.1)
    procedure = run_procedure(IoData.from_arrays(u, y, dt_s=0.05))
    consistent(procedure)
    assert procedure.kept == 0
    assert len(procedure.attempts) == 1
    assert procedure.problems == ()
    assert procedure.best.sound
    assert "Nothing speaks against" in procedure.stopped
    # It is what identify finds.
    plain = identify(IoData.from_arrays(u, y))
    assert procedure.best.result is not None
    np.testing.assert_array_equal(
        procedure.best.result.chosen.model.theta, plain.chosen.model.theta
    )
    assert procedure.best.one_step_fit_percent == plain.chosen.one_step_fit_percent


@pytest.mark.slow
def test_a_missing_delay_is_found_by_the_loop() -> None:
    u, y = model16(seed=2, n=2000, noise=0.1, nk=8)
    procedure = run_procedure(IoData.from_arrays(u, y))
    consistent(procedure)
    assert procedure.best.change == "delays up to 10"
    assert procedure.best.sound
    assert procedure.best.result is not None
    assert procedure.best.result.chosen.orders == ArxOrders(3, 3, 8, offset=True)
    assert "beyond chance" in procedure.best.comparison


@pytest.mark.slow
def test_a_higher_order_is_found_by_the_loop() -> None:
    """Order 4 while 2 and 3 are asked for."""
    rng = np.random.default_rng(3)
    a = np.poly([0.95, 0.7, 0.5 + 0.7j, 0.5 - 0.7j]).real[1:]
    b = np.array([1.0, -0.3, 0.5, 0.4])
    u = rng.normal(size=3000)
    y = arx_output(a, b, 1, u, 0.1 * rng.normal(size=3000))
    procedure = run_procedure(IoData.from_arrays(u, y), orders=range(2, 4))
    consistent(procedure)
    assert procedure.best.change == "order 4"
    assert procedure.best.sound


@pytest.mark.slow
def test_drift_is_found_by_the_loop() -> None:
    """A line in the output of a plant that settles, which no constant term takes up."""
    rng = np.random.default_rng(4)
    u = rng.normal(size=2000)
    y = arx_output(np.array([-0.5, 0.1]), np.array([1.0, 0.5]), 1, u, 0.1 * rng.normal(size=2000))
    y += 0.01 * np.arange(2000)
    procedure = run_procedure(IoData.from_arrays(u, y))
    consistent(procedure)
    assert procedure.best.change == "lines removed"
    assert procedure.best.sound
    assert procedure.best.result is not None
    assert procedure.best.result.chosen.orders.na == 2
    assert procedure.best.preprocessed is not None
    assert procedure.best.preprocessed.y.slope == pytest.approx(0.01, rel=0.05)


@pytest.mark.slow
def test_a_cancelling_pair_leads_to_a_lower_order() -> None:
    """First order, while nothing below 3 is asked for."""
    rng = np.random.default_rng(5)
    u = rng.normal(size=1500)
    y = arx_output(np.array([-0.8]), np.array([1.0]), 1, u, 0.3 * rng.normal(size=1500))
    procedure = run_procedure(IoData.from_arrays(u, y), orders=[3, 4])
    consistent(procedure)
    assert procedure.attempts[0].has(Problem.NON_MINIMAL)
    assert procedure.best.change == "lower orders"
    assert procedure.best.result is not None
    assert procedure.best.result.chosen.orders.na == 1
    assert procedure.problems == ()


@pytest.mark.slow
def test_what_stays_wrong_is_said() -> None:
    """A plant that is not linear: nothing helps, and the page must say so."""
    rng = np.random.default_rng(6)
    u = np.repeat(rng.normal(size=300), 5)
    y = arx_output(np.array([-0.9]), np.array([1.0]), 1, np.sign(u) * u**2, 0.0 * u)
    y += 0.02 * rng.normal(size=y.size)
    procedure = run_procedure(IoData.from_arrays(u, y))
    consistent(procedure)
    assert procedure.best.failed_tests
    assert len(procedure.attempts) > 3
    assert "Nothing is left to try" in procedure.stopped
    assert any("nonlinear" in sentence for sentence in procedure.meaning)


@pytest.mark.slow
def test_the_crane_keeps_the_choice_of_identify() -> None:
    record = read_record(CRANE, columns=("valve_opening", "oil_pressure"))
    procedure = run_procedure(IoData.from_record(record, "valve_opening", "oil_pressure"))
    consistent(procedure)
    assert procedure.best.result is not None
    assert procedure.best.result.chosen.orders == ArxOrders(2, 2, 1, offset=True)
    assert procedure.best.failed_tests == ("whiteness",)
    # Frequencies in cycles a sample, up to half of one.
    assert procedure.response is not None
    assert 0.49 < procedure.response.frequency_hz[-1] < 0.5


@pytest.mark.slow
@pytest.mark.parametrize("scaling", [False, True])
def test_scaling_changes_no_figure_in_the_units_of_the_record(scaling: bool) -> None:
    u, y = model16(seed=7, n=1200, noise=0.1)
    data = IoData.from_arrays(10.0 * u, 1e-3 * y + 0.15, dt_s=0.05)
    asked = Preprocessing(outliers=False, scaling=scaling)
    plain = run_procedure(data, preprocessing=Preprocessing(outliers=False))
    procedure = run_procedure(data, preprocessing=asked)
    one, two = plain.best, procedure.best
    assert one.model is not None
    assert two.model is not None
    np.testing.assert_allclose(two.model.theta, one.model.theta, rtol=1e-8, atol=1e-12)
    assert two.simulation_fit_percent == pytest.approx(one.simulation_fit_percent, rel=1e-8)
    assert plain.response is not None
    assert procedure.response is not None
    np.testing.assert_allclose(procedure.response.response, plain.response.response, rtol=1e-8)
    np.testing.assert_allclose(
        procedure.response.magnitude_band_db(), plain.response.magnitude_band_db(), rtol=1e-6
    )
    assert two.simulated is not None
    np.testing.assert_allclose(two.simulated.measured, data.y[two.simulated.index], rtol=1e-12)
    assert two.simulation_fit_percent == fit_percent(
        two.simulated.measured, two.simulated.predicted
    )


@pytest.mark.slow
def test_data_without_noise_pass() -> None:
    u, y = model16(seed=8, n=800, noise=0.0)
    procedure = run_procedure(IoData.from_arrays(u, y))
    consistent(procedure)
    assert procedure.best.exact
    assert procedure.best.sound
    assert "to within rounding" in procedure.meaning[0]


@settings(max_examples=10)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(30, 300), memory=st.floats(0.0, 0.9))
def test_the_gain_is_that_of_a_regression_with_newey_west_errors(
    seed: int, n: int, memory: float
) -> None:
    rng = np.random.default_rng(seed)
    e = rng.normal(size=n + 5)
    for k in range(1, n + 5):
        e[k] += memory * e[k - 1]
    index = np.arange(n + 5)
    zero = np.zeros(n + 5)
    old = Prediction(index, e, zero, (slice(0, n + 5),))
    new = Prediction(index[5:], (0.9 * e + 0.1)[5:], zero[5:], (slice(0, n),))
    fall, error = gain(new, old)
    difference = e[5:] ** 2 - (0.9 * e + 0.1)[5:] ** 2
    lags = int(np.ceil(n ** (1.0 / 3.0)))
    fit = sm.OLS(difference, np.ones(n)).fit(
        cov_type="HAC", cov_kwds={"maxlags": lags, "use_correction": False}
    )
    assert fall == pytest.approx(fit.params[0], rel=1e-9, abs=1e-12)
    assert error == pytest.approx(fit.bse[0], rel=1e-9)


def white(n: int, seed: int = 9) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=n)


def unstable() -> IoData:
    u = white(400)
    return IoData.from_arrays(
        u, arx_output(np.array([-1.05]), np.array([1.0]), 1, u, white(400, 1))
    )


def cancelling() -> IoData:
    u = white(900)
    y = arx_output(np.array([-0.8]), np.array([1.0]), 1, u, 0.3 * white(900, 1))
    return IoData.from_arrays(u, y)


BAD: dict[str, tuple[Callable[[], IoData], dict[str, object], Problem]] = {
    "too short": (lambda: IoData.from_arrays(white(40), white(40, 1)), {}, Problem.TOO_SHORT),
    "one sample": (lambda: IoData.from_arrays(white(1), white(1)), {}, Problem.TOO_SHORT),
    "empty": (lambda: IoData.from_arrays([], []), {}, Problem.TOO_SHORT),
    "torn": (
        lambda: IoData.from_arrays(
            white(400), white(400, 1), segments=[slice(k, k + 8) for k in range(0, 400, 10)]
        ),
        {},
        Problem.TOO_SHORT,
    ),
    "constant input": (
        lambda: IoData.from_arrays(np.full(600, 2.0), white(600)),
        {},
        Problem.CONSTANT_INPUT,
    ),
    "input stops": (
        lambda: IoData.from_arrays(np.r_[white(300), np.zeros(300)], white(600, 1)),
        {},
        Problem.CONSTANT_INPUT,
    ),
    "constant output": (
        lambda: IoData.from_arrays(white(600), np.full(600, 0.15)),
        {},
        Problem.CONSTANT_OUTPUT,
    ),
    "output moves at the start only": (
        lambda: IoData.from_arrays(white(600), np.r_[white(303, 1), np.zeros(297)]),
        {},
        Problem.CONSTANT_OUTPUT,
    ),
    "one sine, no noise": (
        lambda: IoData.from_arrays(
            np.sin(0.3 * np.arange(800)),
            arx_output(A16, B16, 1, np.sin(0.3 * np.arange(800)), np.zeros(800)),
        ),
        {"orders": [4, 5]},
        Problem.NO_EXCITATION,
    ),
    "one sine": (
        lambda: IoData.from_arrays(
            np.sin(0.3 * np.arange(800)),
            arx_output(A16, B16, 1, np.sin(0.3 * np.arange(800)), 0.01 * white(800)),
        ),
        {},
        Problem.NO_EXCITATION,
    ),
    "unrelated": (
        lambda: IoData.from_arrays(
            white(800), arx_output(np.array([-0.9]), np.array([0.0]), 1, white(800), white(800, 1))
        ),
        {},
        Problem.NO_RESPONSE,
    ),
    "unstable": (unstable, {"orders": [1]}, Problem.UNSTABLE),
    "non-minimal": (cancelling, {"orders": [2], "delays": [1]}, Problem.NON_MINIMAL),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", BAD)
def test_bad_data_are_named(case: str) -> None:
    data, options, expected = BAD[case]
    procedure = run_procedure(data(), **options)  # type: ignore[arg-type]
    consistent(procedure)
    found = {f.problem for f in procedure.problems}
    if case == "non-minimal":
        # The loop mends it; the first attempt names it.
        assert procedure.attempts[0].has(expected)
        assert found == set()
    else:
        assert expected in found, procedure.problems


def test_bad_settings_are_errors() -> None:
    u, y = model16(seed=10, n=600)
    data = IoData.from_arrays(u, y)
    for options in (
        {"orders": []},
        {"delays": []},
        {"orders": [0]},
        {"delays": [-1]},
        {"split": 2},
    ):
        with pytest.raises(IdentificationError):
            run_procedure(data, **options)  # type: ignore[arg-type]


@pytest.mark.thorough
@settings(max_examples=10)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(0, 120),
    levels=st.integers(1, 4),
    kind=st.sampled_from(["noise", "integral", "steps", "growing"]),
)
def test_nothing_breaks_whatever_the_data(seed: int, n: int, levels: int, kind: str) -> None:
    rng = np.random.default_rng(seed)
    u = rng.integers(0, levels, size=n).astype(float)
    y = {
        "noise": rng.normal(size=n),
        "integral": np.cumsum(u),
        "steps": np.round(np.cumsum(u - u.mean() if n else u) / 3.0),
        "growing": 1.3 ** np.arange(n),
    }[kind]
    consistent(run_procedure(IoData.from_arrays(u, y)))

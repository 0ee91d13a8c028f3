# SPDX-License-Identifier: MIT
"""Choice of order and delay: on known truth, on the paper's table, on the crane record."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from identification_truth import A16, B16, model16
from sources import ROOT

from ehsid.harness.models.identification import (
    ArxModel,
    ArxOrders,
    Candidate,
    Criteria,
    IdentificationError,
    IdentificationResult,
    IoData,
    TooFewSamplesError,
    UnexcitedError,
    fit_arx,
    fit_percent,
    fpe,
    identify,
    predict_one_step,
    simulate,
)
from ehsid.harness.models.identification.order_rules import (
    advise,
    choose_delay,
    choose_order,
    order_reason,
)
from ehsid.harness.records import read_record

CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"


@pytest.fixture(scope="module")
def crane() -> IdentificationResult:
    record = read_record(CRANE, columns=("valve_opening", "oil_pressure"))
    return identify(IoData.from_record(record, "valve_opening", "oil_pressure"))


def with_fit(order: int, fit: float, nk: int = 1, loss: float = 1.0) -> Candidate:
    orders = ArxOrders(order, order, nk)
    model = ArxModel(orders, np.zeros(2 * order), np.zeros((2 * order,) * 2), 0.0, 0.0, 0)
    figures = Criteria(1000, loss, loss, 0.0, loss)
    return Candidate(orders, model, fit, fit, figures, figures)


def test_the_paper_s_table_gives_third_order() -> None:
    table = [with_fit(*row) for row in ((2, 91.27), (3, 95.48), (4, 95.53), (5, 95.51))]
    chosen = choose_order(table, 0.05, 1e-10)
    assert chosen.orders.na == 3
    reason = order_reason(table, chosen, 0.05)
    # Misfits 8.73, 4.52, 4.47: 1 - 4.52/8.73 = 48.2 %, 1 - 4.47/4.52 = 1.1 %.
    for part in ("Order 3", "95.48 %", "91.27 %", "48.2 %", "order 4", "95.53 %", "only 1.1 %"):
        assert part in reason, reason


@pytest.mark.parametrize(
    ("fits", "expected"),
    [
        ([90.0, 90.1, 97.0, 97.01], 3),  # one order without gain on the way
        ([99.9, 99.95, 99.951, 99.952], 2),  # half the error is a gain, however good the fit
        ([90.0, 91.0, 92.0, 93.0], 4),  # every step counts: 10, 11 and 12.5 %
        ([90.0, 90.4, 90.8, 91.2], 1),  # 4 % a step do not add up
        ([90.0, 80.0, 70.0, 60.0], 1),
        ([100.0, 100.0, 100.0, 100.0], 1),
        ([-50.0, 20.0, 20.0, 20.0], 2),
    ],
)
def test_the_rule_for_the_order(fits: list[float], expected: int) -> None:
    table = [with_fit(order, fit) for order, fit in enumerate(fits, start=1)]
    assert choose_order(table, 0.05, 1e-10).orders.na == expected


@given(fits=st.lists(st.floats(-100, 99.99), min_size=1, max_size=8))
def test_the_chosen_order_balances_misfit_and_orders(fits: list[float]) -> None:
    """The rule in other words: least ln(misfit) + n ln(1/0.95)."""
    table = [with_fit(order, fit) for order, fit in enumerate(fits, start=1)]
    price = np.log(100.0 - np.array(fits)) - np.arange(len(fits)) * np.log(0.95)
    chosen = choose_order(table, 0.05, 0.0).orders.na - 1
    assert price[chosen] <= price.min() + 1e-12


def test_the_rule_for_the_delay() -> None:
    rng = np.random.default_rng(1)
    e = rng.normal(size=500)
    far, near, best = 1.5 * e, 1.001 * e + 0.05 * rng.normal(size=500), e
    judged = [
        (with_fit(2, 0.0, nk, float(np.mean(r**2))), r)
        for nk, r in ((1, far), (2, near), (3, best), (4, far))
    ]
    # Delay 1 is clearly worse, delay 2 is not.
    assert choose_delay(judged, 0.0).orders.nk == 2


@pytest.mark.slow
@settings(max_examples=15)
@given(
    seed=st.integers(0, 2**32 - 1),
    nk=st.integers(1, 5),
    u_scale=st.floats(1e-3, 1e3),
    y_scale=st.floats(1e-3, 1e3),
)
def test_order_and_delay_of_the_truth_are_found(
    seed: int, nk: int, u_scale: float, y_scale: float
) -> None:
    # Noise 0.01 against the smallest b, 0.295: a missing b multiplies the loss by 870.
    u, y = model16(seed=seed, n=800, noise=0.01, nk=nk)
    result = identify(IoData.from_arrays(u_scale * u, y_scale * y))
    assert result.chosen.orders == ArxOrders(3, 3, nk, offset=True)
    truth = np.concatenate((A16, B16 * y_scale / u_scale, [0.0]))
    # Seven parameters within 6 sigma: missed once in 10^8.
    error = np.abs(result.chosen.model.theta - truth)
    assert (error <= 6 * result.chosen.model.standard_deviations).all()
    assert f"Delay {nk}" in result.delay_reason


def test_the_mean_of_the_input_is_no_working_point_of_an_integrating_plant() -> None:
    """Model (16) has A(1) = 3e-4: why the default is an offset, and not the removal of means."""
    u, y = model16(seed=10, n=800, noise=0.01)
    fits = [
        identify(IoData.from_arrays(u, y), orders=[3], delays=[1], **options).chosen
        for options in ({}, {"offset": False, "remove_means": True})
    ]
    assert fits[0].simulation_fit_percent > 50.0
    assert fits[1].simulation_fit_percent < 0.0


def test_every_figure_of_a_candidate_by_hand() -> None:
    u, y = model16(seed=2, n=400, offset=0.2)
    data = IoData.from_arrays(u, y, dt_s=0.05)
    result = identify(data, orders=[2, (3, 2)], delays=[1, 2], split=0.6)
    assert [str(c.orders) for c in result.candidates] == [
        "na = nb = 2, nk = 1, offset",
        "na = nb = 2, nk = 2, offset",
        "na = 3, nb = 2, nk = 1, offset",
        "na = 3, nb = 2, nk = 2, offset",
    ]
    assert (result.n_estimation, result.n_validation) == (240, 160)
    skip = 3  # the longest history: na = 3, or nk + nb - 1 = 3
    first = IoData.from_arrays(u, y, segments=[slice(0, 240)])
    second = IoData.from_arrays(u, y, segments=[slice(240, 400)])
    for candidate in result.candidates:
        d = candidate.orders.n_parameters
        model = fit_arx(first, candidate.orders, skip=skip)
        ahead = predict_one_step(model, second, skip=skip)
        free = simulate(model, second, skip=skip)
        np.testing.assert_array_equal(candidate.model.theta, model.theta)
        assert candidate.one_step_fit_percent == fit_percent(ahead.measured, ahead.predicted)
        assert candidate.simulation_fit_percent == fit_percent(free.measured, free.predicted)
        assert candidate.estimation.n_rows == 237
        assert candidate.validation.n_rows == 157
        assert candidate.estimation.loss == pytest.approx(model.loss, rel=1e-9)
        assert candidate.estimation.fpe == fpe(candidate.estimation.loss, 237, d)
        assert candidate.validation.loss == pytest.approx(np.mean(ahead.residual**2))
        assert candidate.validation.fpe == fpe(candidate.validation.loss, 157, d)
    assert result.dt_s == 0.05
    assert result.one_step.index[0] == 243


def test_validation_data_do_not_touch_the_estimate() -> None:
    u, y = model16(seed=3, n=600)
    changed = y.copy()
    changed[300:] *= 3.0
    one, two = (
        identify(IoData.from_arrays(u, out), orders=[3], delays=[1]) for out in (y, changed)
    )
    np.testing.assert_array_equal(one.chosen.model.theta, two.chosen.model.theta)


def test_the_crane_record(crane: IdentificationResult) -> None:
    """Customary split, samples 1-512 and 513-1024; second order, as there is no more to gain."""
    assert (crane.n_estimation, crane.n_validation) == (512, 512)
    assert [c.orders.na for c in crane.by_order] == [2, 3, 4, 5]
    assert crane.chosen.orders == ArxOrders(2, 2, 1, offset=True)
    assert crane.dt_s is None
    # The best one-step fit of the others would remove less than 5 % of the misfit.
    misfit = [100 - c.one_step_fit_percent for c in crane.by_order]
    assert min(misfit[1:]) > 0.95 * misfit[0]
    assert "Order 2" in crane.reason
    assert "hardly tell them apart" in crane.delay_reason
    # A linear model predicts this valve-to-pressure record well, but simulates it badly.
    assert crane.chosen.one_step_fit_percent > 90.0
    assert crane.chosen.simulation_fit_percent < 50.0
    assert not crane.whiteness.passed
    assert any("not white" in text for text in crane.advice)


def test_the_result_becomes_json(crane: IdentificationResult) -> None:
    plain = json.loads(json.dumps(crane.to_dict(), allow_nan=False))
    assert plain["chosen"]["orders"] == {"na": 2, "nb": 2, "nk": 1, "offset": True}
    assert plain["chosen"]["model"]["names"] == ["a1", "a2", "b1", "b2", "offset"]
    assert len(plain["candidates"]) == 20
    assert len(plain["whiteness"]["correlation"]) == 25
    assert "one_step" not in plain


def test_data_without_noise_reject_higher_orders_and_say_so() -> None:
    u, y = model16(seed=4, n=600, noise=0.0)
    result = identify(IoData.from_arrays(u, y), delays=[1])
    assert result.chosen.orders == ArxOrders(3, 3, 1, offset=True)
    assert [r.orders.na for r in result.rejected] == [4, 5]
    assert all("order is too high" in r.why for r in result.rejected)
    assert result.chosen.simulation_fit_percent == pytest.approx(100.0, abs=1e-6)
    json.dumps(result.to_dict(), allow_nan=False)


def test_gaps_are_respected() -> None:
    u, y = model16(seed=5, n=900, noise=0.01)
    y[300:310] = 1e3  # rubbish inside the gap
    segments = [slice(0, 300), slice(310, 315), slice(330, 900)]
    result = identify(IoData.from_arrays(u, y, segments=segments), delays=range(1, 3))
    assert result.chosen.orders == ArxOrders(3, 3, 1, offset=True)
    assert len(result.one_step.runs) == 1
    assert result.n_estimation == round(0.5 * (300 + 5 + 570))


def test_an_unstable_model_still_gives_a_result() -> None:
    u, y = model16(seed=6, n=600)
    growing = y * 1.02 ** np.arange(600)
    result = identify(IoData.from_arrays(u, growing), orders=[1, 2], delays=[1])
    assert result.chosen.simulation_fit_percent < 0.0
    assert any("does not simulate" in text for text in result.advice)
    assert "inf" not in " ".join([result.reason, *result.advice])
    json.dumps(result.to_dict(), allow_nan=False)


def test_what_cannot_be_identified_is_said() -> None:
    u, y = model16(seed=7, n=600)
    with pytest.raises(TooFewSamplesError, match="expected at least 20"):
        identify(IoData.from_arrays(u[:50], y[:50]))
    with pytest.raises(UnexcitedError, match="b1"):
        identify(IoData.from_arrays(np.ones(600), y))
    with pytest.raises(IdentificationError, match="output 'y' is constant in the validation part"):
        identify(IoData.from_arrays(u, np.where(np.arange(600) < 300, y, 0.0)))
    with pytest.raises(IdentificationError, match="no order or no delay"):
        identify(IoData.from_arrays(u, y), orders=[])
    with pytest.raises(IdentificationError, match="between 0 and 1"):
        identify(IoData.from_arrays(u, y), split=1.0)
    with pytest.raises(IdentificationError, match="min_improvement"):
        identify(IoData.from_arrays(u, y), min_improvement=1.0)


def multisine_through_a_dead_band(count: int = 2000, period: int = 100) -> IoData:
    """A periodic command through a dead band, a delay and two poles; there is no feedback."""
    time = np.arange(count)
    u = sum(np.sin(2.0 * np.pi * k * time / period + k**2) for k in range(1, 6))
    through = np.concatenate([[0.0], (np.sign(u) * np.maximum(np.abs(u) - 1.0, 0.0))[:-1]])
    y = scipy.signal.lfilter([0.1], [1.0, -1.7, 0.75], through)
    return IoData.from_arrays(u, y + 1e-4 * np.random.default_rng(3).normal(size=count))


def test_a_plant_that_is_not_linear_is_not_taken_for_a_closed_loop() -> None:
    result = identify(multisine_through_a_dead_band(), orders=[1, 2, 3, 4], delays=[1, 2, 3])
    assert result.independence.feedback
    text = " ".join(result.advice)
    assert "two possible reasons" in text
    assert "as in a periodic or slow command" in text
    assert "`ehsid gap` looks for such effects" in text


def test_what_was_tried_is_not_proposed() -> None:
    result = identify(multisine_through_a_dead_band(), orders=[1, 2, 3], delays=[1, 2])
    low, high = result.by_order[0], result.by_order[-1]

    def advised(chosen: Candidate, delay: int, tried: list[int], lag: int = 1) -> str:
        moved = replace(chosen, orders=replace(chosen.orders, nk=delay))
        by_order = [moved if each is chosen else each for each in result.by_order]
        depends = np.where(result.independence.lags == lag, -0.5, 0.1)
        failed = replace(result.independence, passed=False, correlation=depends)
        return " ".join(advise(by_order, moved, tried, result.whiteness, failed, 0.05, 1000, None))

    assert "Try " not in advised(low, 1, [1, 2])
    assert "Higher orders and longer delays were tried" in advised(low, 1, [1, 2])
    assert "Try a longer delay. If this does not help, " in advised(low, 2, [1, 2])
    assert "Try a higher order. If this does not help, " in advised(high, 1, [1, 2])
    assert "Try a higher order or a longer delay. If" in advised(high, 1, [1])
    assert "`ehsid gap`" in advised(low, 1, [1, 2])
    # An input from before the longest delay: nothing else can be concluded before it was tried.
    beyond = advised(low, 1, [1, 2], lag=12)
    assert "try delays up to 15 (--delays 1-15)." in beyond
    assert "(--delays 1-15) or a higher order." in advised(high, 1, [1, 2], lag=12)
    assert "not linear" not in beyond
    assert "Higher orders and longer delays were tried" in advised(low, 1, [1, 12], lag=12)
    # The three b of the highest order reach from delay 2 to lag 4.
    assert "--delays" not in advised(high, 2, [1, 2], lag=4)


@pytest.mark.parametrize(("lag", "seed"), [(12, 1), (17, 3)])
def test_a_dead_time_beyond_the_delays_tried_is_pointed_at_and_then_found(
    lag: int, seed: int
) -> None:
    """The plant of SIPPY's Ex_RECURSIVE.py, linear, with a longer dead time than was tried."""
    rng = np.random.default_rng(seed)
    u = np.cumprod(np.where(rng.random(800) < 0.1, -1.0, 1.0))
    a = [1.0, -2.21, 1.7494, -0.584256, 0.0684029]
    delayed = np.concatenate((np.zeros(lag), u))[: u.size]
    noise = scipy.signal.lfilter([1.0, 0.3, 0.2], a, 0.1 * rng.normal(size=u.size))
    y = scipy.signal.lfilter([1.5, -2.07, 1.3146], a, delayed) + noise
    data = IoData.from_arrays(u, y)
    before = " ".join(identify(data).advice)
    assert f"that of {lag} samples ago" in before
    assert f"--delays 1-{lag + 3}" in before
    assert "not linear" not in before
    found = identify(data, delays=range(1, lag + 4))
    # A delay that is short by one costs one small coefficient, see `choose_delay`.
    assert found.chosen.orders.nk in (lag - 1, lag)
    assert found.independence.passed


def test_an_order_that_simulates_worse_than_the_mean_is_no_advice() -> None:
    table = [with_fit(2, -80.0), with_fit(3, -20.0)]
    result = identify(multisine_through_a_dead_band(), orders=[1], delays=[1])
    for simulated, told in ((-20.0, False), (20.0, True)):
        table[1] = replace(table[1], simulation_fit_percent=simulated)
        tests = (result.whiteness, result.independence)
        advice = advise(table, table[0], [1], *tests, 0.05, 1000, None)
        assert any("Another order simulates better" in one for one in advice) == told


@pytest.mark.parametrize(
    ("count", "dt_s", "short"),
    [
        (800, None, False),
        (500, None, True),
        (500, 0.02, True),
        (800, 2e-3, True),
        (2000, 2e-3, False),
    ],
)
def test_a_short_record_is_called_short(count: int, dt_s: float | None, short: bool) -> None:
    u, y = model16(seed=8, n=count, noise=0.01)
    result = identify(IoData.from_arrays(u, y, dt_s=dt_s))
    assert any("The record is short: " in text for text in result.advice) == short


def test_advice_at_the_edge_of_the_range() -> None:
    u, y = model16(seed=8, n=800, noise=0.01, nk=2)
    result = identify(IoData.from_arrays(u, y), orders=[1, 2], delays=[1, 2])
    edges = ("try higher ones", "try longer ones")
    if not result.independence.passed:
        edges = ("try delays up to ", " or a higher order")
    assert all(any(edge in text for text in result.advice) for edge in edges)
    inside = identify(IoData.from_arrays(u, y))
    assert inside.advice == ()

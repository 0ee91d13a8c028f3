# SPDX-License-Identifier: MIT
"""compare(): the usual coefficients of many records, and those that are far from them."""

from dataclasses import replace
from functools import cache

import model16
import numpy as np
import pytest

import ehsid
from ehsid.harness.models.estimation import Estimate, Named, Recursion, compare, estimate_all
from ehsid.harness.models.estimation.servo import ServoPath, ServoValue
from ehsid.harness.models.estimation.spread import distance_limit, distances
from ehsid.harness.models.identification import ArxOrders, IoData


@cache
def made() -> tuple[Estimate, ...]:
    """Estimates of ten records of model (16), whose coefficients differ by chance only."""
    data = [IoData.from_arrays(*model16.signals(seed, 900)) for seed in range(10)]
    recursion = Recursion(ArxOrders(3, 3, 1), ehsid.Constant(1.0))
    found = [one for one in estimate_all(data, recursion) if isinstance(one, Estimate)]
    assert len(found) == len(data)
    return tuple(found)


def named(dt_s: float | None = 0.05) -> list[Named]:
    return [Named(f"r{i}.csv", dt_s, one) for i, one in enumerate(made())]


def moved(one: Named, by: float) -> Named:
    theta = one.estimate.theta + by * np.eye(6)[3]
    return replace(one, estimate=replace(one.estimate, theta=theta))


def test_the_figures_of_a_coefficient_are_those_of_numpy() -> None:
    found = compare(named(), {"bad.csv": "why"})
    values = np.array([one.theta for one in made()])
    assert [one.name for one in found.coefficients] == ["a1", "a2", "a3", "b1", "b2", "b3"]
    for j, one in enumerate(found.coefficients):
        column = values[:, j]
        assert one.median == np.median(column)
        mad = np.median(np.abs(column - np.median(column)))
        assert one.spread == pytest.approx(1.4826 * mad, rel=1e-12)
        assert (one.low, one.high) == pytest.approx(tuple(np.quantile(column, [0.05, 0.95])))
        own = np.median([record.standard_deviation[j] for record in made()])
        assert one.standard_deviation == own
    assert found.outliers == ()
    assert (found.compared, found.dt_s, found.failed) == (10, 0.05, {"bad.csv": "why"})
    assert [one.file for one in found.records] == [f"r{i}.csv" for i in range(10)]
    assert found.records[3].estimate == made()[3].to_dict()
    assert found.records[3].samples == 900


def test_a_record_that_is_far_from_the_others_is_named_with_its_coefficient() -> None:
    records = named()
    records[4] = moved(records[4], 2.0)
    found = compare(records, {})
    assert [(one.file, one.coefficient) for one in found.outliers] == [("r4.csv", "b1")]
    b1 = found.coefficients[3]
    own = records[4].estimate.standard_deviation[3]
    value = records[4].estimate.theta[3]
    assert found.outliers[0].value == value
    ratios = [
        abs(one.estimate.theta[3] - b1.median) / one.estimate.standard_deviation[3]
        for one in records
    ]
    shown = min(1.0, 1.4826 * float(np.median(ratios)))
    distance = abs(value - b1.median) / max(b1.spread, shown * own)
    assert found.outliers[0].distance == pytest.approx(distance, rel=1e-12)
    assert found.limit is not None
    assert distance > found.limit


def test_a_record_that_states_a_wide_interval_may_be_far_away() -> None:
    records = named()
    far = moved(records[4], 2.0)
    wide = replace(far.estimate, standard_deviation=np.full(6, 1.0))
    records[4] = replace(far, estimate=wide)
    assert compare(records, {}).outliers == ()


def test_records_that_all_state_too_wide_intervals_are_judged_by_what_they_show() -> None:
    records = named()
    wide = [
        replace(one, estimate=replace(one.estimate, standard_deviation=np.full(6, 50.0)))
        for one in records
    ]
    assert compare(wide, {}).outliers == ()
    wide[4] = moved(wide[4], 2.0)
    assert [one.file for one in compare(wide, {}).outliers] == ["r4.csv"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "count", [5, *(pytest.param(n, marks=pytest.mark.thorough) for n in (20, 100))]
)
def test_equal_machines_hardly_ever_have_an_outlier(count: int) -> None:
    rng = np.random.default_rng(count)
    limit = distance_limit(count, 6)
    assert limit is not None
    runs, alarms = 2000, 0
    for _ in range(runs):
        values = rng.standard_normal((count, 6))
        median = np.median(values, axis=0)
        spread = 1.4826 * np.median(np.abs(values - median), axis=0)
        alarms += bool((distances(values, np.zeros_like(values), median, spread) > limit).any())
    # At most 1 % as the limit is set, and 2 % for the approximation: 3 deviations of the binomial
    # distribution lie below 0.02 + 3 sqrt(0.02 / 2000) = 0.03.
    assert alarms / runs < 0.03


def test_equal_values_are_no_distance_and_others_an_infinite_one_where_nothing_varies() -> None:
    values = np.array([[1.0], [1.0], [2.0]])
    found = distances(values, np.zeros((3, 1)), np.array([1.0]), np.array([0.0]))
    assert found.tolist() == [[0.0], [0.0], [np.inf]]


def test_few_records_tell_no_outlier() -> None:
    records = [moved(named()[0], 50.0), *named()[1:4]]
    found = compare(records, {})
    assert (found.limit, found.outliers) == (None, ())


def test_records_of_another_sampling_time_are_shown_but_not_compared() -> None:
    records = named()
    records[2] = replace(moved(records[2], 5.0), dt_s=0.1)
    records[3] = replace(records[3], dt_s=None)
    records[5] = replace(records[5], dt_s=0.0502)  # within what a record allows in itself
    found = compare(records, {})
    assert (found.compared, found.dt_s, found.outliers) == (8, 0.05, ())
    texts = ["; ".join(one.warnings) for one in found.records]
    assert [i for i, text in enumerate(texts) if "sampling time" in text] == [2, 3]
    assert "sampling time 0.1 s where most records have 0.05 s" in texts[2]
    assert "sampling time unknown" in texts[3]
    assert compare(named(None), {}).dt_s is None


def test_the_constant_term_belongs_to_the_record_and_is_not_compared() -> None:
    with_offset = []
    for number, one in enumerate(named()):
        estimate = one.estimate
        orders = replace(estimate.orders, offset=True)
        theta = np.append(estimate.theta, 1e3 * (number == 0))
        deviation = np.append(estimate.standard_deviation, 1e-3)
        told = replace(estimate, orders=orders, theta=theta, standard_deviation=deviation)
        with_offset.append(replace(one, estimate=told))
    found, without = compare(with_offset, {}), compare(named(), {})
    assert found.coefficients == without.coefficients
    assert found.outliers == without.outliers
    assert found.records[0].estimate["parameters"]["offset"]["value"] == 1e3


def as_servo(one: Named, gain: float, share: float, why: ehsid.TrustReason) -> Named:
    """The same, read as a servo with this K, which is known to 1 %."""

    def value(name: str, told: float) -> ServoValue:
        paths = (np.array([told]), np.array([0.01 * told]), np.array([share > 0.0]))
        return ServoValue(name, "", *paths, share, why)

    path = ServoPath(value("K", gain), value("omega_n", 40.0), value("xi", 0.4), 1, 0)
    return replace(one, estimate=replace(one.estimate, servo=path))


def test_the_gain_of_a_servo_is_compared_where_it_can_be_trusted() -> None:
    good, bad = ehsid.TrustReason.trusted, ehsid.TrustReason.not_precise
    gains = [0.03 + 1e-5 * i for i in range(9)]
    records = [as_servo(one, gain, 1.0, good) for one, gain in zip(named(), gains, strict=False)]
    records[4] = as_servo(records[4], 0.06, 0.5, good)
    records.append(as_servo(named()[9], 9.0, 0.0, bad))
    found = compare(records, {})
    assert [one.name for one in found.coefficients][:4] == ["K", "omega_n", "xi", "a1"]
    assert found.coefficients[0].median == pytest.approx(gains[5])
    assert [(one.file, one.coefficient) for one in found.outliers] == [("r4.csv", "K")]
    assert "K not trusted (not_precise)" in found.records[9].warnings
    assert found.records[9].interval("K") == pytest.approx((9.0, 8.91, 9.09))
    assert np.isnan(compare(named(), {}).records[0].interval("K")).all()


def test_warnings_say_what_is_wrong_with_a_record() -> None:
    records = named()
    bad = replace(
        made()[0],
        settled=True,
        converged=False,
        residuals_white=False,
        whiteness=99.5,
        resets=2,
        simulation_fit_percent=-np.inf,
    )
    records[0] = replace(records[0], estimate=bad)
    records[1] = replace(records[1], estimate=replace(made()[1], converged=True, resets=1))
    records[2] = replace(records[2], estimate=replace(made()[2], converged=True, resets=0))
    found = compare(records, {}).records
    assert found[0].warnings == (
        "settled, not converged",
        "residuals not white (statistic 99.5)",
        "2 resets",
        "the model is unstable",
    )
    assert found[1].warnings == ("1 reset",)
    assert found[2].warnings == ()


def test_how_a_log_was_read_stands_with_its_estimate() -> None:
    records = [replace(named()[0], reading={"kind": "text"}), *named()[1:]]
    assert compare(records, {}).records[0].estimate["reading"] == {"kind": "text"}

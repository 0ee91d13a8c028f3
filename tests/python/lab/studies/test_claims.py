# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import ehsid
from ehsid.lab.studies.claims import (
    ORDERS,
    SAMPLES,
    Comparison,
    Condition,
    Finding,
    Input,
    Interval,
    Judged,
    excite,
    judge,
    judge_reset,
    map_claims,
    sooner,
)
from ehsid.lab.studies.comparison import (
    PLAIN,
    Contender,
    KnownPlant,
    Setting,
    joined,
    known_records,
    run_contender,
)
from ehsid.lab.studies.experiment import published_error_of_one, start_of_one
from ehsid.lab.studies.rig_records import MODEL_16
from ehsid.lab.studies.verdicts import Verdict, verdicts

PLANT = KnownPlant.of(ORDERS, MODEL_16)


@pytest.mark.parametrize("kind", Input)
def test_inputs_have_the_rms_they_say(kind: Input) -> None:
    rms = [np.sqrt(np.mean(excite(kind, np.random.default_rng(seed)) ** 2)) for seed in range(20)]
    # Steps: some 90 levels a record, each with a variance of u^2 of 0.8 of its mean square:
    # 5 % a record, 1 % of the mean of twenty; three of them.
    assert np.mean(rms) == pytest.approx(1.5, rel=0.035)


@pytest.mark.parametrize("p0", [1e-4, 1e-2, 1.0, 1e2])
def test_lambda_one_is_least_squares_drawn_to_its_start(p0: float) -> None:
    """min |y - Phi theta|^2 + |theta|^2 / p0, solved by numpy: what the map's P0 means."""
    records = known_records(PLANT, lambda rng: excite(Input.multisine, rng), 0.1, [4])
    u, y = records[0]
    phi = np.column_stack([-y[2:-1], -y[1:-2], -y[:-3], u[2:-1], u[1:-2], u[:-3]])
    stacked = np.vstack([phi, np.eye(6) / np.sqrt(p0)])
    expected, *_ = np.linalg.lstsq(stacked, np.concatenate([y[3:], np.zeros(6)]))
    found = run_contender(
        Contender(ehsid.Constant(1.0), options=PLAIN),
        records,
        PLANT.theta_path(SAMPLES),
        Setting(ORDERS, p0=p0, dtype="float64"),
    )
    # Two thousand updates in double; the information matrix has a condition of about 1e8.
    np.testing.assert_allclose(found.theta[0], expected, rtol=1e-6)


def test_the_map_judges_the_recursion_of_the_paper_without_guards() -> None:
    """From a trusted start the guard against wind-up would take every sample for uninformative."""
    records = known_records(PLANT, lambda rng: excite(Input.multisine, rng), 0.03, range(6))
    truth, setting = PLANT.theta_path(SAMPLES), Setting(ORDERS, p0=1e-4)
    fixed, varying = (
        run_contender(Contender(policy, options=PLAIN), records, truth, setting)
        for policy in (ehsid.Constant(0.99), ehsid.Exponential(0.99))
    )
    guarded = run_contender(Contender(ehsid.Constant(0.99)), records, truth, setting)
    assert np.median(guarded.spread) < 0.1 * np.median(fixed.spread)
    (found,) = judge(1e-4, 0.03, Input.multisine, [0.99], range(6))
    ratios = varying.spread / fixed.spread
    assert found.calmer.ratio.median == pytest.approx(np.median(ratios), rel=1e-12)


def test_spread_is_that_of_the_last_quarter() -> None:
    records = known_records(PLANT, lambda rng: excite(Input.multisine, rng), 0.1, [9])
    truth = PLANT.theta_path(SAMPLES)
    contender = Contender(ehsid.Constant(0.99), options=PLAIN)
    found = run_contender(contender, records, truth, Setting(ORDERS))
    late = found.theta_path[SAMPLES - SAMPLES // 4 :]
    by_hand = np.sqrt(sum(np.var(late[:, i]) for i in range(6))) / np.linalg.norm(MODEL_16)
    assert found.spread[0] == pytest.approx(by_hand, rel=1e-12)


def test_groups_of_runs_joined_are_the_runs() -> None:
    def outcome(seeds: list[int]):
        records = known_records(PLANT, lambda rng: excite(Input.prbs, rng), 0.1, seeds)
        contender = Contender(ehsid.Exponential(), options=PLAIN)
        return run_contender(contender, records, PLANT.theta_path(SAMPLES), Setting(ORDERS))

    whole, parts = outcome([1, 2, 3]), joined([outcome([1, 2]), outcome([3])])
    for name in ("error", "spread", "theta", "rmse"):
        np.testing.assert_array_equal(getattr(whole, name), getattr(parts, name))


@pytest.mark.slow
def test_map_is_the_judgements_in_order() -> None:
    found = map_claims(
        p0s=[1.0, 1e6],
        noises=[0.03],
        inputs=[Input.multisine],
        lambda0s=[0.95, 0.99],
        seeds=range(6),
    )
    alone = [
        cell
        for p0 in (1.0, 1e6)
        for cell in judge(p0, 0.03, Input.multisine, [0.95, 0.99], range(6))
    ]
    assert found == alone


def test_what_the_paper_says_comes_out_of_a_trusted_start_only() -> None:
    """From P0 = 1 the varying factor is faster than lambda = 1; from a vague start it is not."""
    (trusted,) = judge(1.0, 0.03, Input.multisine, [0.99], range(12))
    (vague,) = judge(1e6, 0.03, Input.multisine, [0.99], range(12))
    assert trusted.faster.finding is Finding.holds
    assert trusted.lower_rmse.finding is Finding.holds
    assert vague.faster.finding is not Finding.holds
    assert vague.lower_rmse.finding is Finding.equal
    assert trusted.calmer.finding is vague.calmer.finding is Finding.holds


def test_reset_helps_where_the_change_is_large_against_the_noise() -> None:
    seen = judge_reset(0.01, 1.5, range(8))
    unseen = judge_reset(0.151, 1.25, range(8))
    assert seen.sooner.finding is Finding.holds
    assert seen.fired == 1.0
    assert seen.false_alarms == 0.0
    assert unseen.fired < 0.5


def test_neither_arriving_is_no_victory() -> None:
    never = np.full(8, 100)
    assert sooner(never, never, 100).finding is Finding.neither
    assert sooner(np.full(8, 10), never, 100).finding is Finding.holds


def cell(p0: float, error: float, finding: Finding = Finding.holds) -> Judged:
    comparison = Comparison(Interval(0.5, 0.4, 0.6), finding)
    return Judged(
        Condition(p0, 0.1, Input.multisine, 0.99),
        comparison,
        comparison,
        comparison,
        Interval(error, error, error),
    )


def test_start_is_read_off_the_curve_of_errors() -> None:
    cells = (cell(1e-2, 0.9), cell(1.0, 0.5), cell(1e2, 0.1))
    assert start_of_one(cells, 0.1, 0.3) == pytest.approx(10.0)
    assert start_of_one(cells, 0.1, 0.7) == pytest.approx(0.1)


def test_distance_of_the_published_column() -> None:
    # By hand: differences 0.0370, 0.0987, 0.0614, 0.3506, 0.6868, 0.3632 over a size of 3.0094.
    assert published_error_of_one() == pytest.approx(0.8610 / 3.0094, rel=1e-3)


def test_verdicts_over_a_map() -> None:
    good, bad = cell(1e-2, 0.9), cell(1e6, 0.0, Finding.fails)
    reset = judge_reset(0.01, 1.5, range(6))
    for cells, expected in (
        ([good, good], Verdict.holds),
        ([bad, bad], Verdict.fails),
        ([good, bad], Verdict.partly),
    ):
        found = verdicts(cells, [reset])
        assert [verdict.verdict for verdict in found[:3]] == [expected] * 3
    assert "holds for P0 0.01" in found[0].where()
    assert "does not for P0 1e+06" in found[0].where()

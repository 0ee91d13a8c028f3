# SPDX-License-Identifier: MIT
import numpy as np
import pytest

import ehsid
from ehsid.harness.models.identification import ArxOrders
from ehsid.lab.studies import MODEL_16, Contender, KnownPlant, Outcome, Setting, compare

ORDERS = ArxOrders(3, 3, 1)
N = 400


def outcome(error: list[list[float]]) -> Outcome:
    runs = np.array(error)
    return Outcome(
        error=runs,
        spread=np.zeros(runs.shape[0]),
        theta=np.zeros((runs.shape[0], 6)),
        rmse=np.zeros(runs.shape[0]),
        forgetting_factor=np.ones(runs.shape[1]),
        theta_path=np.zeros((runs.shape[1], 6)),
        resets=(),
    )


def test_settling_is_the_first_sample_of_the_rest_within_tolerance() -> None:
    found = outcome([[9, 1, 9, 1, 1], [1, 1, 1, 1, 1], [9, 9, 9, 9, 9]]).settling(2.0)
    assert found.tolist() == [3, 0, 5]
    assert outcome([[9, 1, 9, 1, 1]]).settling(2.0, start=1).tolist() == [2]


def test_every_contender_sees_the_same_records() -> None:
    twice = {"one": Contender(ehsid.Constant(1.0)), "two": Contender(ehsid.Constant(1.0))}
    found = compare(
        KnownPlant.of(ORDERS, MODEL_16),
        twice,
        excite=lambda rng: rng.standard_normal(N),
        noise=0.1,
        seeds=range(3),
    )
    np.testing.assert_array_equal(found["one"].error, found["two"].error)
    assert np.ptp(found["one"].rmse) > 0.0  # another seed, another record


def test_figures_against_batch_least_squares() -> None:
    """Lambda = 1 from a vague start is least squares over the record."""
    plant = KnownPlant.of(ORDERS, MODEL_16)
    found = compare(
        plant,
        {"ls": Contender(ehsid.Constant(1.0))},
        excite=lambda rng: rng.standard_normal(N),
        noise=0.1,
        seeds=[7],
        setting=Setting(ORDERS, dtype="float64"),
    )["ls"]
    rng = np.random.default_rng(7)
    u = rng.standard_normal(N)
    y = plant.respond(u, 0.1 * rng.standard_normal(N))
    phi = np.column_stack([-y[2:-1], -y[1:-2], -y[:-3], u[2:-1], u[1:-2], u[:-3]])
    batch, *_ = np.linalg.lstsq(phi, y[3:])
    # P0 = 1e6 against P(N) of 1e-2 at most: the prior shifts theta by 1e-8 of itself. Samples
    # skipped for want of information are the rest; their share of the information is below
    # sqrt(6) / N of a direction.
    assert np.linalg.norm(found.theta[0] - batch) < 1e-2 * np.linalg.norm(batch)
    truth = np.array(MODEL_16)
    assert found.error[0, -1] == pytest.approx(
        np.linalg.norm(found.theta[0] - truth) / np.linalg.norm(truth), rel=1e-12
    )
    np.testing.assert_array_equal(found.theta_path[-1], found.theta[0])
    # The innovation in the long run is the equation error; its rms scatters by 1 / sqrt(2 N), and
    # the first few dozen innovations, from an ignorant model, come on top.
    assert found.rmse[0] > 0.1 * (1 - 4 / np.sqrt(2 * N))


def test_resets_are_listed_only_where_asked_for() -> None:
    after = np.array(MODEL_16) * np.array([1, 1, 1, 1.5, 1.5, 1.5])
    found = compare(
        KnownPlant.of(ORDERS, MODEL_16).changed(200, after),
        {
            "with": Contender(ehsid.Constant(1.0), reset=True),
            "without": Contender(ehsid.Constant(1.0)),
        },
        excite=lambda rng: rng.standard_normal(N),
        noise=0.001,
        seeds=range(2),
    )
    assert all(times.size == 0 for times in found["without"].resets)
    # A change of half of b moves the output by hundreds of times the noise: seen within the short
    # window of 10 samples.
    for times in found["with"].resets:
        assert times.size == 1
        assert 200 < times[0] <= 210
    assert found["with"].error[:, -1].max() < found["without"].error[:, -1].min()

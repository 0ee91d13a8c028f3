# SPDX-License-Identifier: MIT
import gap_cases as made
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.spectrum import BANDS
from ehsid.harness.diagnosis.schema import SKIP_S, WINDOW_S
from ehsid.harness.diagnosis.search.candidates import FittedCandidate
from ehsid.harness.diagnosis.search.gap_reduction import WindowSums
from ehsid.harness.diagnosis.search.intervals import above_floor, likelihood_gain

WINDOWS, LENGTH = 40, 250
SCALES = np.array([5e-6, 1e4, 1e4])


@pytest.fixture(scope="module")
def case() -> Case:
    """Records of 40 windows of 250 samples."""
    seconds = WINDOWS * WINDOW_S + SKIP_S
    records = [made.record({}, seed, seconds=seconds) for seed in (1, 2)]
    return make_case(made.RIG, records[:1], records[1:])


def candidate(errors: np.ndarray, held_out_cost: float = 0.0) -> FittedCandidate:
    """errors: (windows, samples, outputs), in units of the sensors' noise."""
    windows, length, outputs = errors.shape
    squares = np.sum((errors * SCALES) ** 2, axis=1)
    counts = np.full(windows, float(length))
    powers = np.zeros((windows, outputs, BANDS))
    sums = WindowSums({}, {}, counts)
    return FittedCandidate(
        (), np.zeros(0), {}, 0.0, held_out_cost, True, squares, counts, powers, powers, sums
    )


def of_size(size: float, seed: int) -> FittedCandidate:
    rng = np.random.default_rng(seed)
    return candidate(size * rng.standard_normal((WINDOWS, LENGTH, 3)), 1e3 * size)


@pytest.mark.slow
@given(a=st.floats(0.01, 100.0), b=st.floats(0.01, 100.0))
def test_swapping_the_candidates_changes_the_sign(case: Case, a: float, b: float) -> None:
    first, second = of_size(a, 1), of_size(b, 2)
    gain, loss = likelihood_gain(case, first, second), likelihood_gain(case, second, first)
    assert gain.nats == pytest.approx(-loss.nats, abs=1e-9)
    assert gain.nats == pytest.approx(1e3 * (b - a), abs=1e-9)
    assert gain.relative == pytest.approx(-loss.relative, abs=1e-12)


def test_a_candidate_gains_nothing_over_itself(case: Case) -> None:
    same = of_size(3.0, 1)
    gain = likelihood_gain(case, same, same)
    assert (gain.nats, gain.relative) == (0.0, 0.0)


def test_relative_gain_is_the_log_ratio_of_errors_with_the_floor(case: Case) -> None:
    """Computed by hand, sample by sample."""
    rng = np.random.default_rng(3)
    errors = [size * rng.standard_normal((WINDOWS, LENGTH, 3)) for size in (0.5, 4.0)]
    gain = likelihood_gain(case, *map(candidate, errors))
    floors = [case.floors[name].value for name in case.outputs]
    logs = []
    for error in errors:
        total = 0.0
        for column, floor in enumerate(floors):
            mse = np.mean((error[:, :, column] * SCALES[column]) ** 2)
            total += np.log(np.sqrt(mse + floor**2))
        logs.append(total)
    assert gain.relative == pytest.approx((logs[1] - logs[0]) / 3.0, rel=1e-12)


def test_errors_at_the_floor_are_not_above_it(case: Case) -> None:
    floors = np.array([case.floors[name].value for name in case.outputs]) / SCALES
    sign = np.where(np.arange(LENGTH) % 2, 1.0, -1.0)
    at_floor = np.broadcast_to(sign[:, np.newaxis] * floors, (WINDOWS, LENGTH, 3))
    assert above_floor(case, candidate(at_floor)) == pytest.approx(0.0, abs=1e-12)
    # With e = sqrt(7) floors, sqrt(e^2 + floor^2) is twice sqrt(2 floor^2).
    assert above_floor(case, candidate(np.sqrt(7.0) * at_floor)) == pytest.approx(np.log(2.0))

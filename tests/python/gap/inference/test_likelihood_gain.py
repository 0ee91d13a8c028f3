# SPDX-License-Identifier: MIT
import gap_cases as made
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_spectra import spectrum_of

from ehsid.harness.gap.inference.candidates import FittedCandidate
from ehsid.harness.gap.inference.gap_reduction import WindowSums
from ehsid.harness.gap.inference.likelihood_gain import above_floor, likelihood_gain
from ehsid.harness.gap.model.case import Case, make_case
from ehsid.harness.gap.thresholds import SKIP_S, WINDOW_S

WINDOWS, LENGTH = 40, 250
OUTPUTS = ("position_m", "pressure_a_pa", "pressure_b_pa")
SCALES = np.array([5e-6, 1e4, 1e4])


@pytest.fixture(scope="module")
def case() -> Case:
    """Records of 40 windows of 250 samples."""
    seconds = WINDOWS * WINDOW_S + SKIP_S
    records = [made.record({}, seed, seconds=seconds) for seed in (1, 2)]
    return make_case(made.RIG, records[:1], records[1:])


def candidate(errors: np.ndarray) -> FittedCandidate:
    """errors: (windows, samples, outputs), in units of the sensors' noise."""
    windows, length, _ = errors.shape
    squares = np.sum((errors * SCALES) ** 2, axis=1)
    counts = np.full(windows, float(length))
    spectrum = spectrum_of((windows, length))
    powers = [
        spectrum.by_window(
            spectrum.transform([(error * scale).ravel()], differences=name == "position_m") ** 2
        )
        for name, error, scale in zip(OUTPUTS, np.moveaxis(errors, 2, 0), SCALES, strict=True)
    ]
    return made_of(squares, counts, np.stack(powers, axis=1))


def made_of(squares: np.ndarray, counts: np.ndarray, powers: np.ndarray) -> FittedCandidate:
    sums = WindowSums({}, {}, counts)
    return FittedCandidate(
        (), np.zeros(0), {}, 0.0, 0.0, True, squares, counts, powers, powers, sums
    )


def of_size(size: float, seed: int) -> FittedCandidate:
    rng = np.random.default_rng(seed)
    return candidate(size * rng.standard_normal((WINDOWS, LENGTH, 3)))


@given(a=st.floats(0.01, 100.0), b=st.floats(0.01, 100.0))
def test_swapping_the_candidates_changes_the_sign(case: Case, a: float, b: float) -> None:
    first, second = of_size(a, 1), of_size(b, 2)
    gain, loss = likelihood_gain(case, first, second), likelihood_gain(case, second, first)
    assert gain.nats == pytest.approx(-loss.nats, abs=1e-9)
    assert gain.relative == pytest.approx(-loss.relative, abs=1e-12)
    # 19 of 20 draws of the windows exceed `low`, so that it is below the gain itself.
    assert gain.low <= gain.nats
    assert loss.low <= loss.nats


def test_a_candidate_gains_nothing_over_itself(case: Case) -> None:
    same = of_size(3.0, 1)
    gain = likelihood_gain(case, same, same)
    assert (gain.nats, gain.low, gain.relative) == (0.0, 0.0, 0.0)


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


@pytest.mark.parametrize("seconds", [6.0, 5.5])
def test_nats_are_the_difference_of_the_held_out_costs(seconds: float) -> None:
    """The same likelihood by the formula of `Problem`; 5.5 s end with a shorter window."""
    records = [made.record(made.OFF, seed, seconds=seconds) for seed in (1, 2)]
    problem = make_case(made.RIG, records[:1], records[1:]).problem(held_out=True)
    pairs = []
    for x in (problem.centre(), problem.centre() + 0.01):
        coefficients = problem.coefficients(x)
        fitted = made_of(
            *problem.window_squares(problem.errors(x)), problem.window_powers(coefficients)
        )
        pairs.append((fitted, problem.fit_cost(coefficients)))
    (first, cost), (second, other_cost) = pairs
    case = make_case(made.RIG, records[:1], records[1:])
    assert likelihood_gain(case, first, second).nats == pytest.approx(
        other_cost - cost, rel=1e-9, abs=1e-6
    )


def test_a_gain_in_few_windows_is_uncertain(case: Case) -> None:
    """The same sum of squares, once spread over all windows and once in two of them."""
    rng = np.random.default_rng(5)
    # All windows have the same errors, so that those of a few have the octaves of all.
    base = np.tile(rng.standard_normal((1, LENGTH, 3)), (WINDOWS, 1, 1))
    even = likelihood_gain(case, candidate(base), candidate(3.0 * base))
    burst = base.copy()
    # The two windows get eight times the sum of all squares in addition to their own.
    whole, first_two = (np.sum(part**2, axis=(0, 1)) for part in (base, base[:2]))
    burst[:2] *= np.sqrt(1.0 + 8.0 * whole / first_two)
    rare = likelihood_gain(case, candidate(base), candidate(burst))
    assert rare.nats == pytest.approx(even.nats, rel=1e-9)
    # A draw has neither of the two windows with probability e^-2 = 13 %, and then no gain.
    assert rare.low < 0.1 * rare.nats
    assert even.low > 0.9 * even.nats


def test_errors_at_the_floor_are_not_above_it(case: Case) -> None:
    floors = np.array([case.floors[name].value for name in case.outputs]) / SCALES
    sign = np.where(np.arange(LENGTH) % 2, 1.0, -1.0)
    at_floor = np.broadcast_to(sign[:, np.newaxis] * floors, (WINDOWS, LENGTH, 3))
    assert above_floor(case, candidate(at_floor)) == pytest.approx(0.0, abs=1e-12)
    # With e = sqrt(7) floors, sqrt(e^2 + floor^2) is twice sqrt(2 floor^2).
    assert above_floor(case, candidate(np.sqrt(7.0) * at_floor)) == pytest.approx(np.log(2.0))

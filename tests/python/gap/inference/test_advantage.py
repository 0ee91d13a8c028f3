# SPDX-License-Identifier: MIT
import gap_cases as made
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.gap.inference.advantage import above_floor, advantage
from ehsid.harness.gap.inference.rivals import Rival
from ehsid.harness.gap.model.case import Case
from ehsid.harness.gap.thresholds import INDEPENDENT_HZ

WINDOWS, LENGTH = 40, 250
SCALES = np.array([5e-6, 1e4, 1e4])


@pytest.fixture(scope="module")
def case() -> Case:
    return made.case_of({})


def rival(errors: np.ndarray) -> Rival:
    """errors: (windows, samples, outputs), in units of the sensors' noise."""
    squares = np.sum((errors * SCALES) ** 2, axis=1)
    counts = np.full(errors.shape[0], float(errors.shape[1]))
    return Rival((), np.zeros(0), {}, 0.0, 0.0, True, squares, counts)


def of_size(size: float, seed: int) -> Rival:
    rng = np.random.default_rng(seed)
    return rival(size * rng.standard_normal((WINDOWS, LENGTH, 3)))


@given(a=st.floats(0.01, 100.0), b=st.floats(0.01, 100.0))
def test_it_turns_its_sign_with_the_sides(case: Case, a: float, b: float) -> None:
    one, other = of_size(a, 1), of_size(b, 2)
    there, back = advantage(case, one, other), advantage(case, other, one)
    assert there.nats == pytest.approx(-back.nats, abs=1e-9)
    assert there.relative == pytest.approx(-back.relative, abs=1e-12)
    # 19 of 20 draws of the windows lie above: below the whole for either side.
    assert there.low <= there.nats
    assert back.low <= back.nats


def test_over_itself_there_is_none(case: Case) -> None:
    one = of_size(3.0, 1)
    found = advantage(case, one, one)
    assert (found.nats, found.low, found.relative) == (0.0, 0.0, 0.0)


def test_it_is_the_ratio_of_the_errors_and_the_floor(case: Case) -> None:
    """By hand, sample by sample."""
    rng = np.random.default_rng(3)
    errors = [size * rng.standard_normal((WINDOWS, LENGTH, 3)) for size in (0.5, 4.0)]
    found = advantage(case, *map(rival, errors))
    floors = [case.floors[name].value for name in case.outputs]
    logs = []
    for error in errors:
        total = 0.0
        for column, floor in enumerate(floors):
            mse = np.mean((error[:, :, column] * SCALES[column]) ** 2)
            total += np.log(np.sqrt(mse + floor**2))
        logs.append(total)
    assert found.relative == pytest.approx((logs[1] - logs[0]) / 3.0, rel=1e-12)
    # 40 windows of 250 samples of 2 ms are 20 s: 400 independent errors of each output.
    assert found.nats == pytest.approx(20.0 * INDEPENDENT_HZ * (logs[1] - logs[0]), rel=1e-12)


def test_nats_are_the_difference_of_the_held_out_costs() -> None:
    """The likelihood of Problem, from another formula and another file."""
    case = made.case_of(made.OFF)
    problem = case.problem(held_out=True)
    found = []
    for x in (problem.centre(), problem.centre() + 0.01):
        errors = problem.errors(x)
        squares, counts = problem.window_squares(errors)
        found.append((Rival((), x, {}, 0.0, 0.0, True, squares, counts), problem.fit_cost(errors)))
    (one, cost), (other, more) = found
    assert advantage(case, one, other).nats == pytest.approx(more - cost, rel=1e-9, abs=1e-6)


def test_an_advantage_in_few_windows_is_uncertain(case: Case) -> None:
    """The same sum of squares, once in all windows and once in two of them."""
    rng = np.random.default_rng(5)
    base = rng.standard_normal((WINDOWS, LENGTH, 3))
    even = advantage(case, rival(base), rival(3.0 * base))
    burst = base.copy()
    # Eight times the sum of all squares on top of that of two windows.
    whole, two = (np.sum(part**2, axis=(0, 1)) for part in (base, base[:2]))
    burst[:2] *= np.sqrt(1.0 + 8.0 * whole / two)
    rare = advantage(case, rival(base), rival(burst))
    assert rare.nats == pytest.approx(even.nats, rel=1e-9)
    # A draw misses both with e^-2 = 13 % and has none of it then.
    assert rare.low < 0.1 * rare.nats
    assert even.low > 0.9 * even.nats


def test_nothing_is_above_the_floor_at_the_floor(case: Case) -> None:
    floors = np.array([case.floors[name].value for name in case.outputs]) / SCALES
    sign = np.where(np.arange(LENGTH) % 2, 1.0, -1.0)
    at_floor = np.broadcast_to(sign[:, np.newaxis] * floors, (WINDOWS, LENGTH, 3))
    assert above_floor(case, rival(at_floor)) == pytest.approx(0.0, abs=1e-12)
    # e^2 + floor^2 at e = sqrt(7) floors: the root is twice that of the floor and itself.
    assert above_floor(case, rival(np.sqrt(7.0) * at_floor)) == pytest.approx(np.log(2.0))

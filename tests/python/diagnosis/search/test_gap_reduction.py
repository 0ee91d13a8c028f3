# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.diagnosis.data.floor import NoiseFloor
from ehsid.harness.diagnosis.model.comparison import compare
from ehsid.harness.diagnosis.search.gap_reduction import WindowSums, gap_reduction, window_sums
from ehsid.harness.records import make_record

DT_S = 1e-3
NAMES = ("position_m", "pressure_a_pa")
FLOORS = {
    "position_m": NoiseFloor(1e-5, 0.9e-5, 1.2e-5),
    "pressure_a_pa": NoiseFloor(1e4, 9e3, 1.1e4),
}


def compared(seed: int, samples: int = 8300):
    rng = np.random.default_rng(seed)
    time = np.arange(samples) * DT_S
    return compare(
        make_record(
            {
                "time_s": time,
                "command_v": rng.standard_normal(samples),
                "position_m": 0.1 + 0.01 * np.sin(7.0 * time),
                "pressure_a_pa": 5e6 + 1e6 * np.sin(9.0 * time),
            }
        )
    )


def sums_of(record, shares: tuple[float, float], seed: int) -> WindowSums:
    """White errors whose rms is this share of the amplitude of each output."""
    rng = np.random.default_rng(seed)
    simulated = {
        name: record.outputs[name] + share * size * rng.standard_normal(len(record.record))
        for name, share, size in zip(NAMES, shares, (0.01, 1e6), strict=True)
    }
    return window_sums([record], [simulated], NAMES)


def test_gaps_are_those_of_the_contract() -> None:
    """The gap is computed sample by sample from its definition in the contract."""
    first, second = compared(1), compared(2)
    rng = np.random.default_rng(0)
    simulated = [
        {
            name: record.outputs[name] * (1.0 + 0.01 * rng.standard_normal(len(record.record)))
            for name in NAMES
        }
        for record in (first, second)
    ]
    sums = window_sums([first, second], simulated, NAMES)
    assert sums.count.sum() == np.count_nonzero(first.used) + np.count_nonzero(second.used)
    first_sums = window_sums([first], simulated[:1], NAMES)
    for name in NAMES:
        squares, spread, count = 0.0, 0.0, 0
        measured = first.outputs[name]
        for number in range(int(first.window.max()) + 1):
            indices = np.flatnonzero(first.window == number)
            mean = sum(measured[k] for k in indices) / indices.size
            squares += sum((simulated[0][name][k] - measured[k]) ** 2 for k in indices)
            spread += sum((measured[k] - mean) ** 2 for k in indices)
            count += indices.size
        assert count == first_sums.count.sum()
        gap = np.sqrt(first_sums.error[name].sum() / first_sums.spread[name].sum())
        assert gap == pytest.approx(np.sqrt(squares / spread))


def test_shares_by_hand() -> None:
    record = compared(3)
    nominal, calibrated, augmented = (
        sums_of(record, shares, seed)
        for seed, shares in enumerate([(0.4, 0.4), (0.2, 0.3), (0.02, 0.03)])
    )
    reduction = gap_reduction(nominal, calibrated, augmented, FLOORS, seed=0)
    assert reduction.nominal > reduction.calibrated > reduction.augmented
    floor = np.mean(
        [
            FLOORS[name].value / np.sqrt(calibrated.spread[name].sum() / calibrated.count.sum())
            for name in NAMES
        ]
    )
    assert reduction.noise_floor[0] < floor < reduction.noise_floor[1]
    assert reduction.of_explainable is not None
    by_hand = (reduction.calibrated - reduction.augmented) / (reduction.calibrated - floor)
    assert reduction.of_explainable.value == pytest.approx(by_hand)
    assert reduction.from_nominal.value == pytest.approx(
        (reduction.nominal - reduction.augmented) / reduction.nominal
    )
    for share in (reduction.of_explainable, reduction.from_nominal):
        assert share.low <= share.value <= share.high
        # Ten thousand independent errors give an interval of one or two per cent.
        assert share.high - share.low < 0.05
    assert reduction.per_output["position_m"][1] == pytest.approx(
        np.sqrt(calibrated.error["position_m"].sum() / calibrated.spread["position_m"].sum())
    )


def test_nothing_above_the_floor_has_no_share() -> None:
    record = compared(4)
    quiet = sums_of(record, (1e-4, 1e-4), 0)
    reduction = gap_reduction(quiet, quiet, quiet, FLOORS, seed=0)
    assert reduction.of_explainable is None
    assert reduction.from_nominal.value == 0.0


@pytest.mark.slow
@given(seed=st.integers(0, 30))
def test_interval_is_wider_where_windows_differ(seed: int) -> None:
    """Errors in a few windows only have fewer independent values than samples."""
    record = compared(5)
    rng = np.random.default_rng(seed)
    even = sums_of(record, (0.2, 0.2), seed)
    bursts = np.where(rng.random(even.count.size) < 0.2, 5.0, 0.0)
    uneven = WindowSums(
        {name: error * bursts for name, error in even.error.items()}, even.spread, even.count
    )
    after = sums_of(record, (0.05, 0.05), seed + 1)
    widths = []
    for before in (even, uneven):
        share = gap_reduction(before, before, after, FLOORS, seed=1).from_nominal
        widths.append(share.high - share.low)
    if bursts.any():
        assert widths[1] > widths[0]


def test_the_floor_is_never_above_the_error_that_was_reached() -> None:
    """A floor estimated ten times too high would make the removed share larger than all."""
    record = compared(3)
    before, after = sums_of(record, (0.1, 0.1), 1), sums_of(record, (0.001, 0.01), 2)
    high = {
        name: NoiseFloor(10.0 * floor.value, 9.0 * floor.value, 12.0 * floor.value)
        for name, floor in FLOORS.items()
    }
    result = gap_reduction(before, before, after, high, seed=0)
    assert result.of_explainable is not None
    assert result.of_explainable.value == pytest.approx(1.0)
    low, upper = result.noise_floor
    assert low == pytest.approx(result.augmented)
    # The upper end stays: the floor may be as high elsewhere.
    assert upper > result.augmented

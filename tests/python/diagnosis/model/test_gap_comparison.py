# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from ehsid.harness.diagnosis.model.comparison import BLOCK_S, BLOCKS_TURN, compare
from ehsid.harness.diagnosis.schema import SKIP_S, WINDOW_S
from ehsid.harness.records import Record, make_record


def record(seconds: float, dt_s: float) -> Record:
    time = np.arange(round(seconds / dt_s)) * dt_s
    return make_record(
        {
            "time_s": time,
            "command_v": np.sin(time),
            "position_m": 0.1 + 0.01 * np.sin(7.0 * time),
            "pressure_a_pa": 5e6 + 1e6 * np.sin(9.0 * time),
        }
    )


@pytest.mark.parametrize(
    ("dt_s", "seconds"),
    [
        (1e-3, 12.4),
        (2e-3, 12.4),
        (5e-3, 21.0),
        (1e-4, 4.73),
        (1.0 / 750.0, 9.0),
        (3e-3, 21.0),
        (1e-2, 4.65),
        (5e-2, 8.0),
    ],
)
def test_each_window_is_in_exactly_one_part(dt_s: float, seconds: float) -> None:
    subject = record(seconds, dt_s)
    whole, fitted, held_out = (
        compare(subject, blocks=blocks) for blocks in ("all", "fit", "held out")
    )
    # Every sample after the start is in one of the parts and keeps its window number.
    assert not np.any(fitted.used & held_out.used)
    np.testing.assert_array_equal(np.maximum(fitted.window, held_out.window), whole.window)
    # No window is in both parts.
    assert not set(fitted.window[fitted.used]) & set(held_out.window[held_out.used])
    # After the start, blocks have two seconds; the second of every three is held out.
    windows = whole.window.max() + 1
    block = np.arange(windows) // round(BLOCK_S / WINDOW_S)
    expected = np.flatnonzero(block % BLOCKS_TURN == 1)
    np.testing.assert_array_equal(np.unique(held_out.window[held_out.used]), expected)


def test_all_parts_are_simulated_in_the_same_way() -> None:
    """Blocks that are not compared are simulated, too, from the same measured states."""
    subject = record(10.0, 1e-3)
    parts = [compare(subject, blocks=blocks) for blocks in ("all", "fit", "held out")]
    for compared in parts[1:]:
        np.testing.assert_array_equal(compared.aligned, parts[0].aligned)
        assert compared.outputs.keys() == parts[0].outputs.keys()
    assert sum(compared.seconds for compared in parts[1:]) == pytest.approx(parts[0].seconds)


def test_a_record_of_one_block_has_no_held_out_part() -> None:
    # The record ends with the first block.
    subject = record(SKIP_S + BLOCK_S, 1e-3)
    assert compare(subject, blocks="fit").used.sum() == 2000
    assert compare(subject, blocks="held out").used.sum() == 0


def test_the_position_at_the_start_of_a_window_is_smoothed() -> None:
    """A cubic fitted to 11 samples reduces the noise to 46 % and preserves a smooth motion."""
    plain = record(20.0, 1e-3)
    rng = np.random.default_rng(0)
    noise = 1e-5 * rng.standard_normal(len(plain))
    columns = {name: plain.column(name) for name in ("command_v", "pressure_a_pa")}
    noisy = compare(
        make_record(
            {
                "time_s": plain.time_s,
                "position_m": plain.column("position_m") + noise,
                **columns,
            }
        ),
        window_s=0.02,
    )
    window_starts = np.flatnonzero(np.diff(noisy.window, prepend=-1) > 0)
    error = noisy.aligned[window_starts, 0] - plain.column("position_m")[window_starts]
    # The middle of the hat matrix of a cubic over k = -5..5 is the variance of the middle sample.
    basis = np.vander(np.arange(-5, 6), 4).astype(float)
    share = np.sqrt((basis @ np.linalg.pinv(basis))[5, 5])
    assert share == pytest.approx(0.456, abs=1e-3)
    # With 984 windows, five standard errors of a standard deviation are 11 %.
    assert np.std(error) == pytest.approx(share * 1e-5, rel=0.11)

# SPDX-License-Identifier: MIT
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.diagnosis.data.floor import rounding_errors

TIME = np.arange(4000) * 1e-3


@given(
    step=st.floats(1e-5, 1e-2),
    periods=st.integers(1, 2),
    levels=st.floats(20.0, 60.0),
    phase=st.floats(0.0, 6.0),
)
def test_the_errors_of_a_slow_signal_are_found(
    step: float, periods: int, levels: float, phase: float
) -> None:
    """A slow sine is a line between two levels, except near its ends, where it is flat."""
    signal = step * levels * np.sin(2.0 * np.pi * periods * TIME / TIME[-1] + phase)
    rounded = step * np.round(signal / step)
    found, true = rounding_errors(rounded), rounded - signal
    assert np.all(np.abs(found) <= 0.5 * step * (1.0 + 1e-9))
    # Less than a fifth of a level passes in a sample, so that half a sample, the uncertainty of a
    # crossing, is a tenth of a step.
    assert np.median(np.abs(found - true)) < 0.1 * step
    # Around a reversal there is no crossing for up to the share s = sqrt(8 / levels) / pi of the
    # time, where the error is at most half a step: s / 4 beside the 1 / 12 of rounding, step^2.
    # Both ends of the record are beyond a crossing, too: a tenth more.
    share = np.sqrt(8.0 / levels) / np.pi
    within = np.sqrt((1.0 - share) / 12.0 + share / 4.0) / np.sqrt(1.0 / 12.0)
    assert np.std(found) < 1.1 * within * np.std(true)
    assert np.std(found) > 0.8 * np.std(true)


def test_without_a_grid_nothing_is_rounded() -> None:
    noise = np.random.default_rng(5).normal(0.0, 1e-3, TIME.size)
    assert not rounding_errors(np.sin(TIME) + noise).any()
    assert not rounding_errors(np.zeros(50)).any()
    assert not rounding_errors(np.repeat([0.0, 1.0], 20)).any()  # one crossing shows no motion

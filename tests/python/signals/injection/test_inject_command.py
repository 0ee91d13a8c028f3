# SPDX-License-Identifier: MIT
"""Pre-images on the command against operators written apart."""

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.signal import cont2discrete, dlsim

from ehsid.harness.signals.injection import InjectError
from ehsid.harness.signals.injection.effects import (
    before_bias,
    before_dead_band,
    before_gain,
    before_play,
)
from ehsid.harness.signals.injection.lag import before_delay, before_lag, behind_delay

FloatArray = npt.NDArray[np.float64]

# Rounding of numbers below 2: a sum and a difference, each to half a unit in the last place.
ROUNDING = 2.0 * np.finfo(float).eps

# Few levels, so that commands rest, repeat and cross zero; and any.
LEVELS = st.one_of(
    st.sampled_from([-0.5, -0.01, 0.0, 0.01, 0.5]), st.floats(-1.0, 1.0, allow_subnormal=False)
)
COMMANDS = arrays(np.float64, st.integers(2, 40), elements=LEVELS)
SIZES = st.floats(1e-3, 0.3)


def play(command: FloatArray, half_width: float) -> FloatArray:
    """A pin in a slot: it stays until an end of the slot takes it along."""
    pin, path = 0.0, []
    for slot in command:
        if slot - half_width > pin:
            pin = slot - half_width
        elif slot + half_width < pin:
            pin = slot + half_width
        path.append(pin)
    return np.array(path)


def dead_band(command: FloatArray, extending: float, retracting: float) -> FloatArray:
    """Soft threshold."""
    opened = np.zeros_like(command)
    opened[command > extending] = command[command > extending] - extending
    opened[command < -retracting] = command[command < -retracting] + retracting
    return opened


@given(COMMANDS, SIZES)
def test_play_of_its_pre_image_is_the_command(command: FloatArray, half_width: float) -> None:
    sent = before_play(command, half_width).signal
    np.testing.assert_allclose(play(sent, half_width), command, rtol=0.0, atol=ROUNDING)
    # No further than the play asks for: a rest before the first move needs none of it.
    assert np.all(np.abs(sent - command) <= half_width + ROUNDING)


@given(COMMANDS, SIZES, SIZES)
def test_dead_band_of_its_pre_image_is_the_command(
    command: FloatArray, extending: float, retracting: float
) -> None:
    sent = before_dead_band(command, extending, retracting).signal
    passed = dead_band(sent, extending, retracting)
    np.testing.assert_allclose(passed, command, rtol=0.0, atol=ROUNDING)
    assert np.all(sent[command == 0.0] == 0.5 * (extending - retracting))


@given(COMMANDS, st.floats(-0.2, 0.2), st.floats(0.2, 5.0))
def test_bias_and_gain_of_their_pre_images_are_the_command(
    command: FloatArray, offset: float, factor: float
) -> None:
    np.testing.assert_allclose(
        before_bias(command, offset).signal + offset, command, rtol=0.0, atol=ROUNDING
    )
    np.testing.assert_allclose(
        factor * before_gain(command, factor).signal, command, rtol=ROUNDING, atol=1e-300
    )


@given(
    arrays(np.float64, st.integers(20, 40), elements=LEVELS),
    st.integers(1, 8),
    st.sampled_from([1e-3, 2e-3]),
)
def test_whole_delay_of_its_pre_image_is_the_command(
    command: FloatArray, samples: int, dt_s: float
) -> None:
    step = before_delay(command, samples * dt_s, dt_s)
    assert all(note.exact for note in step.notes)
    late = np.concatenate([command[:samples], step.signal])  # what was sent before the record
    np.testing.assert_array_equal(late, command)
    # A position that comes late: sample k shows what was there `samples` before.
    shown = behind_delay(command, samples * dt_s, dt_s).signal
    np.testing.assert_array_equal(shown, command[: command.size - samples])


def test_delay_between_samples_is_interpolated_and_told() -> None:
    time_s = np.arange(400) * 1e-3
    command = np.sin(2.0 * np.pi * 5.0 * time_s)
    step = before_delay(command, 0.00325, 1e-3)
    # A straight line between samples is off by at most h^2 / 8 of the second derivative.
    bound = (2.0 * np.pi * 5.0 * 1e-3) ** 2 / 8.0
    wanted = np.sin(2.0 * np.pi * 5.0 * (time_s[:396] + 0.00325))
    assert np.abs(step.signal - wanted).max() < bound
    assert [note.exact for note in step.notes] == [True, False]
    assert "not a whole number of samples" in step.notes[1].text
    shown = behind_delay(command, 0.00325, 1e-3)
    wanted = np.sin(2.0 * np.pi * 5.0 * (time_s[4:] - 0.00325))
    assert np.abs(shown.signal - wanted).max() < bound
    assert not shown.notes[0].exact


def test_delay_of_most_of_the_record_is_refused() -> None:
    with pytest.raises(InjectError, match="more than half of the record"):
        before_delay(np.zeros(100), 0.06, 1e-3)


def spool_means(command: FloatArray, bandwidth_hz: float, damping: float) -> FloatArray:
    """Mean over each millisecond of a lagging spool under held commands, by scipy, 100 times finer.

    Means by the trapezoidal rule: off by (w h)^2 / 12 of the swing, below 1e-5 up to 200 Hz.
    """
    fine = 100
    w = 2.0 * np.pi * bandwidth_hz
    a, b = np.array([[0.0, 1.0], [-w * w, -2.0 * damping * w]]), np.array([[0.0], [w * w]])
    spool = (a, b, np.array([[1.0, 0.0]]), np.array([[0.0]]))
    _, x, _ = dlsim(cont2discrete(spool, 1e-3 / fine, method="zoh"), np.repeat(command, fine))
    x = np.append(x[:, 0], x[-1, 0])
    middles = 0.5 * (x[1:] + x[:-1])
    return np.asarray(middles.reshape(-1, fine).mean(axis=1))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("bandwidth_hz", "damping"),
    [
        (15.0, 0.5),
        *(pytest.param(*one, marks=pytest.mark.thorough) for one in ((40.0, 0.8), (200.0, 1.5))),
    ],
)
def test_mean_of_the_lag_of_its_pre_image_is_the_command(
    bandwidth_hz: float, damping: float
) -> None:
    # White: the worst there is. The spool starts at zero and forgets it within 0.6 s.
    command = np.random.default_rng(1).uniform(-1.0, 1.0, 1200)
    sent = before_lag(command, bandwidth_hz, damping, 1e-3).signal
    found = spool_means(sent, bandwidth_hz, damping)
    settled = slice(600, -20)
    swing = np.abs(sent).max() * (2.0 * np.pi * bandwidth_hz * 1e-3) ** 2
    np.testing.assert_allclose(found[settled], command[settled], rtol=0.0, atol=1e-5 * (1 + swing))
    # The same spool on the command itself is far from it: the pre-image does something.
    assert np.abs(spool_means(command, bandwidth_hz, damping) - command)[settled].max() > 0.1


@pytest.mark.slow
def test_lag_that_is_beyond_the_amplifier_smooths_the_command_and_says_so() -> None:
    time_s = np.arange(2000) * 1e-3
    slow = 0.4 * np.sin(2.0 * np.pi * 3.0 * time_s)
    noisy = slow + 0.01 * np.random.default_rng(2).standard_normal(slow.size)
    free = before_lag(noisy, 30.0, 0.8, 1e-3)
    assert np.abs(free.signal).max() > 1.0
    step = before_lag(noisy, 30.0, 0.8, 1e-3, limit=1.0)
    assert np.abs(step.signal).max() <= 1.0
    assert "smoothed" in step.notes[-1].text
    # What is lost is noise: the spool follows the slow part to within its deviation.
    found = spool_means(step.signal, 30.0, 0.8)
    assert np.std((found - slow)[300:-20]) < 0.01


def test_lag_under_a_step_is_refused_within_the_rated_command() -> None:
    command = np.repeat([0.0, 0.9, -0.9, 0.9], 100)
    with pytest.raises(InjectError, match="take a higher bandwidth"):
        before_lag(command, 10.0, 0.8, 1e-3, limit=1.0)

# SPDX-License-Identifier: MIT
"""Excitations beside the limits of a machine: of its command and of its stroke."""

import re

import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.signals.excitation import Excitation, fit_to_travel, travel

commands = st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=60).map(np.array)


def test_excitation_has_no_lines_and_no_limit_unless_told() -> None:
    found = Excitation(np.array([1e300, 0.0]), 0.1, "word")
    assert found.excited.size == found.detection.size == 0


# Limits in whole millivolts: among the smallest numbers there are a scale cannot be had to 1e-3.
@given(
    command=commands,
    limit=st.integers(0, 10_000).map(lambda millivolts: 1e-3 * millivolts),
    offset=st.floats(-3.0, 3.0),
)
def test_a_command_beyond_its_limit_is_refused_with_a_scale_that_fits(
    command: np.ndarray, limit: float, offset: float
) -> None:
    samples = command + offset
    if np.abs(samples).max() <= limit:
        np.testing.assert_array_equal(Excitation(samples, 0.1, "x", limit_v=limit).samples, samples)
        return
    with pytest.raises(ValueError, match=r"x: .* is beyond limit_v = ") as refused:
        Excitation(samples, 0.1, "x", limit_v=limit)
    found = re.search(r" at (\S+) s is beyond .* at most (\S+), or", str(refused.value))
    assert found is not None
    assert abs(samples[round(float(found[1]) / 0.1)]) == np.abs(samples).max()
    scaled = float(found[2]) * samples
    Excitation(scaled, 0.1, "x", limit_v=limit)
    # It gives no more away than rounding to four digits asks for: 1.5 thousandths.
    assert np.abs(scaled).max() >= 0.998 * limit


@pytest.mark.parametrize(
    ("samples", "dt_s", "limit_v", "words"),
    [
        (np.ones(3), 0.0, 1.0, "x: dt_s = 0: expected a finite dt_s > 0"),
        (np.ones(3), np.inf, 1.0, "x: dt_s = inf"),
        (np.ones(3), 1.0, np.nan, "x: limit_v = nan: expected limit_v >= 0"),
        (np.ones(3), 1.0, -1.0, "x: limit_v = -1"),
        (np.ones((2, 2)), 1.0, 1.0, r"x: samples of shape \(2, 2\): expected \(n,\), n >= 1"),
        (np.ones(0), 1.0, 1.0, r"x: samples of shape \(0,\)"),
        (np.array([0.0, np.nan]), 1.0, 1.0, "x: sample 1, counted from 0, is nan"),
        (np.array([np.inf]), 1.0, np.inf, "x: sample 0, counted from 0, is inf"),
    ],
)
def test_excitation_names_what_is_wrong(
    samples: np.ndarray, dt_s: float, limit_v: float, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        Excitation(samples, dt_s, "x", limit_v=limit_v)


@given(
    command=commands, dt_s=st.floats(1e-4, 1.0), gain=st.floats(-1.0, 1.0), start=st.floats(0, 1)
)
def test_travel_is_that_of_an_integrator_with_held_command(
    command: np.ndarray, dt_s: float, gain: float, start: float
) -> None:
    time = dt_s * np.arange(command.size + 1)
    held = np.append(command, 0.0)
    integrator = (np.array([[0.0]]), np.array([[gain]]), np.array([[1.0]]), np.array([[0.0]]))
    _, position, _ = scipy.signal.lsim(integrator, held, time, X0=[start], interp=False)
    # Each sum of n terms rounds n times, at most by the size of what has been added up; numbers
    # below the smallest normal one have fewer digits.
    size = abs(start) + abs(gain) * dt_s * np.abs(command).sum()
    rounding = 4.0 * command.size * np.finfo(float).eps * size + np.finfo(float).tiny
    low, high = travel(command, dt_s, gain, start)
    assert low == pytest.approx(np.min(position), abs=rounding)
    assert high == pytest.approx(np.max(position), abs=rounding)


def fit(command: np.ndarray, gain: float, start: float) -> np.ndarray:
    """On a stroke of half a metre."""
    return fit_to_travel(command, 0.1, gain_m_s_v=gain, start_m=start, stroke_m=0.5)


# Starts in whole micrometres: nearer to an end than rounding, no scale could be told from zero.
@given(
    command=commands,
    gain=st.floats(-1.0, 1.0),
    start=st.integers(0, 500_000).map(lambda micrometres: 1e-6 * micrometres),
)
def test_a_fitted_command_stays_inside_and_the_remedies_of_others_do(
    command: np.ndarray, gain: float, start: float
) -> None:
    try:
        fitted = fit(command, gain, start)
    except ValueError as refused:
        message = str(refused)
    else:
        low, high = travel(fitted, 0.1, gain, start)
        assert 0.0 <= low <= high <= 0.5
        low, high = travel(command, 0.1, gain, start)
        as_it_is = low >= 0.0 and high <= 0.5
        np.testing.assert_array_equal(fitted, command if as_it_is else command - command.mean())
        assert fitted is not command
        return
    remedies = re.search(
        r"beyond 0 to 0\.5 m: (?:scale it by at most (\S+), or )?"
        r"start at (\S+) m(?: and scale it by at most (\S+))?$",
        message,
    )
    assert remedies is not None
    here, there_start, there = remedies.groups()
    if here is not None:
        fit(float(here) * command, gain, start)
    fit(float(there or 1.0) * command, gain, float(there_start))
    # Less its mean it really does not fit, and a little more than the scale would not either.
    centred = command - command.mean()
    scales = [(1.0, start)]
    if here is not None:
        scales.append((1.002 * float(here), start))
    if there is not None:
        scales.append((1.002 * float(there), float(there_start)))
    for scale, begin in scales:
        low, high = travel(scale * centred, 0.1, gain, begin)
        assert low < 0.0 or high > 0.5


@pytest.mark.parametrize(
    ("command", "start", "remedy"),
    [
        ([1.0, -1.0], 0.45, "scale it by at most 0.4995, or start at 0.2 m"),
        ([1.0, -1.0], 0.5, "start at 0.2 m"),  # at an end of the stroke no scale helps
        ([-10.0, 10.0], 0.4, "scale it by at most 0.3996, or start at 0.49975 m and scale it by "),
    ],
)
def test_remedies_by_hand(command: list[float], start: float, remedy: str) -> None:
    with pytest.raises(ValueError, match=f"beyond 0 to 0.5 m: {remedy}"):
        fit(np.array(command), 1.0, start)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"dt_s": 0.0}, "travel: dt_s = 0"),
        ({"gain_m_s_v": np.inf}, "travel: gain_m_s_v = inf: expected a finite number"),
        ({"start_m": -0.1}, "start_m = -0.1: expected 0 <= start_m <= 0.5"),
        ({"start_m": np.nan}, "start_m = nan"),
        ({"stroke_m": 0.0}, "stroke_m = 0"),
        ({"command": np.array([1.0, np.nan])}, "travel: sample 1, counted from 0, is nan"),
        ({"command": np.ones((3, 1))}, r"travel: samples of shape \(3, 1\)"),
    ],
)
def test_fit_to_travel_names_what_is_wrong(change: dict[str, object], words: str) -> None:
    arguments: dict[str, object] = {
        "command": np.ones(3),
        "dt_s": 0.1,
        "gain_m_s_v": 0.1,
        "start_m": 0.1,
        "stroke_m": 0.5,
    }
    with pytest.raises(ValueError, match=words):
        fit_to_travel(**{**arguments, **change})  # type: ignore[arg-type]


def test_travel_needs_a_finite_start() -> None:
    with pytest.raises(ValueError, match="travel: start_m = inf: expected a finite number"):
        travel(np.ones(3), 0.1, 0.1, np.inf)

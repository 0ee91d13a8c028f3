# SPDX-License-Identifier: MIT
"""Few points of a long signal: every peak is there, at its place, and it takes no time."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.workbench.downsampling import FACTOR, make_pyramid, opened, store


def test_a_short_range_is_drawn_sample_by_sample() -> None:
    values = np.arange(1000.0)
    at, drawn = make_pyramid(values).view(100, 300, 100)
    assert np.array_equal(at, np.arange(100, 300))
    assert np.array_equal(drawn, values[100:300])


@given(
    size=st.integers(5000, 60_000),
    peak=st.floats(0.0, 1.0),
    ends=st.tuples(st.floats(0.0, 0.45), st.floats(0.55, 1.0)),
    columns=st.integers(10, 300),
)
def test_every_peak_is_drawn_in_its_column(
    size: int, peak: float, ends: tuple[float, float], columns: int
) -> None:
    first, last = int(ends[0] * size), int(ends[1] * size)
    place = first + int(peak * (last - first - 1))
    values = np.sin(0.1 * np.arange(size))
    for sign in (1.0, -1.0):
        values[place] = 50.0 * sign
        at, drawn = make_pyramid(values).view(first, last, columns)
        assert at.size <= 4 * columns
        assert np.all(np.diff(at) >= 0.0)
        shown = at[np.argmax(np.abs(drawn))]
        assert np.abs(drawn).max() == 50.0
        assert abs(shown - place) <= 2.0 * (last - first) / columns + 1.0
        assert sign * drawn[np.argmax(np.abs(drawn))] > 0.0


def test_what_lies_outside_of_the_range_is_not_drawn() -> None:
    values = np.zeros(100_000)
    values[[0, 999, 90_000]] = 1e6
    _, drawn = make_pyramid(values).view(1000, 90_000, 100)
    assert np.all(drawn == 0.0)


def test_a_range_beyond_the_ends_is_cut() -> None:
    pyramid = make_pyramid(np.ones(50_000))
    at, _ = pyramid.view(-500, 80_000, 100)
    assert at[0] >= 0.0
    assert at[-1] < 50_000
    assert pyramid.view(60_000, 80_000, 100)[0].size == 0


def test_missing_values_hide_no_others() -> None:
    values = np.full(FACTOR * 100, np.nan)
    values[3000] = 7.0
    _, drawn = make_pyramid(values).view(0, values.size, 50)
    assert np.nanmax(drawn) == 7.0


def test_a_stored_pyramid_is_the_same(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=300_000)
    pyramid = make_pyramid(values)
    store(pyramid, tmp_path, "raw_1")
    store(make_pyramid(np.zeros(10)), tmp_path, "raw_11")
    again = opened(tmp_path, "raw_1")
    assert len(again.levels) == len(pyramid.levels) == 3
    for one, other in zip(
        pyramid.view(10, 290_000, 500), again.view(10, 290_000, 500), strict=True
    ):
        assert np.array_equal(one, other)
    with pytest.raises(OSError, match="raw_2"):
        opened(tmp_path, "raw_2")


@pytest.mark.thorough
def test_ten_million_samples_are_drawn_in_a_fifth_of_a_second(tmp_path: Path) -> None:
    store(make_pyramid(np.random.default_rng(1).normal(size=10_000_000)), tmp_path, "raw")
    pyramid = opened(tmp_path, "raw")
    times = []
    for first, last in ((0, 10_000_000), (1_234_567, 8_000_000), (5_000_000, 5_040_000)):
        began = time.perf_counter()
        pyramid.view(first, last, 1200)
        times.append(time.perf_counter() - began)
    assert max(times) < 0.2

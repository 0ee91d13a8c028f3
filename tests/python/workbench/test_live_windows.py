# SPDX-License-Identifier: MIT
"""What the page Live draws: the ring of newest samples, and points that lose no peak."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ehsid.workbench.live.numbers import drawn, rate, span
from ehsid.workbench.live.watching import (
    COLUMNS,
    MOST_EVENTS,
    RingReader,
    RingWriter,
    RunStatus,
    read_status,
    write_status,
)

N, SERVO = 2, 3


def rows_of(count: int) -> np.ndarray:
    rows = np.zeros((count, len(COLUMNS) + 2 * N))
    rows[:, 0] = 0.01 * np.arange(count)
    rows[:, COLUMNS.index("wall_s")] = 0.02 * np.arange(count)
    rows[:, len(COLUMNS) : len(COLUMNS) + N] = [1.0, -2.0]
    rows[:, len(COLUMNS) + N :] = [0.1, 0.2]
    known = {"velocity_gain": (0.03, 0.005), "omega_n": (20.0, 5.0), "xi": (0.1, 0.05)}
    for name, (value, half) in known.items():
        rows[:, COLUMNS.index(name)] = value
        rows[:, COLUMNS.index(f"{name}_half")] = half
    return rows


def test_the_ring_holds_the_newest_samples(tmp_path: Path) -> None:
    path = tmp_path / "ring.npy"
    writer = RingWriter(path, 2, rows=10)
    reader = RingReader(path)
    assert (reader.count, len(reader.newest(4))) == (0, 0)
    for number in range(23):
        writer.add([number, -number])
    assert reader.count == 23
    np.testing.assert_array_equal(reader.newest(3)[:, 0], [20, 21, 22])
    # No more than the half that the writer does not reach while it is read.
    np.testing.assert_array_equal(reader.newest(100)[:, 1], [-18, -19, -20, -21, -22])
    assert path.stat().st_size < 11 * 16 + 200  # it does not grow


def test_a_reader_never_finds_a_ring_that_is_not_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, make = tmp_path / "ring.npy", np.lib.format.open_memmap

    def makes(*args: Any, **settings: Any) -> Any:
        made = make(*args, **settings)
        assert settings["mode"] != "w+" or not path.exists()
        return made

    monkeypatch.setattr("numpy.lib.format.open_memmap", makes)
    RingWriter(path, 2, rows=10).add([1.0, 2.0])
    np.testing.assert_array_equal(RingReader(path).newest(1), [[1.0, 2.0]])
    assert [one.name for one in tmp_path.iterdir()] == [path.name]


def test_few_samples_are_drawn_as_they_are() -> None:
    rows = rows_of(50)
    points = drawn(rows, 100)
    np.testing.assert_array_equal(points.time_s, rows[:, 0])
    np.testing.assert_allclose(points.low[SERVO:], [[0.9] * 50, [-2.2] * 50])
    np.testing.assert_allclose(points.high[SERVO:], [[1.1] * 50, [-1.8] * 50])
    np.testing.assert_allclose(points.values[:SERVO], [[0.03] * 50, [20.0] * 50, [0.1] * 50])
    np.testing.assert_allclose(points.high[:SERVO], [[0.035] * 50, [25.0] * 50, [0.15] * 50])


def test_many_samples_keep_their_peaks_and_are_few_points() -> None:
    rows = rows_of(10_000)
    rows[4_321, COLUMNS.index("position_m")] = 7.0
    rows[1_234, len(COLUMNS)] = 5.0
    points = drawn(rows, 100)
    assert points.time_s.size == points.signals["position_m"].size == 200
    assert points.at_s.size == 100
    assert points.signals["position_m"].max() == 7.0
    assert points.high[SERVO].max() == pytest.approx(5.1)
    assert points.at_s[-1] == rows[-1, 0]
    assert np.all(np.diff(points.time_s) >= 0.0)


def test_no_sample_gives_no_point() -> None:
    points = drawn(rows_of(0), 100)
    assert points.at_s.size == points.time_s.size == 0
    assert points.values.shape == (SERVO + N, 0)


def test_an_axis_does_not_follow_a_vague_start() -> None:
    theta = np.full(100, 2.0)
    theta[:5], theta[60:70] = 500.0, np.nan
    low, high = span(theta)
    assert 1.5 < low < 1.9
    assert 2.1 < high < 2.5


def test_an_axis_of_a_constant_has_a_width() -> None:
    low, high = span(np.zeros(10))
    assert low < 0.0 < high


def test_an_axis_of_what_is_not_known_yet_has_a_width() -> None:
    low, high = span(np.full(10, np.nan))
    assert low < high


def test_the_rate_is_that_of_the_clock() -> None:
    assert rate(rows_of(500)) == pytest.approx(50.0)
    assert rate(rows_of(2)) == 0.0


def test_events_are_bounded_and_read_again(tmp_path: Path) -> None:
    status = RunStatus(phase="The run goes on.")
    for number in range(100):
        status.event(0.1 * number, "the valve was opened")
    write_status(tmp_path, status)
    again = read_status(tmp_path)
    assert again == status
    assert len(again.events) == MOST_EVENTS
    assert again.events[-1] == (pytest.approx(9.9), "The valve was opened")
    assert read_status(tmp_path / "none") == RunStatus()

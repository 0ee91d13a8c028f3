# SPDX-License-Identifier: MIT
"""Uneven times become even ones, with errors below bounds that are derived."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ehsid.harness.records import Hints, Record, RecordError, read_record
from ehsid.harness.records.uniform import Grid, Timed, repaired, usual_step

FloatArray = npt.NDArray[np.float64]
HERE = Path("log")
DT_S, HZ = 0.002, 4.0
OMEGA = 2.0 * np.pi * HZ


def tone(time_s: FloatArray) -> FloatArray:
    return np.asarray(np.sin(OMEGA * time_s + 0.3), dtype=np.float64)


def pchip_bound(longest_step_s: float) -> float:
    """3/8 h^2 max|x''|: see the head of `uniform`."""
    return 3.0 / 8.0 * longest_step_s**2 * OMEGA**2


def write(path: Path, time_s: FloatArray, header: str = "time_s,command_v,position_m") -> Path:
    command, position = np.round(tone(time_s), 12), 0.1 + 0.05 * tone(time_s)
    rows = zip(time_s.tolist(), command.tolist(), position.tolist(), strict=True)
    lines = "".join(f"{t:.9g},{u!r},{y!r}\n" for t, u, y in rows)
    path.write_text(f"{header}\n{lines}")
    return path


def remarks(record: Record) -> str:
    assert record.origin is not None
    return "; ".join(record.origin.remarks)


@settings(max_examples=50, deadline=None)
@given(jitter=st.floats(0.0, 0.45), seed=st.integers(0, 2**32 - 1))
def test_jitter_leaves_no_more_than_the_interpolation_error(jitter: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time_s = DT_S * np.arange(500) + DT_S * rng.uniform(-jitter, jitter, 500)
    grid = Grid(float(time_s[0]), float(time_s[-1]), DT_S, HERE)
    values, _ = grid.sample(Timed(time_s, tone(time_s)))
    error = np.max(np.abs(values - tone(grid.time_s)))
    assert error <= pchip_bound(float(np.max(np.diff(time_s)))) + 1e-12


@settings(max_examples=50, deadline=None)
@given(jitter=st.floats(0.0, 0.45), seed=st.integers(0, 2**32 - 1), slower=st.floats(1.0, 6.0))
def test_what_a_held_command_did_in_total_is_kept(jitter: float, seed: int, slower: float) -> None:
    rng = np.random.default_rng(seed)
    time_s = DT_S * (np.arange(300) + rng.uniform(-jitter, jitter, 300))
    command = rng.normal(size=300)
    dt_s = slower * DT_S
    grid = Grid(float(time_s[0]), float(time_s[-1]), dt_s, HERE)
    values, _ = grid.sample(Timed(time_s, command, held=True))
    # Integral over the whole steps of the grid, computed from the log itself.
    end = grid.time_s[-2] + dt_s
    edges = np.clip(np.append(time_s, end), None, end)
    expected = float(np.sum(command * np.diff(edges)))
    assert dt_s * float(np.sum(values[:-1])) == pytest.approx(expected, abs=1e-12)


def test_jitter_of_a_record_is_mended_and_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    time_s = DT_S * np.arange(600) + DT_S * rng.uniform(-0.2, 0.2, 600)
    record = read_record(write(tmp_path / "r.csv", time_s))
    assert record.dt_s == pytest.approx(DT_S, rel=1e-9)
    assert record.jitter is not None
    assert record.jitter.max_relative < 1e-9
    true = 0.1 + 0.05 * tone(np.asarray(record.time_s))
    assert np.max(np.abs(record.column("position_m") - true)) <= 0.05 * pchip_bound(1.4 * DT_S)
    assert "resampled to an even 0.002 s (steps vary by up to" in remarks(record)


@pytest.mark.parametrize("ratio", [3.0, 5.0, 7.5])
def test_a_lower_rate_carries_no_alias(tmp_path: Path, ratio: float) -> None:
    """A tone above the new Nyquist frequency is gone, one well below it is as it was."""
    dt_s = ratio * DT_S
    nyquist_hz = 0.5 / dt_s
    time_s = DT_S * np.arange(6000)
    low = np.sin(2 * np.pi * 0.3 * nyquist_hz * time_s)
    high = np.sin(2 * np.pi * 1.3 * nyquist_hz * time_s)
    grid = Grid(0.0, float(time_s[-1]), dt_s, HERE)
    inside = slice(20, -20)  # the filter has ten of its samples to each side
    kept, _ = grid.sample(Timed(time_s, low))
    gone, _ = grid.sample(Timed(time_s, high))
    # Kaiser window with beta = 5: ripple of 53 dB in pass band and stop band, and where the ratio
    # is no whole number the interpolation error of the tone.
    ripple = 10.0 ** (-53.0 / 20.0)
    curve = 3.0 / 8.0 * (2 * np.pi * 1.3 * nyquist_hz * DT_S) ** 2 if ratio % 1.0 else 0.0
    assert np.max(np.abs(gone[inside])) <= ripple + curve
    true = np.sin(2 * np.pi * 0.3 * nyquist_hz * grid.time_s)
    assert np.max(np.abs(kept[inside] - true[inside])) <= ripple + curve
    record = read_record(write(tmp_path / "r.csv", DT_S * np.arange(900)), hints=Hints(dt_s=dt_s))
    assert record.dt_s == pytest.approx(dt_s, rel=1e-9)
    assert f"position_m filtered below {nyquist_hz:.4g} Hz before" in remarks(record)


@pytest.mark.parametrize(("step_s", "digits"), [(0.0004, 3), (0.002, 2), (1.0 / 30.0, 2)])
def test_times_with_too_few_digits_are_those_of_even_samples(
    tmp_path: Path, step_s: float, digits: int
) -> None:
    time_s = step_s * np.arange(800)
    record = read_record(write(tmp_path / "r.csv", np.round(time_s, digits)))
    assert len(record) == 800
    # The slope of rounded times is known to one resolution over the whole span.
    assert record.dt_s == pytest.approx(step_s, abs=10.0**-digits / 800)
    assert f"time is written in steps of {10.0**-digits:g} s" in remarks(record)


def test_single_missing_rows_are_bridged_and_long_gaps_are_not(tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    time_s = DT_S * np.arange(900) + DT_S * rng.uniform(-0.05, 0.05, 900)
    time_s = np.delete(time_s, [100, 250, 251, *range(400, 500)])
    record = read_record(write(tmp_path / "r.csv", time_s))
    assert [part.stop - part.start for part in record.segments] == pytest.approx([400, 400], abs=1)
    assert "lie in holes of single rows and are interpolated" in remarks(record)
    assert "lie in gaps, which divide the record and are not filled" in remarks(record)
    true = 0.1 + 0.05 * tone(np.asarray(record.time_s))
    assert np.max(np.abs(record.column("position_m") - true)) <= 0.05 * pchip_bound(3.1 * DT_S)


FOREIGN = "time,command,position [m]"  # names of a log, not of the schema


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(
    lost=st.lists(st.integers(1, 298), min_size=1, max_size=40, unique=True),
    jitter=st.floats(0.0, 0.002),
)
def test_single_rows_of_an_even_clock_are_interpolated(
    tmp_path_factory: pytest.TempPathFactory, lost: list[int], jitter: float
) -> None:
    """The rows that are there keep their bits, the command is held, the position is bounded."""
    rng = np.random.default_rng(len(lost))
    whole_s = DT_S * (np.arange(300) + jitter * rng.uniform(-1.0, 1.0, 300))
    time_s = np.delete(whole_s, lost)
    path = write(tmp_path_factory.mktemp("log") / "r.csv", time_s, FOREIGN)
    record = read_record(path)
    steps = np.diff(time_s)
    short = steps <= 4.01 * DT_S
    missing = np.round(steps / DT_S).astype(int) - 1
    assert len(record) == time_s.size + missing[short].sum()
    assert len(record.segments) == 1 + np.count_nonzero(~short)
    assert record.time_s is not None
    there = np.searchsorted(record.time_s, time_s - 1e-6)
    command, position = record.column("command_v"), record.column("position_m")
    np.testing.assert_array_equal(command[there], np.round(tone(time_s), 12))
    np.testing.assert_array_equal(position[there], 0.1 + 0.05 * tone(time_s))
    new = np.setdiff1d(np.arange(len(record)), there)
    np.testing.assert_array_equal(command[new], command[new - 1])
    error = np.abs(position - 0.1 - 0.05 * tone(record.time_s))
    assert error.max() <= 0.05 * pchip_bound(4.01 * DT_S) + 1e-9
    count = int(missing[short].sum())
    if count:
        share = f"{count} of {len(record)} samples ({100.0 * count / len(record):.2g} %)"
        assert (
            f"{share} lie in holes of single rows and are interpolated; command_v is held there"
            in remarks(record)
        )
    if not short.all():
        assert "the gaps are not filled" in remarks(record)


def test_three_missing_rows_are_interpolated_and_four_are_a_gap(tmp_path: Path) -> None:
    time_s = DT_S * np.arange(300)
    three = read_record(write(tmp_path / "3.csv", np.delete(time_s, [50, 51, 52]), FOREIGN))
    assert len(three) == 300
    assert len(three.segments) == 1
    four = read_record(write(tmp_path / "4.csv", np.delete(time_s, [50, 51, 52, 53]), FOREIGN))
    assert len(four) == 296
    assert remarks(four) == (
        "2 pieces are left between gaps of more than 3 rows, the longest of 0.01 s; the gaps are "
        "not filled"
    )


def test_a_log_of_which_more_than_30_percent_is_missing_is_refused(tmp_path: Path) -> None:
    # Three rows are there, then two or one of them missing: 40 % or 25 %.
    def kept(missing: int) -> FloatArray:
        there = np.arange(600) % (3 + missing) < 3
        return np.asarray((DT_S * np.arange(600))[there], dtype=np.float64)

    with pytest.raises(RecordError, match=r"of 598 samples every 0\.002 s, 238 would"):
        read_record(write(tmp_path / "two.csv", kept(2), FOREIGN))
    assert "149 of 599 samples (25 %)" in remarks(
        read_record(write(tmp_path / "one.csv", kept(1), FOREIGN))
    )


def test_a_clock_that_goes_on_between_its_steps_is_resampled(tmp_path: Path) -> None:
    time_s = DT_S * np.concatenate([np.arange(100), np.arange(101.5, 200.0)])
    record = read_record(write(tmp_path / "r.csv", time_s, FOREIGN))
    assert len(record.segments) == 1
    assert "resampled to an even 0.002 s (a step is no whole number of usual ones)" in remarks(
        record
    )
    true = 0.1 + 0.05 * tone(np.asarray(record.time_s))
    assert np.max(np.abs(record.column("position_m") - true)) <= 0.05 * pchip_bound(2.5 * DT_S)


def test_a_record_of_the_schema_keeps_its_holes_and_says_what_mends_them(tmp_path: Path) -> None:
    time_s = np.delete(DT_S * np.arange(300), [50, 100, 150])
    path = write(tmp_path / "r.csv", time_s)
    record = read_record(path)
    np.testing.assert_array_equal(record.column("position_m"), 0.1 + 0.05 * tone(time_s))
    assert remarks(record) == (
        "3 single rows are missing, so the record is in 4 pieces; nothing is filled in, "
        "and a simulation starts anew in each. To mend it: read it with --dt 0.002, which "
        "interpolates holes of up to 3 rows"
    )
    mended = read_record(path, hints=Hints(dt_s=0.002))
    assert (len(mended), len(mended.segments)) == (300, 1)
    time_s = np.delete(DT_S * np.arange(300), [50, 51, *range(100, 150)])
    assert remarks(read_record(write(tmp_path / "long.csv", time_s))) == (
        "2 rows at 1 place are missing and there is a gap of 0.102 s after 0.198 s, so "
        "the record is in 3 pieces; nothing is filled in, and a simulation starts anew in each. To "
        "mend it: read it with --dt 0.002, which interpolates holes of up to 3 rows"
    )


def test_few_late_and_repeated_rows_are_mended(tmp_path: Path) -> None:
    time_s = DT_S * np.arange(300)
    late = np.concatenate([time_s[:50], time_s[51:53], time_s[50:51], time_s[53:]])
    record = read_record(write(tmp_path / "late.csv", late))
    assert len(record) == 300
    assert "1 rows came after later ones: sorted by time" in remarks(record)
    np.testing.assert_allclose(record.column("position_m"), 0.1 + 0.05 * tone(time_s), atol=1e-9)
    twice = np.insert(time_s, 80, time_s[80])
    record = read_record(write(tmp_path / "twice.csv", twice))
    assert len(record) == 300
    assert "1 rows repeat the time of the row before: left out" in remarks(record)


@pytest.mark.parametrize(
    ("time_s", "problem"),
    [
        (np.tile(DT_S * np.arange(100), 2), "time runs backwards"),
        (DT_S * np.repeat(np.arange(50), 2) ** 2, "is the same as in the row before"),
        (np.cumsum(np.random.default_rng(1).exponential(DT_S, 400)), "time is too irregular"),
    ],
    ids=["two runs", "every row twice", "by chance"],
)
def test_beyond_repair_is_refused(tmp_path: Path, time_s: FloatArray, problem: str) -> None:
    with pytest.raises(RecordError, match=problem) as caught:
        read_record(write(tmp_path / "r.csv", time_s))
    assert caught.value.mend


def test_an_even_record_keeps_its_bits(tmp_path: Path) -> None:
    path = write(tmp_path / "r.csv", DT_S * np.arange(100), "time,command,position")
    record = read_record(path)
    np.testing.assert_array_equal(
        record.column("position_m"), 0.1 + 0.05 * tone(DT_S * np.arange(100))
    )


def test_a_row_that_is_missing_in_an_even_clock_is_no_coarse_time() -> None:
    time_s = np.delete(0.001 * np.arange(100), 40)
    said: list[str] = []
    mended = repaired(time_s, said)
    assert mended is not None
    np.testing.assert_array_equal(mended[0], time_s)
    assert said == []
    assert usual_step(time_s) == pytest.approx(0.001)


def test_a_time_without_end_is_refused_before_it_takes_memory(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    rows = "".join(f"{0.001 * k:.3f},1,{k % 7}\n" for k in range(50))
    path.write_text(f"time;command;position\n0;1;2\n{rows}1e300,1,2\n".replace(",", ";"))
    with pytest.raises(RecordError, match="at most 20000000 samples"):
        read_record(path, hints=Hints(dt_s=2e-3))

# SPDX-License-Identifier: MIT
"""Times in any unit and form are found, and said."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ehsid.harness.records import ColumnMap, Hints, Record, RecordError, read_record
from ehsid.harness.records.origin import Taken

N, DT_S = 300, 0.004
START = datetime.datetime(2024, 12, 31, 23, 59, 59, 400_000)


def moment(k: int) -> datetime.datetime:
    return START + datetime.timedelta(microseconds=4000 * k)


def record_of(path: Path, header: str, cell: Callable[[int], str], **hints: object) -> Record:
    rows = "".join(f"{cell(k)};{k % 7};{100 + k % 9}\n" for k in range(N))
    path.write_text(f"{header};Valve [V];Stroke [mm]\n{rows}")
    return read_record(path, hints=Hints(**hints))  # type: ignore[arg-type]


def time_of(record: Record) -> Taken:
    assert record.origin is not None
    return next(one for one in record.origin.taken if one.channel == "time_s")


CLOCKS: list[tuple[str, Callable[[int], str], str]] = [
    ("Time [ms]", lambda k: f"{4 * k}", "unit ms"),
    ("t_us", lambda k: f"{4000 * k}", "unit us"),
    ("Zeit (s)", lambda k: f"{0.004 * k:.3f}", "unit s"),
    ("elapsed time", lambda k: f"{4 * k}", "its step is 4"),
    ("time", lambda k: f"{0.004 * k:.3f}", "its step is 0.004"),
    ("timestamp", lambda k: f"{1_700_000_000_000 + 4 * k}", "it counts from 1970"),
    ("timestamp", lambda k: f"{1_700_000_000 + 0.004 * k:.3f}", "it counts from 1970"),
    ("Timestamp [us]", lambda k: f"{1_700_000_000_000_000 + 4000 * k}", "it counts from 1970"),
    ("Date", lambda k: f"{moment(k):%Y-%m-%d %H:%M:%S.%f}", "dates"),
    ("Date", lambda k: f"{moment(k):%Y-%m-%dT%H:%M:%S.%f}Z", "dates"),
    (
        "Datum",
        lambda k: f"{moment(k):%d.%m.%Y %H:%M:%S},{moment(k).microsecond // 1000:03d}",
        "dates",
    ),
    ("Date/Time", lambda k: f"{moment(k):%m/%d/%Y %I:%M:%S.%f %p}", "dates"),
    ("Time", lambda k: f"{moment(k):%H:%M:%S.%f}", "dates"),
    ("Date;Time", lambda k: f"{moment(k):%d.%m.%Y};{moment(k):%H:%M:%S.%f}", "dates"),
    ("time", lambda k: f"{739_000 + 0.004 * k / 86400:.12f}", "days of the calendar"),
]


@pytest.mark.parametrize(("header", "cell", "why"), CLOCKS, ids=lambda one: str(one)[:20])
def test_a_clock_is_found(
    tmp_path: Path, header: str, cell: Callable[[int], str], why: str
) -> None:
    record = record_of(tmp_path / "log.txt", header, cell)
    # Days with twelve digits behind the point are known to 0.1 us.
    assert record.dt_s == pytest.approx(DT_S, rel=1e-4)
    assert len(record) == N
    assert why in time_of(record).why


def test_a_guessed_unit_of_time_is_told_with_the_option_that_says_otherwise(tmp_path: Path) -> None:
    record = record_of(tmp_path / "log.txt", "elapsed time", lambda k: f"{4 * k}")
    assert record.origin is not None
    (said,) = [text for text in record.origin.remarks if "elapsed" in text]
    assert "--map 'time_s=elapsed time [s]'" in said
    other = record_of(
        tmp_path / "log.txt",
        "elapsed time",
        lambda k: f"{4 * k}",
        maps={"time_s": ColumnMap("elapsed time", "s")},
    )
    assert other.dt_s == pytest.approx(4.0)


def test_a_log_without_time_needs_the_sampling_time(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    with pytest.raises(RecordError, match=r"there is no time: .*--dt 0\.001"):
        record_of(path, "Sample", str)
    record = record_of(path, "Sample", str, dt_s=DT_S)
    assert record.dt_s == pytest.approx(DT_S)
    assert "from --dt" in time_of(record).why
    # Two columns of one's own need none, as in every record.
    assert read_record(path, columns=["Valve [V]", "Stroke [mm]"]).dt_s is None


def test_a_sampling_time_in_the_header_block_is_used_and_told(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    rows = "".join(f"{k % 7};{100 + k % 9}\n" for k in range(N))
    for line, dt_s in (
        ("Sampling rate: 250 Hz", 0.004),
        ("Sample Interval;0.004", 0.004),
        ("Abtastzeit: 4 ms", 0.004),
    ):
        path.write_text(f"Rig 7\n{line}\nValve [V];Stroke [mm]\n{rows}")
        record = read_record(path)
        assert record.dt_s == pytest.approx(dt_s)
        assert record.origin is not None
        assert any("the one that the file states" in text for text in record.origin.remarks)


def test_milliseconds_in_the_column_of_seconds_are_pointed_out(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    rows = "".join(f"{k},{k % 5},0.1\n" for k in range(20))
    path.write_text(f"time_s,command_v,position_m\n{rows}")
    record = read_record(path)
    assert record.dt_s == 1.0  # the name says seconds
    assert record.origin is not None
    assert "--map 'time_s=time_s [ms]'" in record.origin.remarks[0]
    hints = Hints({"time_s": ColumnMap("time_s", "ms")})
    assert read_record(path, hints=hints).dt_s == pytest.approx(1e-3)


def test_signals_of_one_table_may_have_other_rates(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    time_s = DT_S * np.arange(N)
    slow = [f"{40 + 0.01 * k:.2f}" if k % 50 == 0 else "" for k in range(N)]
    rows = "".join(f"{t:.3f},{k % 7},{100 + k % 9},{slow[k]}\n" for k, t in enumerate(time_s))
    path.write_text(f"time,Valve [V],Stroke [mm],Oil temperature [°C]\n{rows}")
    record = read_record(path)
    assert len(record) == N
    np.testing.assert_allclose(record.column("position_m"), (100 + np.arange(N) % 9) * 1e-3)
    np.testing.assert_allclose(
        record.column("temperature_c")[:251], 40 + 0.01 * np.arange(251), atol=1e-9
    )
    assert (record.column("temperature_c")[251:] == 42.5).all()  # the last value is held


def test_a_damaged_time_is_named_and_not_left_out(tmp_path: Path) -> None:
    """Without its column of time the log would be read as one that has none."""
    rows = [f"{0.001 * k:.3f};{k % 2};{100 + k % 7}" for k in range(300)]
    rows[200] = "x;1;100"
    log = tmp_path / "log.csv"
    text = "\n".join(["Zeit;Ventil [V];Weg [mm]", *rows])
    log.write_text(text.replace(".", ",") + "\n", encoding="utf-8")
    with pytest.raises(RecordError, match=r"row 202, column 'Zeit': the text 'x' is not a number"):
        read_record(log)

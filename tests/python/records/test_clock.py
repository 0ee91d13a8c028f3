# SPDX-License-Identifier: MIT
"""Times in any unit and form are found, and said."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from ehsid.harness.records import ColumnMap, Hints, Record, RecordError, read_record
from ehsid.harness.records.record import Taken

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
    ("Time [min]", lambda k: f"{0.004 * k / 60:.10f}", "unit min"),
    ("Time [h]", lambda k: f"{0.004 * k / 3600:.12f}", "unit h"),
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


@pytest.mark.slow
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


def put_on(k: int, hours: float) -> datetime.datetime:
    """Local time of row k of a clock that is off by some hours from row 150 on."""
    return moment(k) + datetime.timedelta(hours=hours if k >= N // 2 else 0.0)


def wrapped(k: int, full: float, unit: float = 1.0) -> float:
    """A counter in ms that begins anew at row 150, when it has reached `full`."""
    return (full + unit * 4 * (k - N // 2)) % full


MENDED: list[tuple[str, Callable[[int], str], str]] = [
    ("summer time ends", lambda k: f"{put_on(k, -1):%Y-%m-%d %H:%M:%S.%f}", "end of summer time"),
    ("summer time begins", lambda k: f"{put_on(k, 1):%d.%m.%Y %H:%M:%S.%f}", "summer time began"),
    ("offsets", lambda k: f"{put_on(k, -1):%Y-%m-%dT%H:%M:%S.%f}{'+0200' if k < 150 else '+0100'}",
     ""),
    ("offsets at the beginning",
     lambda k: f"{put_on(k, 1):%Y-%m-%dT%H:%M:%S.%f}{'-05:00' if k < 150 else '-04:00'}", ""),
    ("zones", lambda k: f"{put_on(k, -1):%Y-%m-%d %H:%M:%S.%f} {'CEST' if k < 150 else 'CET'}", ""),
    ("AM and PM over midnight", lambda k: f"{moment(k):%I:%M:%S.%f %p}", ""),
    ("am and pm over noon",
     lambda k: f"{moment(k) + datetime.timedelta(hours=12):%I:%M:%S.%f}"
     f"{'am' if moment(k).hour == 23 else 'pm'}", ""),
    ("12 hours over one", lambda k: f"{moment(k) + datetime.timedelta(hours=13):%I:%M:%S.%f}",
     "12 hours"),
    ("days with hyphens", lambda k: f"{moment(k):%d-%m-%Y %H:%M:%S.%f}", ""),
    ("16 bits", lambda k: f"{wrapped(k, 2**16):.0f}", "begins anew at 65536"),
    ("32 bits", lambda k: f"{wrapped(k, 2**32):.0f}", "begins anew at 4294967296"),
    ("32 bits in s", lambda k: f"{wrapped(k, 2**32 * 1e-6, 1e-3):.6f}",
     "begins anew at 4294.96729"),
    ("signed", lambda k: f"{(32768 + 4 * (k - 150)) % 65536 - (0 if k < 150 else 65536):.0f}",
     "begins anew at 65536"),
    ("decimal", lambda k: f"{wrapped(k, 1e6):.0f}", "begins anew at 1000000"),
    ("milliseconds of the second", lambda k: f"{wrapped(k, 1e3):.0f}", "begins anew at 1000"),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("label", "cell", "remark"), MENDED, ids=[one[0] for one in MENDED])
def test_a_clock_that_jumps_by_a_known_amount_runs_on(
    tmp_path: Path, label: str, cell: Callable[[int], str], remark: str
) -> None:
    record = record_of(tmp_path / "log.txt", "Time", cell)
    assert record.dt_s == pytest.approx(DT_S, rel=1e-6)
    assert len(record) == N
    assert len(record.segments) == 1
    assert record.origin is not None
    jumps = [text for text in record.origin.remarks if "'Time':" in text]
    assert len(jumps) == (1 if remark else 0)
    if remark:
        assert remark in jumps[0]
        assert "row 152" in jumps[0]


@pytest.mark.parametrize(
    ("cell", "message"),
    [
        (lambda k: f"{4 * (k % 150)}", "row 152, column 'time_s': time runs backwards"),
        (lambda k: f"{4 * (k % 250)}", "time runs backwards"),  # 1000 ms, twice from 0
        (lambda k: f"{put_on(k, -2):%Y-%m-%d %H:%M:%S.%f}", "time runs backwards"),
        (
            lambda k: "damaged" if k == 200 else f"{moment(k):%Y-%m-%d %H:%M:%S.%f}",
            "row 202, column 'Time': the text 'damaged' is no date or time of the form of '2024",
        ),
        (
            lambda k: "damaged" if k == 0 else f"{moment(k):%Y-%m-%d %H:%M:%S.%f}",
            "row 2, column 'Time': the text 'damaged'",
        ),
        (
            lambda k: f"{moment(k):%Y-%m-%d %H:%M:%S.%f}{'Z' if k != 90 else ''}",
            "row 92, column 'Time'",
        ),
    ],
)
def test_a_clock_that_cannot_be_right_is_refused(
    tmp_path: Path, cell: Callable[[int], str], message: str
) -> None:
    with pytest.raises(RecordError, match=message):
        record_of(tmp_path / "log.txt", "Time", cell)


@pytest.mark.parametrize("header", ["Time", "timestamp"])
@pytest.mark.parametrize("ending", ["csv", "txt", "parquet", "npz"])
def test_the_time_is_used_where_no_channel_is_known(
    tmp_path: Path, header: str, ending: str
) -> None:
    rng = np.random.default_rng(3)
    time_s = np.cumsum(rng.uniform(0.022, 0.052, N))
    frame = pl.DataFrame({header: time_s, "Boom Cmd": np.arange(N) % 7.0, "Boom Ms": time_s**0.5})
    path = tmp_path / f"log.{ending}"
    if ending == "parquet":
        frame.write_parquet(path)
    elif ending == "npz":
        np.savez(path, **{name: frame[name].to_numpy() for name in frame.columns})
    else:
        frame.write_csv(path)
    read = read_record(path, required=())
    named = read_record(path, columns=["Boom Cmd", "Boom Ms"])
    assert read.dt_s == named.dt_s is not None
    assert set(read.columns) == {"Boom Cmd", "Boom Ms"}
    np.testing.assert_array_equal(read.column("Boom Ms"), named.column("Boom Ms"))
    assert read.origin is not None
    assert any("resampled" in text for text in read.origin.remarks)


def test_moments_with_a_time_zone_are_not_put_back(tmp_path: Path) -> None:
    utc = pl.datetime_range(
        datetime.datetime(2023, 10, 29, 0, 59, 59), datetime.datetime(2023, 10, 29, 1, 0, 1),
        "10ms", time_unit="us", time_zone="UTC", eager=True,
    )  # fmt: skip
    n = len(utc)
    for zone in ("UTC", "Europe/Berlin"):
        path = tmp_path / "log.parquet"
        pl.DataFrame(
            {"when": utc.dt.convert_time_zone(zone), "a": np.arange(n) % 5.0, "b": np.ones(n)}
        ).write_parquet(path)
        record = read_record(path, required=())
        assert record.dt_s == pytest.approx(0.01)
        assert len(record) == n
        assert len(record.segments) == 1


def test_a_column_of_time_that_does_not_run_is_told(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text("Time;a;b\n" + "".join(f"12:00:00;{k};{k % 3}\n" for k in range(N)))
    for columns in (None, ["a", "b"]):
        record = read_record(path, columns=columns, required=())
        assert record.dt_s is None
        assert record.origin is not None
        assert any("'Time' is not used as the time" in text for text in record.origin.remarks)


def test_one_row_with_a_sampling_time_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("time_s,command_v,position_m\n0.0,0,0.0\n")
    with pytest.raises(RecordError, match="fewer than two values with a time"):
        read_record(path, required=(), hints=Hints(dt_s=0.02))

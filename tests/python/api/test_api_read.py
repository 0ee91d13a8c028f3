# SPDX-License-Identifier: MIT
import logging
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pytest
from sources import ROOT

import ehsid
from ehsid.harness.records import read_record

EMPS = ROOT / "tests" / "python" / "data" / "emps" / "emps.csv"
CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"


def same(one: ehsid.Record, other: ehsid.Record) -> None:
    """Checks that both have the same samples, bit for bit."""
    assert one.dt_s == other.dt_s
    assert list(one.columns) == list(other.columns)
    for name, values in one.columns.items():
        assert np.array_equal(values, other[name]), name
    assert (one.time_s is None) == (other.time_s is None)
    if one.time_s is not None:
        assert np.array_equal(one.time_s, other.time_s)


@pytest.mark.parametrize("path", [EMPS, CRANE], ids=["emps", "crane"])
def test_a_file_gives_the_record_of_the_room(path: Path) -> None:
    record = ehsid.read(path)
    room = read_record(path, required=())
    assert record.result.sha256 == room.sha256
    same(record, ehsid.Record(room))


@pytest.mark.parametrize("path", [EMPS, CRANE], ids=["emps", "crane"])
def test_frames_and_arrays_give_the_record_of_the_file(path: Path) -> None:
    frame = pl.read_csv(path)
    columns = {name: frame[name].to_numpy() for name in frame.columns}
    expected = ehsid.read(path)
    for source in (frame, pd.DataFrame(columns), columns):
        same(ehsid.read(source), expected)


def test_a_named_index_of_pandas_is_a_column() -> None:
    frame = pl.read_csv(EMPS)
    columns = {name: frame[name].to_numpy() for name in frame.columns}
    same(ehsid.read(pd.DataFrame(columns).set_index("time_s")), ehsid.read(EMPS))


@pytest.mark.parametrize("zone", [None, "UTC", "Europe/Berlin"])
@pytest.mark.parametrize("name", [None, "time", "stamp"])
def test_dates_in_an_index_of_pandas_are_the_time(zone: str | None, name: str | None) -> None:
    moments = pd.date_range("2026-01-01", periods=50, freq="10ms", tz=zone, name=name)
    record = ehsid.read(pd.DataFrame({"command_v": np.arange(50.0)}, index=moments))
    assert record.dt_s == pytest.approx(0.01)
    assert list(record) == ["command_v"]


def test_dates_of_polars_are_the_time() -> None:
    start, end = pl.datetime(2026, 1, 1, time_zone="UTC"), pl.datetime(2026, 1, 1, 0, 0, 1)
    moments = pl.datetime_range(start, end.dt.replace_time_zone("UTC"), "10ms", eager=True)
    record = ehsid.read(pl.DataFrame({"stamp": moments, "command_v": np.arange(101.0)}))
    assert record.dt_s == pytest.approx(0.01)
    assert list(record) == ["command_v"]


def log_rows() -> dict[str, np.ndarray]:
    """A log with German names: milliseconds, millimetres, volts."""
    frame = pl.read_csv(EMPS, n_rows=2000)
    return {
        "Zeit [ms]": 1e3 * frame["time_s"].to_numpy(),
        "Weg [mm]": 1e3 * frame["position_m"].to_numpy(),
        "Stellgröße": frame["command_v"].to_numpy(),
    }


@pytest.mark.parametrize(
    "maps",
    [None, {"position_m": "Weg [mm]", "command_v": "Stellgröße [V]"}],
    ids=["guessed", "mapped"],
)
def test_a_log_in_memory_is_read_as_its_file(maps: dict[str, str] | None, tmp_path: Path) -> None:
    columns = log_rows()
    if maps is not None:  # a map names the column without its unit
        columns = {name.replace("Weg [mm]", "Weg"): values for name, values in columns.items()}
    path = tmp_path / "log.parquet"
    pl.DataFrame(columns).write_parquet(path)
    expected = ehsid.read(path, maps=maps)
    assert {"command_v", "position_m"} <= set(expected.columns)
    assert expected.dt_s == pytest.approx(1e-3)
    same(ehsid.read(columns, maps=maps), expected)
    assert expected["position_m"][-1] == pytest.approx(1e-3 * columns[list(columns)[1]][-1])


def test_a_sampling_time_makes_the_time_of_rows_and_resamples() -> None:
    rows = {"command_v": np.arange(100.0), "position_m": np.arange(100.0) * 1e-3}
    record = ehsid.read(rows, dt_s=0.002)
    assert record.dt_s == pytest.approx(0.002)
    assert np.array_equal(record["command_v"], rows["command_v"])
    slower = ehsid.read(rows | {"time_s": np.arange(100) * 1e-3}, dt_s=0.002)
    assert slower.dt_s == pytest.approx(0.002)
    assert len(slower) == 50


def test_a_record_is_resampled_as_its_file_is() -> None:
    record = ehsid.read(EMPS)
    same(ehsid.read(record, dt_s=0.004), ehsid.read(EMPS, dt_s=0.004))
    renamed = ehsid.read(record.result, name="other")
    assert renamed.name == "other"
    same(renamed, record)


def test_a_record_says_samples_time_and_units() -> None:
    record = ehsid.read(EMPS)
    shown = repr(record)
    assert shown == (
        "<ehsid.Record: emps, 24841 samples, every 0.001 s; command_v in V, position_m in m, "
        "reference_m>"
    )
    assert "24841 samples" in record.summary()
    assert len(record) == 24841
    assert list(record) == ["command_v", "position_m", "reference_m"]
    assert "position_m" in record
    assert "spool" not in record


def test_a_record_is_saved_and_read_again(tmp_path: Path) -> None:
    record = ehsid.read(EMPS)
    path = record.save(tmp_path / "kept.parquet")
    same(ehsid.read(path), record)
    theirs = tmp_path / "theirs.csv"
    theirs.write_text("mine")
    with pytest.raises(ValueError, match=r"theirs\.csv"):
        record.save(theirs)
    assert theirs.read_text() == "mine"


def test_frames_come_out_as_they_went_in() -> None:
    record = ehsid.read(EMPS)
    same(ehsid.read(record.to_polars()), record)
    same(ehsid.read(record.to_pandas()), record)


@pytest.mark.parametrize(("package", "other"), [("pandas", "polars"), ("polars", "pandas")])
def test_without_a_package_the_error_says_what_to_do(
    package: str, other: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, package, None)
    with pytest.raises(ModuleNotFoundError, match=rf"pip install {package}.*to_{other}"):
        getattr(ehsid.read(CRANE), f"to_{package}")()


def test_remarks_go_to_the_logger(caplog: pytest.LogCaptureFixture) -> None:
    slow = {"time_s": np.arange(10.0), "command_v": np.arange(10.0)}
    with caplog.at_level(logging.INFO, logger="ehsid"):
        ehsid.read(slow)
    (remark,) = [one for one in caplog.records if one.levelno == logging.WARNING]
    assert remark.name == "ehsid"
    assert "maps={'time_s': 'time_s [ms]'}" in remark.getMessage()
    assert "--" not in remark.getMessage()


@pytest.mark.parametrize(
    ("source", "options", "says"),
    [
        (3.0, {}, ["float is no record", "expected a path"]),
        (pl.LazyFrame({"a": [1.0, 2.0]}), {}, ["LazyFrame", "collect()"]),
        ({}, {}, ["no columns"]),
        ({"time_s": [0.0, 1.0]}, {}, ["beside 'time_s'"]),
        ({"a": [1.0, 2.0], "b": [1.0]}, {}, ["'b'", "1 samples", "'a' has 2"]),
        ({"a": np.ma.masked_equal([1.0, 2.0], 2.0)}, {}, ["'a'", "masked"]),
        ({"a": np.ma.masked_equal([1.0, 2.0], 2.0)}, {"dt_s": 1e-3}, ["'a'", "masked"]),
        ({"a": [[1.0, 2.0], [1.0]]}, {}, ["'a'", "not one column"]),
        ({"a": [1.0, np.nan, 2.0]}, {}, ["row 2", "'a'", "NaN"]),
        ({"command_v": ["x", "y"]}, {}, ["'command_v'", "real numbers"]),
        ({"command_v": ["x", "y"]}, {"dt_s": 1e-3}, ["'command_v'", "real numbers"]),
        ({"a": [1.0, 2.0]}, {"dt_s": 0.0}, ["dt_s = 0", "above 0"]),
        ({"a": [1.0, 2.0]}, {"maps": {"positon_m": "a"}}, ["position_m"]),
        ({"a": [1.0, 2.0]}, {"maps": {"position_m": "a [bar]"}}, ["bar", "position_m"]),
        ("no_such.csv", {}, ["no_such.csv", "no such file"]),
    ],
)
def test_errors_say_what_where_and_how_to_mend(
    source: object, options: dict[str, object], says: list[str]
) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 -- the texts are in the table
        ehsid.read(source, **options)  # type: ignore[arg-type]
    for text in says:
        assert text in str(caught.value)
    assert "--" not in str(caught.value)


def test_errors_have_the_name_of_the_record() -> None:
    with pytest.raises(ValueError, match=r"^run7, row 2, column 'a'"):
        ehsid.read({"a": [1.0, np.nan]}, name="run7")


def test_two_columns_of_one_name_are_refused() -> None:
    frame = pd.DataFrame([[1.0, 2.0], [3.0, 4.0]], columns=["a", "a"])
    with pytest.raises(ValueError, match="two columns 'a'"):
        ehsid.read(frame)


def test_columns_of_text_are_left_out_with_a_remark() -> None:
    record = ehsid.read({"command_v": [0.0, 1.0, 2.0], "note": ["a", "b", "c"]})
    assert list(record.columns) == ["command_v"]
    assert "'note'" in record.summary()

# SPDX-License-Identifier: MIT
"""Columns in memory are read as in a file; one that nobody needs stops nothing, and is named."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from ehsid.harness.records import Hints, Record, RecordError, read_record
from ehsid.harness.records.reading import record_of_columns
from ehsid.harness.records.record import digest, told_apart

N, FILLED = 600, 18
KINDS = ["csv", "txt", "parquet", "npz", "memory"]
NAMES = {
    "schema": ("time_s", "command_v", "position_m"),
    "log": ("Time (s)", "Valve (V)", "Stroke (m)"),
    "unknown": ("Time", "PG_1", "Angle"),
    "no time": ("k1", "PG_1", "Angle"),
}
ROWS = {"time_s": np.arange(6) * 0.1, "command_v": np.arange(6.0), "other": np.ones(6)}
SIDES = {
    "half filled": (np.where(np.arange(N) < FILLED, 1.5 * np.arange(N), np.nan), "whole|582"),
    "infinite": (np.where(np.arange(N) == 7, np.inf, 1.0), "row (8|9) is infinite"),
}  # fmt: skip


def read(
    folder: Path, kind: str, columns: dict[str, np.ndarray], required: tuple[str, ...] = ()
) -> Record:
    if kind == "memory":
        return record_of_columns(columns)
    path = folder / f"log.{kind}"
    if kind == "npz":
        np.savez(path, **columns)
        return read_record(path, required=required)
    frame = pl.DataFrame(columns).with_columns(pl.all().fill_nan(None))
    if kind == "parquet":
        frame.write_parquet(path)
    else:
        frame.write_csv(path, separator="," if kind == "csv" else "\t")
    return read_record(path, required=required)


def columns_of(names: tuple[str, ...]) -> dict[str, np.ndarray]:
    k = np.arange(N)
    return dict(zip(names, (0.01 * k, np.sin(0.1 * k), 0.1 + 0.01 * np.cos(0.1 * k)), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("names", NAMES.values(), ids=NAMES)
@pytest.mark.parametrize(("side", "remark"), SIDES.values(), ids=SIDES)
def test_a_column_that_nobody_needs_is_left_out_and_named(
    tmp_path: Path, kind: str, names: tuple[str, ...], side: np.ndarray, remark: str
) -> None:
    record = read(tmp_path, kind, {**columns_of(names), "F_Values": side})
    assert len(record) == N
    assert "F_Values" not in record.columns
    assert {"command_v", "PG_1"} & set(record.columns)
    assert record.origin is not None
    said = [text for text in record.origin.remarks if "'F_Values' is left out" in text]
    assert len(said) == 1
    assert re.search(remark, said[0])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("names", [NAMES["schema"], NAMES["log"]], ids=["schema", "log"])
def test_an_infinite_value_where_it_is_needed_is_named(
    tmp_path: Path, kind: str, names: tuple[str, ...]
) -> None:
    columns = columns_of(names)
    columns[names[2]][7] = np.inf
    with pytest.raises(RecordError, match=r"row (8|9) is infinite"):
        read(tmp_path, kind, columns)


def test_most_rows_of_a_log_are_not_said_to_be_removed(tmp_path: Path) -> None:
    columns = {**columns_of(NAMES["no time"]), "F_Values": SIDES["half filled"][0]}
    with pytest.raises(RecordError) as caught:
        read(tmp_path, "csv", columns, required=("PG_1", "F_Values"))
    assert "remove" not in str(caught.value.mend)


def test_columns_of_the_schema_stay_as_they_are() -> None:
    record = record_of_columns(ROWS, name="run")
    assert record.name == "run"
    assert record.source is None
    assert record.origin is None
    assert record.dt_s == pytest.approx(0.1)
    for name in ("command_v", "other"):
        assert np.array_equal(record.column(name), ROWS[name])
        assert not np.shares_memory(record.column(name), ROWS[name])
        assert not record.column(name).flags.writeable


def test_an_uneven_time_is_resampled_with_a_remark() -> None:
    time_s = np.arange(50) * 0.01
    time_s[10:40] += 0.002 * np.sin(np.arange(30))
    record = record_of_columns({"time_s": time_s, "command_v": np.zeros(50)})
    assert record.source is None
    assert np.ptp(np.diff(record.time_s)) < 1e-9
    assert record.origin is not None
    assert "resampled" in " ".join(record.origin.remarks)


def test_dates_are_a_time() -> None:
    start = np.datetime64("2026-01-01T00:00:00", "ms")
    moments = start + np.arange(5) * np.timedelta64(10, "ms")
    record = record_of_columns({"stamp": moments, "command_v": np.arange(5.0)})
    assert record.dt_s == pytest.approx(0.01)
    assert np.array_equal(record.column("command_v"), np.arange(5.0))


def test_the_digest_tells_names_and_values_apart() -> None:
    base = record_of_columns({"a": [1.0, 2.0], "b": [3.0, 4.0]}).sha256
    assert base == record_of_columns({"a": [1.0, 2.0], "b": [3.0, 4.0]}, name="other").sha256
    others = (
        {"a": [1.0, 2.0], "c": [3.0, 4.0]},
        {"a": [3.0, 4.0], "b": [1.0, 2.0]},
        {"a": [1.0, 2.0], "b": [3.0, 5.0]},
    )
    assert base not in {record_of_columns(one).sha256 for one in others}
    assert digest([]) != base


def test_the_same_record_twice_is_refused_also_without_a_file() -> None:
    one = record_of_columns(ROWS, name="one")
    other = record_of_columns(ROWS, name="other")
    for pair in ([one, one], [one, other]):
        with pytest.raises(ValueError, match="the same data as one"):
            told_apart(pair)


def test_a_sampling_time_of_rows_with_a_time_resamples() -> None:
    record = record_of_columns(ROWS, hints=Hints(dt_s=0.2))
    assert record.dt_s == pytest.approx(0.2)
    assert record.source is None


def test_arrays_of_more_than_one_column_are_refused() -> None:
    with pytest.raises(RecordError, match="not one column: 2 x 3"):
        record_of_columns({"a": np.zeros((2, 3))})

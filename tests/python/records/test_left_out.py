# SPDX-License-Identifier: MIT
"""A column that nobody needs does not stop the reading of the others, and is named."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from ehsid.harness.records import Record, RecordError, read_record
from ehsid.harness.records.reading import record_of_columns

N, FILLED = 600, 18
KINDS = ["csv", "txt", "parquet", "npz", "memory"]
NAMES = {
    "schema": ("time_s", "command_v", "position_m"),
    "log": ("Time (s)", "Valve (V)", "Stroke (m)"),
    "unknown": ("Time", "PG_1", "Angle"),
    "no time": ("k1", "PG_1", "Angle"),
}
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

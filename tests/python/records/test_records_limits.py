# SPDX-License-Identifier: MIT
"""Bombs, endless files and lines: refused with a message before the memory is taken."""

from __future__ import annotations

import gzip
import os
import tracemalloc
from io import BytesIO
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import scipy.io
from sources import ROOT

from ehsid.harness.records import RecordError, errors, read_record
from ehsid.harness.records.errors import BYTES, SAMPLES
from ehsid.harness.rigs.checks import RIG_BYTES

NAMES = ("time_s", "command_v")
COUNT = 2_000_000  # 16 MB of each array, a few kB compressed


def bomb(path: Path) -> None:
    """Write a small file with much content."""
    columns = {name: np.zeros(COUNT) for name in NAMES}
    match path.suffix:
        case ".gz":
            path.write_bytes(gzip.compress(b"time_s,command_v\n" + 8 * COUNT * b"0,0\n"))
        case ".npz":
            np.savez_compressed(path, allow_pickle=False, **columns)
        case ".mat":
            scipy.io.savemat(path, columns, do_compression=True)
        case ".parquet":
            pl.DataFrame(columns).write_parquet(path)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["r.csv.gz", "r.npz", "r.mat", "r.parquet"])
def test_a_bomb_is_refused_before_it_takes_memory(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EHSID_MAX_BYTES", "1000000")
    bomb(tmp_path / name)
    assert (tmp_path / name).stat().st_size < 200_000
    # The memory of polars is not traced: instead, its reader must not be called.
    monkeypatch.setattr(pl, "read_parquet", None)
    tracemalloc.start()
    try:
        with pytest.raises(RecordError, match=r"bytes of content\. .*EHSID_MAX_BYTES") as raised:
            read_record(tmp_path / name)
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()
    assert str(raised.value).startswith(str(tmp_path / name))


def test_small_integers_count_as_the_numbers_that_they_become(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    buffer = BytesIO()
    column = np.zeros(100_000, dtype=np.int8)
    scipy.io.savemat(buffer, {"u": column, "y": column})  # type: ignore[arg-type]
    path = tmp_path / "r.mat"
    path.write_bytes(buffer.getvalue())
    monkeypatch.setenv("EHSID_MAX_BYTES", "1000000")
    with pytest.raises(RecordError, match="bytes of content"):
        read_record(path, columns=("u", "y"))
    monkeypatch.setenv("EHSID_MAX_BYTES", "2000000")
    assert len(read_record(path, columns=("u", "y"))) == column.size


@pytest.mark.parametrize("ending", ["csv", "csv.gz", "parquet"])
def test_the_number_of_samples(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"r.{ending}"
    text = "u,y\n" + "".join(f"{i},{i}\n" for i in range(11))
    if ending == "parquet":
        pl.DataFrame({"u": np.arange(11.0), "y": np.arange(11.0)}).write_parquet(path)
    else:
        path.write_bytes(gzip.compress(text.encode()) if ending == "csv.gz" else text.encode())
    monkeypatch.setenv("EHSID_MAX_SAMPLES", "11")
    assert len(read_record(path, columns=("u", "y"))) == 11
    monkeypatch.setenv("EHSID_MAX_SAMPLES", "10")
    with pytest.raises(RecordError, match=r"11 samples\. Expected: at most 10 samples"):
        read_record(path, columns=("u", "y"))


@pytest.mark.parametrize("ending", ["csv", "parquet", "npz", "mat"])
def test_the_number_of_columns(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"r.{ending}"
    columns = {f"c{i}": np.arange(3.0) for i in range(5)}
    match ending:
        case "csv":
            pl.DataFrame(columns).write_csv(path)
        case "parquet":
            pl.DataFrame(columns).write_parquet(path)
        case "npz":
            np.savez(path, allow_pickle=False, **columns)
        case "mat":
            scipy.io.savemat(path, columns)
    monkeypatch.setenv("EHSID_MAX_COLUMNS", "5")
    assert len(read_record(path, columns=("c0", "c4"))) == 3
    monkeypatch.setenv("EHSID_MAX_COLUMNS", "4")
    with pytest.raises(RecordError, match="5 columns"):
        read_record(path, columns=("c0", "c4"))


@pytest.mark.parametrize(
    ("text", "row"),
    [
        ("u,y\n" + "1,2\n" * 50 + "1," * 60 + "\n1,2\n", 52),
        ("u," * 60 + "y\n1,2\n", 1),
        ("u,y\n1,2\n" + "1," * 60, 3),
    ],
)
def test_the_length_of_a_line(
    text: str, row: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EHSID_MAX_LINE", "99")
    path = tmp_path / "r.csv"
    path.write_text(text)
    with pytest.raises(RecordError, match="more than 99 bytes in one line") as raised:
        read_record(path, columns=("u", "y"))
    assert raised.value.row == row


def test_lines_as_long_as_allowed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "r.csv"
    path.write_text("u,y\n" + "1.00,2.00\n" * 40)
    monkeypatch.setenv("EHSID_MAX_LINE", "9")
    assert len(read_record(path, columns=("u", "y"))) == 40
    monkeypatch.setenv("EHSID_MAX_LINE", "8")
    with pytest.raises(RecordError, match="row 2: more than 8 bytes"):
        read_record(path, columns=("u", "y"))


@pytest.mark.parametrize("ending", ["csv", "csv.gz", "parquet", "mat", "npz"])
def test_a_device_and_a_pipe_are_not_opened(ending: str, tmp_path: Path) -> None:
    endless, pipe = tmp_path / f"zero.{ending}", tmp_path / f"pipe.{ending}"
    endless.symlink_to("/dev/zero")
    os.mkfifo(pipe)
    for path in (endless, pipe):
        with pytest.raises(RecordError, match="a device or a pipe, not a regular file"):
            read_record(path)


@pytest.mark.parametrize("value", ["0", "-1", "1e6", "", "many", "\u0661", "9" * 5000])
def test_a_limit_that_is_no_number_is_refused(value: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(SAMPLES.variable, value)
    with pytest.raises(ValueError, match=r"EHSID_MAX_SAMPLES=.*: expected a whole number above 0"):
        assert SAMPLES.most


def test_the_limits_stand_in_the_documents() -> None:
    text = (ROOT / "docs" / "records.md").read_text("utf-8")
    for limit in (BYTES, SAMPLES, errors.COLUMNS, errors.LINE, RIG_BYTES):
        assert f"| `{limit.variable}` | {limit.default:,} |".replace(",", " ") in text

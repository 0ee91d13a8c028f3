# SPDX-License-Identifier: MIT
"""Damaged MAT files that would end the process in scipy are refused before it sees them."""

from __future__ import annotations

import struct
from io import BytesIO
from pathlib import Path

import numpy as np
import polars as pl
import pytest
import scipy.io
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.records import RecordError, read_record
from ehsid.harness.records.kinds.mat import DamagedError, check_elements


def content(*, compressed: bool) -> bytes:
    buffer = BytesIO()
    scipy.io.savemat(
        buffer,  # type: ignore[arg-type]
        {
            "u": np.arange(8.0),
            "z": np.arange(8.0) * 1j,
            "small": np.arange(3, dtype=np.int8),
            "text": "abc",
            "rig": {"mass_kg": 120.0, "names": np.array(["a", 1.0], dtype=object)},
            "empty": np.zeros((0, 0)),
            "sparse": scipy.sparse.csc_array(np.eye(3)),
        },
        do_compression=compressed,
    )
    return buffer.getvalue()


PLAIN, COMPRESSED = content(compressed=False), content(compressed=True)
# Within the first variable, "u": 8 bytes of tag, then flags, dimensions, name in a small element,
# and numbers, whose tag starts after 8 + 16 + 16 + 8 bytes.
FIRST = 128
FLAGS, DIMENSIONS, NUMBERS = FIRST + 16, FIRST + 32, FIRST + 48


def any_size(_: int) -> None:
    """No limit."""


def patched(position: int, form: str, value: int) -> bytes:
    data = bytearray(PLAIN)
    struct.pack_into(form, data, position, value)
    return bytes(data)


def test_sound_files_pass() -> None:
    check_elements(PLAIN, any_size)
    check_elements(COMPRESSED, any_size)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("data", "message"),
    [
        (patched(NUMBERS, "<I", 8), "unknown data type 8"),
        (patched(NUMBERS, "<I", 14), "an array of numbers that holds arrays"),
        (patched(NUMBERS, "<I", 3), "64 bytes for 8 numbers"),
        (patched(NUMBERS + 4, "<I", 9999), "longer than what holds it"),
        (patched(FLAGS + 1, "<B", 8), "1 parts instead of 2"),
        (patched(DIMENSIONS, "<i", -8), "a negative dimension"),
        (patched(DIMENSIONS, "<i", 2**30), "64 bytes for"),
        (patched(FIRST, "<I", 9), "a variable of data type 9"),
        (patched(126, "<H", 0), "byte order"),
        (PLAIN[:-4], "longer than what holds it"),
        (COMPRESSED[:-20] + bytes(20), "decompressing"),
    ],
)
def test_inconsistent_elements_are_refused(tmp_path: Path, data: bytes, message: str) -> None:
    with pytest.raises(DamagedError, match=message):
        check_elements(data, any_size)
    path = tmp_path / "bad.mat"
    path.write_bytes(data)
    with pytest.raises(RecordError, match="not a readable MAT file"):
        read_record(path, columns=("u",))


def test_arrays_within_arrays_have_an_end() -> None:
    cell = np.array([1.0], dtype=object)
    for _ in range(40):
        cell, inner = np.empty(1, dtype=object), cell
        cell[0] = inner
    buffer = BytesIO()
    scipy.io.savemat(buffer, {"c": cell})  # type: ignore[arg-type]
    with pytest.raises(DamagedError, match="without end"):
        check_elements(buffer.getvalue(), any_size)


@given(
    position=st.integers(0, len(PLAIN) - 1),
    inserted=st.binary(min_size=1, max_size=8)
    | st.sampled_from([bytes([code]) for code in range(20)]),
)
def test_damage_raises_no_other_error(
    tmp_path_factory: pytest.TempPathFactory, position: int, inserted: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "fuzz.mat"
    path.write_bytes(PLAIN[:position] + inserted + PLAIN[position + len(inserted) :])
    try:
        record = read_record(path, columns=("u",))
    except RecordError:
        return
    assert np.isfinite(record.column("u")).all()


def test_sizes_in_a_parquet_file_that_make_its_reader_give_up(tmp_path: Path) -> None:
    buffer = BytesIO()
    pl.DataFrame({"time_s": np.arange(8.0), "u": np.arange(8.0)}).write_parquet(buffer)
    sound = buffer.getvalue()
    path = tmp_path / "r.parquet"
    refused = 0
    for position in range(0, len(sound), 7):
        path.write_bytes(sound[:position] + b"\x7e" + sound[position + 1 :])
        try:
            read_record(path, columns=("u",))
        except RecordError:
            refused += 1
    assert refused > 0

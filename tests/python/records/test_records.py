# SPDX-License-Identifier: MIT
"""Reading and writing sound records: every format, time base, segments, column choice."""

from __future__ import annotations

import gzip
import hashlib
from itertools import pairwise
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from sources import ROOT

from ehsid.harness.records import (
    Record,
    RecordError,
    make_record,
    read_record,
    write_record,
)
from ehsid.harness.records.checks import BRIDGED_STEPS, LARGEST, Gap, is_short

CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"
ENDINGS = ("csv", "csv.gz", "parquet", "mat", "npz")


def small_record(n: int = 5) -> Record:
    k = np.arange(n)
    return make_record(
        {"time_s": 0.05 * k, "command_v": np.sin(k), "position_m": 0.1 + 0.01 * k}, name="small"
    )


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_record_survives_each_format(tmp_path: Path, ending: str) -> None:
    written = small_record()
    path = tmp_path / f"run.{ending}"
    write_record(written, path)
    read = read_record(path)

    assert read.name == "run"
    assert read.source == path
    assert read.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert list(read.columns) == ["command_v", "position_m"]
    assert read.time_s is not None
    assert written.time_s is not None
    np.testing.assert_array_equal(read.time_s, written.time_s)
    for name, values in written.columns.items():
        np.testing.assert_array_equal(read.column(name), values)


@pytest.mark.slow
@given(
    values=arrays(
        np.float64,
        st.integers(2, 20),
        elements=st.floats(-LARGEST, LARGEST),
    ),
    ending=st.sampled_from(ENDINGS),
)
def test_numbers_keep_every_bit(
    tmp_path_factory: pytest.TempPathFactory, values: npt.NDArray[np.float64], ending: str
) -> None:
    path = tmp_path_factory.getbasetemp() / f"bits.{ending}"
    write_record(make_record({"u": values}), path)
    read = read_record(path, columns=("u",)).column("u")
    np.testing.assert_array_equal(read.view(np.uint64), values.view(np.uint64))


def test_the_crane_record_reads_as_two_columns() -> None:
    record = read_record(CRANE, columns=("valve_opening", "oil_pressure"))
    assert len(record) == 1024
    assert record.dt_s is None
    assert record.time_s is None
    assert record.jitter is None
    assert record.segments == (slice(0, 1024),)
    assert "sample" not in record.columns
    # The reader of numpy gives the same values.
    table = np.loadtxt(CRANE, delimiter=",", skiprows=1)
    np.testing.assert_array_equal(record.column("valve_opening"), table[:, 1])
    np.testing.assert_array_equal(record.column("oil_pressure"), table[:, 2])


def test_required_columns_follow_the_columns_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text("time_s,u,y,note\n0,1,2,a\n1,2,3,b\n2,3,4,c\n")
    chosen = read_record(path, columns=("u", "y"))
    assert list(chosen.columns) == ["u", "y"]
    assert chosen.dt_s == 1.0  # time is read, too
    # An optional column can be requested without being required.
    assert list(read_record(path, columns=("u", "spool"), required=("u",)).columns) == ["u"]
    path.write_text("time_s,a,b\n0,1,2\n1,2,3\n2,3,4\n")
    with pytest.raises(RecordError, match="no column 'command_v'"):
        read_record(path)


def test_arrays_are_read_only_copies() -> None:
    values = np.array([1.0, 2.0])
    record = make_record({"u": values})
    values[0] = 9.0
    assert record.column("u")[0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        record.column("u")[0] = 3.0
    with pytest.raises(TypeError):
        record.columns["v"] = values  # type: ignore[index]


def test_an_unknown_column_of_a_record_suggests_the_nearest() -> None:
    with pytest.raises(RecordError, match="rename 'position_m' to 'position'"):
        small_record().column("position")


@given(n=st.integers(2, 200), dt_s=st.floats(1e-5, 10.0), start_s=st.floats(-1e3, 1e3))
def test_a_uniform_time_base_has_no_gap(n: int, dt_s: float, start_s: float) -> None:
    # Rounding of a time of size t moves a step by up to one unit in the last place of t.
    rounding = np.spacing(abs(start_s) + n * dt_s) / dt_s
    record = make_record({"time_s": start_s + dt_s * np.arange(n), "u": np.zeros(n)})
    assert record.dt_s == pytest.approx(dt_s, rel=2 * rounding)
    assert record.segments == (slice(0, n),)
    assert record.gaps == ()
    assert record.jitter is not None
    assert record.jitter.max_relative <= 2 * rounding


@given(
    lengths=st.lists(st.integers(2, 30), min_size=2, max_size=5),
    gap=st.floats(1.6, 1e3),
)
def test_gaps_split_the_record(lengths: list[int], gap: float) -> None:
    dt_s = 0.01
    pieces, start = [], 0.0
    for length in lengths:
        pieces.append(start + dt_s * np.arange(length))
        start = pieces[-1][-1] + gap * dt_s
    time_s = np.concatenate(pieces)
    if 2 * (len(lengths) - 1) >= time_s.size - 1:  # the median step would be a gap
        return
    record = make_record({"time_s": time_s, "u": np.zeros(time_s.size)})

    edges = np.cumsum([0, *lengths])
    assert [(s.start, s.stop) for s in record.segments] == [(a, b) for a, b in pairwise(edges)]
    assert [g.row for g in record.gaps] == [int(edge) + 1 for edge in edges[1:-1]]
    for gap_rows in record.gaps:
        assert gap_rows.duration_s == pytest.approx(gap * dt_s, rel=1e-6)
    assert record.dt_s == pytest.approx(dt_s, rel=1e-9)


def test_jitter_is_reported_with_its_row() -> None:
    time_s = 0.1 * np.arange(50)
    time_s[20] += 0.0005  # the steps at both sides become 0.5 % too long and too short
    record = make_record({"time_s": time_s, "u": np.zeros(50)}, first_row=2)
    assert record.jitter is not None
    assert record.jitter.max_relative == pytest.approx(0.005, rel=1e-6)
    assert record.jitter.rms_relative == pytest.approx(np.sqrt(2 * 0.005**2 / 49), rel=1e-6)
    assert record.jitter.worst_row in (22, 23)


@pytest.mark.parametrize(
    "text",
    [
        "time_s, u\n0, 1\n1, 2\n",  # spaces after the commas
        "time_s,u\r\n0,1\r\n1,2\r\n",  # Windows line ends
        "time_s,u\r0,1\r1,2\r",  # old Macintosh line ends
        '"time_s","u"\n0,1\n1,2\n\n\n',  # quoted names, blank lines at the end
        "\ufefftime_s,u\n0 ,1 \n1 ,2 ",  # byte order mark, spaces before the commas
        "time_s,u\n0,1e0\n1,+2.\n",
    ],
)
def test_harmless_variants_of_csv(tmp_path: Path, text: str) -> None:
    path = tmp_path / "R.CSV"
    path.write_bytes(text.encode())
    record = read_record(path, columns=("u",))
    assert record.name == "R"
    np.testing.assert_array_equal(record.column("u"), [1.0, 2.0])
    assert record.dt_s == 1.0


def test_the_same_record_gives_the_same_gzip_bytes(tmp_path: Path) -> None:
    write_record(small_record(), tmp_path / "a.csv.gz")
    write_record(small_record(), tmp_path / "b.csv.gz")
    assert (tmp_path / "a.csv.gz").read_bytes() == (tmp_path / "b.csv.gz").read_bytes()
    header = gzip.decompress((tmp_path / "a.csv.gz").read_bytes()).splitlines()[0]
    assert header == b"time_s,command_v,position_m"


@pytest.mark.parametrize(
    ("steps", "short"), [(2.0, True), (BRIDGED_STEPS, True), (BRIDGED_STEPS + 0.5, False)]
)
def test_a_gap_that_a_log_would_bridge_is_short(steps: float, short: bool) -> None:
    assert is_short(Gap(row=10, start_s=1.0, duration_s=0.01 * steps), dt_s=0.01) is short

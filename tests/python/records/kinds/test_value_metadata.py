# SPDX-License-Identifier: MIT
"""What a file says about its numbers is applied, or refused by name: scales, starts, invalid."""

from __future__ import annotations

import datetime
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest

from ehsid.harness.records import Record, RecordError, read_record

COUNT, DT_S = 300, 0.01
TIME_S = DT_S * np.arange(COUNT + 30)
COMMAND = 3.0 * np.sin(2.0 * TIME_S) + np.sin(7.0 * TIME_S)
COUNTS = np.round(2000.0 * np.sin(2.0 * TIME_S - 1.0)).astype(np.int16)


def remarks(record: Record) -> str:
    assert record.origin is not None
    return "; ".join(record.origin.remarks)


def write_hdf5(path: Path, attributes: Mapping[str, Any], counts: Any = COUNTS[:COUNT]) -> Path:
    import h5py

    with h5py.File(path, "w") as file:
        file["time"] = TIME_S[: len(counts)]
        file["valve"] = COMMAND[: len(counts)]
        file["valve"].attrs["units"] = "V"
        file["stroke"] = counts
        file["stroke"].attrs.update({"units": "mm", **attributes})
    return path


@pytest.mark.parametrize("ending", ["h5", "mat"])
@pytest.mark.parametrize(
    "attributes",
    [
        {"scale_factor": 0.01, "add_offset": 50.0},
        {"scale_factor": np.array([0.01]), "add_offset": np.array([50], dtype=np.int16)},
        {"Scale_Factor": b"0.01", "ADD_OFFSET": "50"},
    ],
)
def test_counts_become_values(tmp_path: Path, attributes: dict[str, Any], ending: str) -> None:
    path = write_hdf5(tmp_path / "r.h5", attributes)
    if ending == "mat":  # 512 bytes of MATLAB in front of it
        content = b"MATLAB 7.3 MAT-file".ljust(512) + path.read_bytes()
        path = tmp_path / "r.mat"
        path.write_bytes(content)
    record = read_record(path)
    # 0.01 and 50 mm, each with a rounding of float64.
    np.testing.assert_allclose(
        record.column("position_m"), 1e-3 * (COUNTS[:COUNT] * 0.01 + 50.0), rtol=1e-14
    )
    assert "attributes of the file are applied" in remarks(record)


@pytest.mark.parametrize(
    "attributes",
    [
        {"_FillValue": np.int16(-30000)},
        {"missing_value": np.array([-1, -30000], dtype=np.int16)},
        {"valid_range": np.array([-2500, 2500], dtype=np.int16)},
        {"valid_min": np.array([-2500.0])},
    ],
    ids=lambda one: next(iter(one)),
)
def test_what_is_no_value_is_a_gap(tmp_path: Path, attributes: dict[str, Any]) -> None:
    counts = COUNTS[:COUNT].copy()
    counts[counts == -1] = 0
    counts[100:150] = -30000
    record = read_record(
        write_hdf5(tmp_path / "r.h5", {"scale_factor": 0.01, **attributes}, counts)
    )
    assert len(record) == COUNT - 50
    assert len(record.segments) == 2
    assert "'stroke' has no value in 50 of 300 rows" in remarks(record)


@pytest.mark.parametrize("value", [np.array([0.01, 0.02]), "1/100"])
def test_an_attribute_that_cannot_be_applied_is_refused_by_name(tmp_path: Path, value: Any) -> None:
    with pytest.raises(RecordError, match=r"'stroke'.*attribute scale_factor.*not understood"):
        read_record(write_hdf5(tmp_path / "r.h5", {"scale_factor": value}))


def test_an_attribute_of_unknown_meaning_is_told(tmp_path: Path) -> None:
    told = remarks(read_record(write_hdf5(tmp_path / "r.h5", {"Gain": 0.01, "offset": 0.0})))
    assert "'stroke' has attributes of unknown meaning, which are not applied: Gain = 0.01" in told
    assert "offset" not in told


def write_tdms(path: Path, late: Mapping[str, Any], extra: Mapping[str, Any]) -> Path:
    import nptdms

    start = np.datetime64("2015-11-20T20:13:43.500000")
    shift = int(extra.get("shift", 0))
    channels = [
        nptdms.ChannelObject(
            "run", name, values,
            {"wf_increment": DT_S, "wf_start_offset": 0.0, "unit_string": unit, **more},
        )
        for name, values, unit, more in (
            ("Valve", COMMAND[:COUNT], "V", {"wf_start_time": start}),
            ("Stroke", COUNTS[shift:COUNT + shift] * 0.01, "mm", {"wf_start_time": start, **late}),
        )
    ]  # fmt: skip
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(channels)
    return path


@pytest.mark.parametrize(
    "late",
    [{"wf_start_time": np.datetime64("2015-11-20T20:13:43.800000")}, {"wf_start_offset": 0.3}],
    ids=lambda one: next(iter(one)),
)
def test_waveforms_are_paired_by_their_start(tmp_path: Path, late: dict[str, Any]) -> None:
    record = read_record(write_tdms(tmp_path / "r.tdms", late, {"shift": 30}))
    assert len(record) == COUNT - 30
    assert record.time_s is not None
    assert record.time_s[0] == pytest.approx(0.3, abs=1e-9)
    # The common span; times of the two grids differ by rounding only.
    np.testing.assert_allclose(record.column("command_v"), COMMAND[30:COUNT], atol=1e-9)
    np.testing.assert_allclose(record.column("position_m"), 1e-5 * COUNTS[30:COUNT], atol=1e-9)
    assert ("waveforms start at different times" in remarks(record)) == ("wf_start_time" in late)


def test_a_waveform_whose_start_was_not_set_starts_with_the_first(tmp_path: Path) -> None:
    late = {"wf_start_time": np.datetime64("1904-01-01T00:00:00.000000")}
    assert len(read_record(write_tdms(tmp_path / "r.tdms", late, {}))) == COUNT


def test_a_scale_of_unknown_type_is_refused_by_name(tmp_path: Path) -> None:
    scale = {"NI_Number_Of_Scales": 1, "NI_Scaling_Status": "unscaled",
             "NI_Scale[0]_Scale_Type": "Reciprocal"}  # fmt: skip
    with pytest.raises(RecordError, match=r"'Stroke'.*of type 'Reciprocal', is not known"):
        read_record(write_tdms(tmp_path / "r.tdms", scale, {}))
    done = {**scale, "NI_Scaling_Status": "scaled"}
    assert len(read_record(write_tdms(tmp_path / "r.tdms", done, {}))) == COUNT


def write_mf4(path: Path, signals: Mapping[str, Any], invalid: slice | None = None) -> Path:
    import asammdf

    bits = np.zeros(COUNT, dtype=bool)
    if invalid is not None:
        bits[invalid] = True
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the writer
        file = asammdf.MDF(version="4.10")
        file.append(
            [
                asammdf.Signal(
                    values, TIME_S[:COUNT], unit="mm" if name == "Stroke" else "V", name=name,
                    **({"invalidation_bits": bits} if name == "Stroke" and bits.any() else {}),
                )
                for name, values in signals.items()
            ]
        )  # fmt: skip
        file.save(path, overwrite=True)
        file.close()
    return path


SIGNALS = {"Valve": COMMAND[:COUNT], "Stroke": 0.01 * COUNTS[:COUNT]}
BYTES = np.zeros((COUNT, 8), dtype=np.uint8)


def test_invalid_samples_are_a_hole(tmp_path: Path) -> None:
    record = read_record(write_mf4(tmp_path / "r.mf4", SIGNALS, slice(100, 150)))
    assert len(record) == COUNT - 50
    assert [s.stop - s.start for s in record.segments] == [100, 150]
    np.testing.assert_allclose(record.column("position_m")[:100], 1e-5 * COUNTS[:100], atol=1e-12)
    assert "'Stroke' has no value in 50 of 300 rows" in remarks(record)


def test_a_channel_of_several_numbers_is_left_out(tmp_path: Path) -> None:
    record = read_record(write_mf4(tmp_path / "r.mf4", {**SIGNALS, "RawBytes": BYTES}))
    assert set(record.columns) == {"command_v", "position_m"}
    assert "'RawBytes' is left out: it has several numbers in each sample" in remarks(record)


def test_raw_frames_have_to_be_decoded_first(tmp_path: Path) -> None:
    frames = {"CAN_DataFrame.ID": np.arange(COUNT), "CAN_DataFrame.DataBytes": BYTES}
    with pytest.raises(RecordError, match=r"raw frames of a bus.*decode.*DBC"):
        read_record(write_mf4(tmp_path / "r.mf4", frames))


@pytest.mark.parametrize("year", [1, 1600, 2500, 9000])
@pytest.mark.parametrize("unit", ["us", "ms"])
def test_dates_of_parquet_may_be_of_any_year(tmp_path: Path, year: int, unit: str) -> None:
    """Nanoseconds have room for the years 1677 to 2262 only."""
    start = datetime.datetime(year, 1, 1)
    moments = [start + datetime.timedelta(milliseconds=10 * k) for k in range(COUNT)]
    columns = {"t": pl.Series(moments, dtype=pl.Datetime(unit)), "command_v": COMMAND[:COUNT]}  # type: ignore[arg-type]
    pl.DataFrame(columns).write_parquet(tmp_path / "r.parquet")
    assert read_record(tmp_path / "r.parquet").dt_s == pytest.approx(DT_S, rel=1e-9)

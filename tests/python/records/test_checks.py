# SPDX-License-Identifier: MIT
"""Numbers that stand for no value become gaps; true extremes of every kind stay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import polars as pl
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ehsid.harness.records import Hints, Record, RecordError, read_record
from ehsid.harness.records.reading import record_of_columns
from ehsid.harness.records.values import sentinels_of

FloatArray = npt.NDArray[np.float64]
COUNT, DT_S = 400, 0.01
TIME_S = DT_S * np.arange(COUNT)
COMMAND = 4.0 * np.sin(2.0 * TIME_S) + np.sin(7.3 * TIME_S)
POSITION_MM = 150.0 + 60.0 * np.sin(2.0 * TIME_S - 1.0) + 0.01 * np.sin(90.0 * TIME_S)
HOLE = slice(120, 170)
MARKS = [-9999.0, 9999.0, -999.0, 9.9e37, -9.91e37, 1e30, 9.969209968386869e36, 32767.0, -32768.0,
         65535.0, 2147483647.0, 8888.88, -7777.0, 1e7]  # fmt: skip


def with_hole(mark: float, values: FloatArray = POSITION_MM) -> FloatArray:
    made = values.copy()
    made[HOLE] = mark
    return made


def write_text(path: Path, position: FloatArray) -> Path:
    rows = zip(TIME_S, COMMAND, position, strict=True)
    lines = "".join(f"{t:.9g};{u:.12g};{y:.12g}\n" for t, u, y in rows)
    path.write_text(f"Time [s];Valve [V];Stroke [mm]\n{lines}")
    return path


def write_parquet(path: Path, position: FloatArray) -> Path:
    columns = {"time_s": TIME_S, "command_v": COMMAND, "position_m": 1e-3 * position}
    columns["position_m"][HOLE] = position[HOLE]
    pl.DataFrame(columns).write_parquet(path)
    return path


def write_npz(path: Path, position: FloatArray) -> Path:
    np.savez(path, t=TIME_S, Valve=COMMAND, Stroke_mm=position)
    return path


def check(record: Record, mark: float) -> None:
    assert len(record) == COUNT - 50
    assert [one.stop - one.start for one in record.segments] == [120, 230]
    kept = np.delete(1e-3 * POSITION_MM, np.r_[HOLE])
    # Twelve digits of the text.
    np.testing.assert_allclose(record.column("position_m"), kept, rtol=0.0, atol=1e-9)
    assert record.origin is not None
    told = "; ".join(record.origin.remarks)
    assert f"is {mark:.9g} in 50 of 400 rows" in told
    assert "taken as no value" in told


@pytest.mark.slow
@pytest.mark.parametrize("write", [write_text, write_parquet, write_npz])
@pytest.mark.parametrize("mark", MARKS)
def test_a_mark_is_a_gap_in_every_kind_of_log(tmp_path: Path, write, mark: float) -> None:  # type: ignore[no-untyped-def]
    ending = {write_text: "csv", write_parquet: "parquet", write_npz: "npz"}[write]
    check(read_record(write(tmp_path / f"r.{ending}", with_hole(mark))), mark)


def test_columns_in_memory_give_the_same() -> None:
    position = with_hole(-9999.0, 1e-3 * POSITION_MM)
    columns = {"time_s": TIME_S, "command_v": COMMAND, "position_m": position}
    record = record_of_columns(columns)
    assert len(record) == COUNT - 50


@pytest.mark.parametrize("mark", [-9999.0, 9.9e37, 1e30])
def test_a_mark_in_the_command_is_a_gap_too(mark: float) -> None:
    found = sentinels_of(with_hole(mark, COMMAND), "command_v")
    assert found is not None
    assert found.numbers == (mark,)


def test_a_known_mark_is_found_from_one_span_away() -> None:
    """The signal goes from 2250 to 5250: -9999 is 4 spans from it, and so is any other number."""
    wide = 25.0 * POSITION_MM
    found = sentinels_of(with_hole(-9999.0, wide), "position_m")
    assert found is not None
    assert found.numbers == (-9999.0,)
    assert sentinels_of(with_hole(-9876.5, wide), "position_m") is None


def test_several_marks(tmp_path: Path) -> None:
    position = with_hole(9.9e37)
    position[130:140] = -9.9e37
    position[140:150] = -9999.0
    assert len(read_record(write_text(tmp_path / "r.csv", position))) == COUNT - 50


def test_without_a_time_a_mark_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    pl.DataFrame({"u": COMMAND, "y": with_hole(-9999.0)}).write_csv(path)
    with pytest.raises(RecordError, match=r"'y'.* is -9999 in 50 of 400 rows.*no gap"):
        read_record(path, columns=["u", "y"])
    record = read_record(path, columns=["u", "y"], hints=Hints(dt_s=DT_S))
    assert len(record) == COUNT - 50


def _noise(seed: int, size: float) -> FloatArray:
    return size * np.random.default_rng(seed).normal(size=COUNT)


def _step(low: FloatArray, high: float, start: int = 200) -> FloatArray:
    return np.where(np.arange(COUNT) >= start, high, low)


# Records that are as they should be: name, channel, values.
TRUE = [
    ("command steps from noise to a limit", "command_v", _step(_noise(1, 1e-3), 10.0)),
    ("command in counts steps to its end", "command_v", _step(np.round(_noise(2, 3.0)), 32767.0)),
    ("command in mV at the end of the converter", "command_v", _step(_noise(3, 1.0), 10000.0)),
    ("command of two levels", "command_v", _step(np.zeros(COUNT), 999.0)),
    ("command of two signs and nothing", "command_v",
     _step(_step(np.zeros(COUNT), -10.0), 10.0, 300)),
    ("command saturates", "command_v", np.clip(3.0 * COMMAND, -5.0, 5.0)),
    ("spool fully open", "spool", _step(_noise(4, 1e-3), 1.0)),
    ("position at its end stop", "position_m", np.minimum(1e-3 * POSITION_MM, 0.18)),
    ("position rests and goes to its end", "position_m",
     np.clip(0.1 + np.maximum(0.0, TIME_S - 2.0) + _noise(5, 1e-5), 0.0, 0.3)),
    ("constant position", "position_m", np.full(COUNT, 9999.0)),
    ("pressure at the limit of its sensor", "pressure_a_pa",
     np.minimum(1e5 * POSITION_MM, 1.6e7)),
    ("counter of 16 bits at its end", "position_m", np.minimum(250.0 * POSITION_MM, 32767.0)),
    ("pump off, then on", "supply_pressure_pa", _step(1.4e7 + _noise(6, 1e5), 2.5e5)),
    ("pump off at once, ideal", "supply_pressure_pa", _step(np.full(COUNT, 2.5e5), 1.4e7)),
    ("state of a machine", "state", _step(np.zeros(COUNT), 65535.0)),
]  # fmt: skip


@pytest.mark.parametrize(("channel", "values"), [one[1:] for one in TRUE],
                         ids=[one[0] for one in TRUE])  # fmt: skip
def test_a_true_extreme_stays(channel: str, values: FloatArray) -> None:
    assert sentinels_of(values, channel) is None


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    limit=st.floats(0.05, 3.0),
    scale=st.sampled_from([1e-3, 1.0, 10.0, 2000.0, 1e5]),
    channel=st.sampled_from(["command_v", "position_m", "pressure_a_pa", "force_n", "u"]),
)
def test_a_signal_that_reaches_its_limit_is_kept(
    seed: int, limit: float, scale: float, channel: str
) -> None:
    """Whatever it is clipped to, some of its other values lie near the limit."""
    rng = np.random.default_rng(seed)
    steps = np.cumsum(rng.normal(size=COUNT))
    values = scale * np.clip(steps / np.std(steps), -limit, limit)
    assert sentinels_of(values, channel) is None


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    mark=st.sampled_from(MARKS),
    rows=st.lists(st.integers(0, COUNT - 1), min_size=2, max_size=150, unique=True),
)
def test_a_mark_is_found_wherever_it_stands(seed: int, mark: float, rows: list[int]) -> None:
    values = 100.0 + 40.0 * np.sin(TIME_S + seed) + _noise(seed, 0.01)
    values[rows] = mark
    found = sentinels_of(values, "position_m")
    assert found is not None
    assert found.numbers == (mark,)
    assert np.count_nonzero(np.isnan(found.without(values))) == len(rows)

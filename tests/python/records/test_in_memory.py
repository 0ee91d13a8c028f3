# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from ehsid.harness.records import Hints, RecordError
from ehsid.harness.records.reading import record_of_columns
from ehsid.harness.records.record import digest, told_apart

ROWS = {"time_s": np.arange(6) * 0.1, "command_v": np.arange(6.0), "other": np.ones(6)}


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

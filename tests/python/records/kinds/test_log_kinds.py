# SPDX-License-Identifier: MIT
"""Logs of every kind of file, written by others, become the record of the motion they hold."""

from __future__ import annotations

import tomllib
import warnings
from pathlib import Path

import numpy as np
import pytest
from log_files import COUNT, DT_S, TRUTH, WRITERS, motion, write_mf4, write_timetable

from ehsid.harness.records import ColumnMap, Hints, Record, RecordError, read_record

# What a file loses: nine digits in text and Excel's cells; dates in nanoseconds move a sample by
# 1 ns, in which the fastest signal (33 rad/s) moves by 3e-8 of its size.
LOSS = 5e-8
# The supply pressure of the MF4 file has 10 Hz and moves with 0.5 Hz: 3/8 h^2 max|x''| by PCHIP.
# Behind its last sample, which is 0.098 s before the end, it is held: h max|x'|.
SLOW_PA = 3.0 / 8.0 * 0.1**2 * 1e5 * (2 * np.pi * 0.5) ** 2
HELD_PA = 0.098 * 1e5 * (2 * np.pi * 0.5)
SLOW_END_S = 3.9


@pytest.fixture(scope="module", params=WRITERS, ids=str)
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the writers
        return WRITERS[request.param](tmp_path_factory.mktemp("log"))


def check_truth(record: Record, *, slow_supply: bool = False) -> None:
    assert record.time_s is not None
    assert record.dt_s == pytest.approx(DT_S, rel=1e-9)
    assert len(record) >= COUNT - 1
    true = motion(record.time_s - record.time_s[0])
    for name in record.columns.keys() & true.keys():
        error = np.abs(record.column(name) - true[name])
        limit = np.full(error.size, LOSS * float(np.max(np.abs(true[name]))))
        if name == "supply_pressure_pa" and slow_supply:
            limit += np.where(record.time_s <= SLOW_END_S, SLOW_PA, HELD_PA)
        assert (error <= limit).all(), name


@pytest.mark.slow
def test_every_kind_of_log_holds_the_same_motion(log: Path) -> None:
    record = read_record(log)
    check_truth(record, slow_supply=log.suffix == ".mf4")
    assert {"command_v", "position_m"} <= set(record.columns)
    assert record.origin is not None
    taken = {one.channel: one for one in record.origin.taken}
    assert set(record.columns) <= set(taken)
    assert all(one.why for one in taken.values())
    if "bag" not in log.name:
        assert set(TRUTH) == set(record.columns)
        assert taken["position_m"].factor == pytest.approx(1e-3)
        assert taken["pressure_a_pa"].factor == pytest.approx(1e5)


@pytest.mark.slow
def test_the_printed_columns_read_the_log_again(log: Path) -> None:
    record = read_record(log)
    assert record.origin is not None
    table = tomllib.loads(record.origin.columns_block())["columns"]
    layout = {name: ColumnMap(**column) for name, column in table.items()}
    again = read_record(log, layout=layout)
    for name, values in record.columns.items():
        np.testing.assert_array_equal(again.column(name), values)


def test_a_timetable_of_the_older_format(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = write_timetable(tmp_path, version="v7")
    record = read_record(path)
    check_truth(record)
    assert record.origin is not None
    assert record.origin.kind == "MAT file"


def test_rates_are_told(tmp_path: Path) -> None:
    record = read_record(write_mf4(tmp_path))
    assert record.origin is not None
    (slower,) = [text for text in record.origin.remarks if "more slowly" in text]
    assert slower.startswith("supply_pressure_pa")
    assert "above 5 Hz nothing was measured" in slower
    (resampled,) = [text for text in record.origin.remarks if "resampled" in text]
    assert "signals every 2, 100 ms" in resampled


def test_a_name_or_unit_of_the_user_goes_before_all(tmp_path: Path) -> None:
    path = write_mf4(tmp_path)
    hints = Hints({"position_m": ColumnMap("Druck A", "mm")})
    record = read_record(path, columns=["command_v", "position_m"], hints=hints)
    expected = 1e-8 * motion(np.asarray(record.time_s))["pressure_a_pa"]
    np.testing.assert_allclose(record.column("position_m"), expected, rtol=1e-12)


def test_a_file_with_the_name_of_another_kind_is_read_as_what_it_is(tmp_path: Path) -> None:
    path = write_mf4(tmp_path)
    other = path.with_suffix(".dat")
    path.rename(other)
    check_truth(read_record(other), slow_supply=True)


def test_any_column_of_a_log_can_be_named(tmp_path: Path) -> None:
    record = read_record(write_mf4(tmp_path), columns=["Valve", "Druck A"])
    assert list(record.columns) == ["Valve", "Druck A"]
    np.testing.assert_allclose(record.column("Druck A"), 1e-5 * TRUTH["pressure_a_pa"], rtol=1e-12)
    with pytest.raises(RecordError, match="no column 'Valv'; the columns are: Valve, Stroke"):
        read_record(write_mf4(tmp_path), columns=["Valv"])


def write_joint_states(path: Path) -> Path:
    """Write stamped messages of ROS 2 with arrays into an MCAP file, by rosbags."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    kinds = {name: store.types[f"{name}"] for name in ("sensor_msgs/msg/JointState",
             "std_msgs/msg/Header", "builtin_interfaces/msg/Time")}  # fmt: skip
    joint, header, clock = kinds.values()
    start_ns = 1_700_000_000_000_000_000
    with Writer(path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection("/joints", joint.__msgtype__, typestore=store)
        for k in range(COUNT):
            stamp_ns = start_ns + round(k * DT_S * 1e9)
            message = joint(
                header=header(
                    stamp=clock(sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9), frame_id="rig"
                ),
                name=["rod"],
                position=np.array([TRUTH["position_m"][k]]),
                velocity=np.array([]),
                effort=np.array([TRUTH["command_v"][k]]),
            )
            # It is written late, by up to 1 ms; the stamp in its head counts.
            raw = bytes(store.serialize_cdr(message, joint.__msgtype__))
            writer.write(connection, stamp_ns + (k * 37) % 1_000_000, raw)
    (found,) = (path / "bag").glob("*.mcap")
    return found


@pytest.mark.slow
def test_messages_of_ros_2_in_mcap_have_the_time_of_their_stamps(tmp_path: Path) -> None:
    path = write_joint_states(tmp_path)
    names = {"command_v": "/joints/effort[0]", "position_m": "/joints/position[0]"}
    hints = Hints({channel: ColumnMap(name) for channel, name in names.items()})
    record = read_record(path, columns=list(names), hints=hints)
    assert record.dt_s == pytest.approx(DT_S, rel=1e-9)
    np.testing.assert_array_equal(record.column("command_v"), TRUTH["command_v"])
    np.testing.assert_array_equal(record.column("position_m"), TRUTH["position_m"])
    np.testing.assert_array_equal(
        read_record(path.parent, columns=list(names), hints=hints).column("command_v"),
        TRUTH["command_v"],
    )

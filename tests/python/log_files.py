# SPDX-License-Identifier: MIT
"""Logs of one known motion in every kind of file, each written by a writer that is not ours."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]

COUNT, DT_S = 2000, 0.002
START = datetime.datetime(2024, 3, 1, 23, 59, 58)


def motion(time_s: FloatArray) -> dict[str, FloatArray]:
    """Return command, position, chamber pressure and supply pressure in SI, below 6 Hz."""
    return {
        "command_v": 4.0 * np.sin(2 * np.pi * 1.1 * time_s) + np.sin(2 * np.pi * 5.3 * time_s),
        "position_m": 0.15 + 0.05 * np.sin(2 * np.pi * 1.1 * time_s - 1.0),
        "pressure_a_pa": 6e6 + 1e6 * np.cos(2 * np.pi * 3.0 * time_s),
        "supply_pressure_pa": 1.6e7 + 1e5 * np.cos(2 * np.pi * 0.5 * time_s),
    }


TIME_S = DT_S * np.arange(COUNT)
TRUTH = motion(TIME_S)
# As the rig's logger has it: name, unit, channel, factor from SI.
LOGGED = (
    ("Valve", "V", "command_v", 1.0),
    ("Stroke", "mm", "position_m", 1e3),
    ("Druck A", "bar", "pressure_a_pa", 1e-5),
    ("Supply pressure", "bar", "supply_pressure_pa", 1e-5),
)


def logged(channel: str) -> FloatArray:
    """Return the numbers that stand in the log for a channel."""
    factor = next(one[3] for one in LOGGED if one[2] == channel)
    return TRUTH[channel] * factor


def write_german_text(path: Path) -> Path:
    """Write text with a header block, semicolons, decimal commas, and a row of units."""
    path = path / "prüfstand.txt"
    lines = ["Prüfstand 7", "Bediener: M. Müller", "Abtastrate: 500 Hz", ""]
    lines.append(";".join(["Zeit", *(name for name, *_ in LOGGED)]))
    lines.append(";".join(["ms", *(unit for _, unit, *_ in LOGGED)]))
    columns = [1e3 * TIME_S, *(logged(one[2]) for one in LOGGED)]
    lines += [
        ";".join(f"{x:.9g}".replace(".", ",") for x in row) for row in zip(*columns, strict=True)
    ]
    path.write_text("\r\n".join(lines) + "\r\n", encoding="cp1252")
    return path


def write_excel(path: Path) -> Path:
    """Write a workbook whose second sheet has the signals, with dates, by openpyxl."""
    import openpyxl

    path = path / "run.xlsx"
    book = openpyxl.Workbook()
    book.active.append(["Remarks", "none"])
    sheet = book.create_sheet("Data")
    sheet.append(["Timestamp", *(f"{name} [{unit}]" for name, unit, *_ in LOGGED)])
    columns = [logged(one[2]) for one in LOGGED]
    for k in range(COUNT):
        moment = START + datetime.timedelta(seconds=float(TIME_S[k]))
        sheet.append([moment, *(float(column[k]) for column in columns)])
    book.save(path)
    return path


def write_parquet(path: Path) -> Path:
    """Write a table with datetimes, as pandas users do, by polars."""
    import polars as pl

    path = path / "run.parquet"
    moments = [START + datetime.timedelta(seconds=float(t)) for t in TIME_S]
    names = {f"{name} ({unit})": logged(channel) for name, unit, channel, _ in LOGGED}
    pl.DataFrame({"timestamp": moments, **names}).write_parquet(path)
    return path


def write_mat_structure(path: Path) -> Path:
    """Write what Simulink logs as "structure with time", by scipy."""
    import scipy.io

    path = path / "run.mat"
    signals = np.zeros((1, len(LOGGED)), dtype=[("values", "O"), ("label", "O")])
    for k, (name, unit, channel, _) in enumerate(LOGGED):
        signals[0, k] = (logged(channel).reshape(-1, 1), f"{name} [{unit}]")
    out = {"time": TIME_S.reshape(-1, 1), "signals": signals, "blockName": "model/Scope"}
    scipy.io.savemat(path, {"ScopeData": out})
    return path


def write_mat_73(path: Path) -> Path:
    """Write a MAT file of version 7.3 with a structure, by hdf5storage."""
    import hdf5storage

    path = path / "run.mat"
    columns = {name.replace(" ", "_") + f"_{unit}": logged(c) for name, unit, c, _ in LOGGED}
    content = {"log": {"time_s": TIME_S, **columns}}
    hdf5storage.write(content, filename=str(path), matlab_compatible=True, oned_as="column")
    return path


def write_timetable(path: Path, version: str = "v7.3") -> Path:
    """Write a timetable of MATLAB, by the writer of mat-io."""
    import matio
    import pandas as pd

    path = path / "run.mat"
    index = pd.to_timedelta(np.round(TIME_S * 1e6).astype(int) * 1000, unit="ns").as_unit("ms")
    columns = {f"{name.replace(' ', '_')}_{unit}": logged(c) for name, unit, c, _ in LOGGED}
    matio.save_to_mat(str(path), {"log": pd.DataFrame(columns, index=index)}, version=version)
    return path


def write_hdf5(path: Path) -> Path:
    """Write groups of datasets with units as attributes, by h5py."""
    import h5py

    path = path / "run.h5"
    with h5py.File(path, "w") as file:
        group = file.create_group("daq/fast")
        group["time"] = TIME_S
        group["time"].attrs["units"] = "s"
        for name, unit, channel, _ in LOGGED:
            group.create_dataset(name, data=logged(channel), compression="gzip")
            group[name].attrs["units"] = unit
        file["config/gains"] = [1.0, 2.0, 3.0]
    return path


def write_mf4(path: Path) -> Path:
    """Write two groups with different rates, by asammdf."""
    import asammdf

    path = path / "run.mf4"
    file = asammdf.MDF(version="4.10")
    file.append(
        [
            asammdf.Signal(samples=logged(c), timestamps=TIME_S, name=name, unit=unit)
            for name, unit, c, _ in LOGGED[:3]
        ]
    )
    name, unit, channel, factor = LOGGED[3]
    slow_s = np.arange(0.0, TIME_S[-1], 0.1)
    values = motion(slow_s)[channel] * factor
    file.append([asammdf.Signal(samples=values, timestamps=slow_s, name=name, unit=unit)])
    file.save(path, compression=2)
    file.close()
    return path


def write_tdms(path: Path) -> Path:
    """Write waveforms, which bring their sampling time, by npTDMS."""
    import nptdms

    path = path / "run.tdms"
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject(
                    "Messung", name, logged(c), {"wf_increment": DT_S, "unit_string": unit}
                )
                for name, unit, c, _ in LOGGED
            ]
        )
    return path


def write_mcap(path: Path) -> Path:
    """Write JSON messages of two topics, by the writer of mcap."""
    import json

    from mcap.writer import CompressionType, Writer

    path = path / "run.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD)
        writer.start()
        schema = writer.register_schema("rig", "jsonschema", b'{"type": "object"}')
        topics = {"/valve": LOGGED[:1], "/cylinder": LOGGED[1:]}
        numbers = {topic: writer.register_channel(topic, "json", schema) for topic in topics}
        for k in range(COUNT):
            stamp = 1_700_000_000_000_000_000 + round(TIME_S[k] * 1e9)
            for topic, signals in topics.items():
                message = {f"{name} [{unit}]": float(logged(c)[k]) for name, unit, c, _ in signals}
                content = json.dumps({"header": {"frame": "rig"}, **message}).encode()
                writer.add_message(numbers[topic], stamp, content, stamp)
        writer.finish()
    return path


def _ros_values(k: int) -> dict[str, float]:
    return {"command": TRUTH["command_v"][k], "position": TRUTH["position_m"][k]}


def _write_ros(writer: Any, store: Any, serialize: Callable[[Any, str], Any]) -> None:
    """Both signals as messages of their own, with the time of the run."""
    kind = store.types["std_msgs/msg/Float64"]
    connections = {
        name: writer.add_connection(f"/rig/{name}", kind.__msgtype__, typestore=store)
        for name in ("command", "position")
    }
    for k in range(COUNT):
        stamp = 1_700_000_000_000_000_000 + round(TIME_S[k] * 1e9)
        for name, value in _ros_values(k).items():
            raw = serialize(kind(data=float(value)), kind.__msgtype__)
            writer.write(connections[name], stamp, bytes(raw))


def write_ros1(path: Path) -> Path:
    """Write a bag of ROS 1 with JointState-like messages, by rosbags."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    path = path / "run.bag"
    store = get_typestore(Stores.ROS1_NOETIC)
    with Writer(path) as writer:
        _write_ros(writer, store, store.serialize_ros1)
    return path


def write_ros2(path: Path) -> Path:
    """Write a bag of ROS 2 (a folder with an SQLite file), by rosbags."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    path = path / "run_bag"
    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(path, version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        _write_ros(writer, store, store.serialize_cdr)
    return path


def write_npz(path: Path) -> Path:
    """Write arrays with dates, by numpy."""
    path = path / "run.npz"
    ticks = np.datetime64("2024-03-01T23:59:58", "ns") + np.round(TIME_S * 1e9).astype(int)
    names: dict[str, Any] = {f"{name}_{unit}": logged(c) for name, unit, c, _ in LOGGED}
    np.savez(path, stamps=ticks, **names)
    return path


WRITERS: dict[str, Callable[[Path], Path]] = {
    "text": write_german_text,
    "excel": write_excel,
    "parquet": write_parquet,
    "npz": write_npz,
    "mat structure": write_mat_structure,
    "mat 7.3": write_mat_73,
    "timetable": write_timetable,
    "hdf5": write_hdf5,
    "mf4": write_mf4,
    "tdms": write_tdms,
    "mcap": write_mcap,
    "ros 1 bag": write_ros1,
    "ros 2 bag": write_ros2,
}

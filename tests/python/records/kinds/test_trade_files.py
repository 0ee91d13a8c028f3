# SPDX-License-Identifier: MIT
"""Files of the trade: LabVIEW LVM, TwinCAT Scope and dSPACE are read, others named.

The layouts are those of files that the programs wrote (lvm_read, pytcs, OpenFresco); the motion is
made: v(k) = 0.75 v(k-1) + 2 u(k-1) mm/s, x(k) = x(k-1) + 0.01 v(k), every 10 ms.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import scipy.io

from ehsid.harness.records import Record, RecordError, read_record
from ehsid.harness.records.kinds import UNREAD

N, DT_S = 120, 0.01
FloatArray = npt.NDArray[np.float64]


def motion() -> tuple[FloatArray, FloatArray]:
    """Return command in V and position in mm, with six decimals."""
    command = np.repeat(np.random.default_rng(7).uniform(-4.0, 4.0, N // 15), 15)
    position, velocity = np.full(N, 50.0), 0.0
    for k in range(1, N):
        velocity = 0.75 * velocity + 2.0 * command[k - 1]
        position[k] = position[k - 1] + DT_S * velocity
    return np.round(command, 6), np.round(position, 6)


VALVE, STROKE = motion()
TIME = DT_S * np.arange(N)


def check(record: Record, rows: Sequence[int] = range(N)) -> None:
    """Check values, units and times against the motion."""
    assert record.time_s is not None
    # Where two rates come together, the command is a difference of integrals: some digits of 1e-16.
    np.testing.assert_allclose(record.column("command_v"), VALVE[rows], rtol=1e-13)
    np.testing.assert_allclose(record.column("position_m"), 1e-3 * STROKE[rows], rtol=1e-13)
    # Times of the clock of a day have five digits before the point: 2e-11 of rounding.
    time_s = np.asarray(record.time_s)
    np.testing.assert_allclose(time_s - time_s[0], TIME[rows] - TIME[rows[0]], atol=1e-10)


def lvm(
    columns: str = "No",
    sep: str = "\t",
    decimal: str = ".",
    cuts: Sequence[int] = (0, N),
    starts: Sequence[float] | None = None,
    stroke_delta: float = DT_S,
    names: str = "Valve,Stroke",
) -> str:
    """Return an LVM file with a segment between each two of `cuts`; they begin at `starts`."""
    word = {"\t": "Tab", ",": "Comma"}[sep]
    wide = columns == "Multi"

    def row(key: str, *cells: str) -> str:
        return sep.join((key, *((cells[0], "", cells[1]) if wide else cells), "")) + "\n"

    text = "".join(
        f"{key}{sep}{value}\n"
        for key, value in (("LabVIEW Measurement", ""), ("Writer_Version", "2"),
        ("Reader_Version", "2"), ("Separator", word), ("Decimal_Separator", decimal),
        ("Multi_Headings", "Yes"), ("X_Columns", columns), ("Time_Pref", "Absolute"),
        ("Date", "2020/01/01"), ("Time", f"09:18:09{decimal}71763"), ("***End_of_Header***", ""))
    )  # fmt: skip
    for number, (first, last) in enumerate(pairwise(cuts)):
        start = DT_S * first if starts is None else starts[number]
        clock = f"09:18:{17.725441 + start:09.6f}".replace(".", decimal)
        text += sep + "\n" + row("Channels", "2", "") + row("Samples", *2 * [str(last - first)])
        text += row("Date", "2020/01/01", "2020/01/01") + row("Time", clock, clock)
        text += row("Y_Unit_Label", "V", "mm") + row("X_Dimension", "Time", "Time")
        text += row("X0", "0.0E+0".replace(".", decimal), "0.0E+0".replace(".", decimal))
        text += row("Delta_X", *(f"{x:.6f}".replace(".", decimal) for x in (DT_S, stroke_delta)))
        text += row("***End_of_Header***", "", "")
        one, two = names.split(",")
        text += sep.join(("X_Value", one, *(["X_Value"] if wide else []), two, "Comment")) + "\n"
        for k in range(first, last):
            x = "" if columns == "No" else f"{DT_S * (k - first):.6f}"
            cells = (x, f"{VALVE[k]:.6f}", *([x] if wide else []), f"{STROKE[k]:.6f}")
            text += sep.join(cells).replace(".", decimal) + "\n"
    return text


@pytest.mark.slow
@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
@pytest.mark.parametrize(("sep", "decimal"), [("\t", "."), ("\t", ","), (",", ".")])
@pytest.mark.parametrize("cuts", [(0, N), (0, 30, 70, N)])
def test_labview_files_are_read(
    tmp_path: Path, columns: str, sep: str, decimal: str, cuts: Sequence[int]
) -> None:
    for name in ("rig.lvm", "rig.txt", "rig.csv"):
        path = tmp_path / name
        path.write_text(lvm(columns, sep, decimal, cuts))
        record = read_record(path)
        check(record)
        assert record.origin is not None
        assert record.origin.kind == "LabVIEW measurement file (LVM)"
        assert any("3 segments are joined" in one for one in record.origin.remarks) == (
            len(cuts) > 2
        )


def test_labview_segments_keep_the_gap_between_them(tmp_path: Path) -> None:
    path = tmp_path / "rig.lvm"
    path.write_text(lvm(cuts=(0, 60, N), starts=(0.0, 5.0)))
    record = read_record(path)
    time_s = np.asarray(record.time_s)
    assert time_s[60] - time_s[0] == pytest.approx(5.0, abs=1e-9)


@pytest.mark.parametrize("columns", ["No", "One", "Multi"])
def test_a_labview_row_that_is_cut_is_left_out(tmp_path: Path, columns: str) -> None:
    path = tmp_path / "rig.lvm"
    path.write_text(lvm(columns).rpartition("\t")[0])
    record = read_record(path)
    check(record, range(N - 1))
    assert record.origin is not None
    assert "the last row is not complete and is left out" in record.origin.remarks


def test_labview_channels_of_one_name_are_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "rig.lvm"
    path.write_text(lvm("Multi", names="Stroke,Stroke"))
    record = read_record(path, columns=["Stroke", "Stroke (2)"])
    np.testing.assert_array_equal(record.column("Stroke (2)"), STROKE)
    assert record.origin is not None
    assert any("is read as 'Stroke (2)'" in one for one in record.origin.remarks)


def test_labview_channels_of_two_rates_in_one_column_of_x(tmp_path: Path) -> None:
    """X is that of the first channel; the second one has its own step."""
    path = tmp_path / "rig.lvm"
    path.write_text(lvm("One", stroke_delta=2 * DT_S))
    record = read_record(path, columns=["command_v", "position_m"])
    expected = np.interp(np.asarray(record.time_s), 2 * TIME, 1e-3 * STROKE)
    # Monotone cubics and straight lines between samples differ by less than a step of the motion.
    np.testing.assert_allclose(record.column("position_m"), expected, atol=5e-4)


@pytest.mark.parametrize(
    ("text", "problem", "row"),
    [
        (lvm(cuts=(0, 60, N), starts=(0.0, 0.2)), "segment 2 begins 0.39 s before the last", 94),
        (lvm().replace("0.010000", "fast"), "no Delta_X of 'Valve'", 23),
        (lvm().replace("X_Value", "Valve"), "the row of names begins with 'Valve'", 22),
        (lvm().replace(f"{VALVE[5]:.6f}", "off", 1), "the text 'off' is not a number", 23),
        (lvm().replace("2020/01/01\t2020/01/01", "soon\tsoon"), "no date and time", None),
        (
            "\tsoon".join(lvm(cuts=(0, 60, N)).rsplit("Date\t2020/01/01\t2020/01/01", 1))
            .replace("\tsoon", "Note")
            .replace(f"Time\t09:18:{17.725441 + 0.6:09.6f}", "Clock"),
            "only some of the segments have a date",
            94,
        ),
        ("LabVIEW Measurement\nSeparator\tTab\n***End_of_Header***\n", "there are no rows", None),
    ],
)
def test_damaged_labview_files_are_refused(
    tmp_path: Path, text: str, problem: str, row: int | None
) -> None:
    path = tmp_path / "rig.lvm"
    path.write_text(text)
    with pytest.raises(RecordError) as caught:
        read_record(path)
    assert problem in caught.value.problem
    assert caught.value.row == row
    assert caught.value.mend


def scope(
    sep: str = "\t", decimal: str = ".", apart: bool = False, eof: bool = True, unit: str = "mm"
) -> str:
    """Return an export of TwinCAT Scope; with `apart` the pressure has a group of half the rate."""
    keys = (
        ("Name", "Valve", "Stroke", "Supply pressure"),
        ("SymbolComment", "", "", ""),
        ("Data-Type", "REAL64", "REAL64", "REAL64"),
        ("SampleTime[ms]", "10", "10", "20" if apart else "10"),
        ("NetID", *3 * ["192.168.0.1.1.1"]),
        ("ScaleFactor", "1", "1", "1"),
        ("Unit", "V (Voltage)", f"{unit} (Length)", "bar (Pressure)"),
        ("Unit ScaleFactor", "1", "1", "1"),
        ("Unit Offset", "0", "0", "0"),
    )
    lines = [f"Name{sep}Scope1", rf"File{sep}C:\x.csv"]
    lines += [f"Starttime of export{sep}132959733843760000", "", ""]
    lines += [sep.join((*row[:3], *([row[0]] if apart else []), row[3])) for row in keys] + [""]
    for k in range(N):
        cells = [f"{10 * k}", f"{VALVE[k]:.6f}", f"{STROKE[k]:.6f}"]
        if not apart:
            cells.append("160.5")
        elif k < N // 2:
            cells += [f"{20 * k}", "160.5"]
        lines.append(sep.join(cells).replace(".", decimal))
    return "\n".join(lines) + ("\nEOF" if eof else "\n")


@pytest.mark.slow
@pytest.mark.parametrize(("sep", "decimal"), [("\t", "."), ("\t", ","), (";", ","), (",", ".")])
@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("eof", [False, True])
def test_exports_of_twincat_scope_are_read(
    tmp_path: Path, sep: str, decimal: str, apart: bool, eof: bool
) -> None:
    for name in ("scope.csv", "scope.txt"):
        path = tmp_path / name
        path.write_text(scope(sep, decimal, apart, eof))
        record = read_record(path)
        assert record.origin is not None
        assert record.origin.kind == "CSV export of TwinCAT Scope"
        check(record)
        np.testing.assert_allclose(record.column("supply_pressure_pa"), 160.5e5, rtol=1e-12)


def test_scaled_channels_of_twincat_scope_are_told(tmp_path: Path) -> None:
    path = tmp_path / "scope.csv"
    path.write_text(scope().replace("ScaleFactor\t1\t1", "ScaleFactor\t1\t2", 1))
    record = read_record(path)
    assert record.origin is not None
    assert any(one.startswith("Stroke: the values are taken") for one in record.origin.remarks)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (scope(",", ","), "the rows have 7 cells, the names of this export of TwinCAT Scope are 4"),
        (scope().split("\n0\t")[0], "no rows of values below its header"),
    ],
)
def test_damaged_exports_of_twincat_scope_are_refused(
    tmp_path: Path, text: str, problem: str
) -> None:
    path = tmp_path / "scope.csv"
    path.write_text(text)
    with pytest.raises(RecordError, match=problem) as caught:
        read_record(path)
    assert "tabs or semicolons" in str(caught.value.mend)


def structures(*elements: dict[str, Any]) -> npt.NDArray[Any]:
    """Return an array of structures, as scipy writes it."""
    made = np.zeros((1, len(elements)), dtype=[(name, object) for name in elements[0]])
    for k, one in enumerate(elements):
        for name, value in one.items():
            made[0, k][name] = value
    return made


@pytest.mark.parametrize("first", [0, 1, None])
@pytest.mark.parametrize("unit", [True, False])
def test_recordings_of_dspace_are_read(tmp_path: Path, first: int | None, unit: bool) -> None:
    """The pressure has an axis of half the rate, in ms; numbers of axes count from `first`."""

    def signal(name: str, in_unit: str, data: FloatArray, axis: int) -> dict[str, Any]:
        made = {"Name": name, "Path": "Model Root", "Type": "Double", "Data": data[None]}
        made |= {"Unit": in_unit} if unit else {}
        return made | ({} if first is None else {"XIndex": np.int32(axis + first)})

    x = structures(
        {"Name": "", "Data": TIME[None], "Unit": "s"},
        {"Name": "", "Data": 20.0 * np.arange(N // 2)[None], "Unit": "ms"},
    )
    y = structures(
        signal('"Model Root"/Valve/Out1', "V", VALVE, 0),
        signal("Stroke", "mm", STROKE, 0),
        signal("Supply pressure", "bar", np.full(N // 2, 160.5), 1),
    )
    path = tmp_path / "rec.mat"
    about = {"General": {"Author": "x"}}
    scipy.io.savemat(path, {"rec_001": {"X": x, "Y": y, "Description": about, "RTProgram": "a"}})
    record = read_record(path)
    check(record)
    np.testing.assert_allclose(record.column("supply_pressure_pa"), 160.5e5, rtol=1e-12)


def test_a_signal_of_dspace_without_axis_is_refused(tmp_path: Path) -> None:
    x = structures({"Name": "", "Data": TIME[None]})
    y = structures({"Name": "Valve", "Data": VALVE[None, :50]})
    path = tmp_path / "rec.mat"
    scipy.io.savemat(path, {"rec": {"X": x, "Y": y}})
    with pytest.raises(RecordError, match="none of the 1 axes X") as caught:
        read_record(path)
    assert caught.value.column == "Valve"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("ending", "name", "export"),
    [(ending, one.name, one.export) for one in UNREAD for ending in one.endings],
)
def test_known_files_that_are_not_read_are_named(
    tmp_path: Path, ending: str, name: str, export: str
) -> None:
    path = tmp_path / f"run.{ending.upper()}"
    path.write_bytes(b"\x01\x02 nothing known")
    with pytest.raises(RecordError) as caught:
        read_record(path)
    assert caught.value.problem == f"this is {name}, which is not read"
    assert caught.value.mend == export


@pytest.mark.parametrize("ending", ["dat", "csv", "txt", "log", "raw", "unknown"])
@pytest.mark.parametrize(
    ("head", "name"),
    [
        (b"|CF,2,1,1;|CK,1,3,1,1;\n", "imc FAMOS"),
        (b"Title: * a\nDate: today\nPlotname: Transient\n", "LTspice"),
        (b"ULog\x01\x12\x35\x01" + bytes(8), "ULog"),
        (b'<?xml version="1.0"?>\n<atfx_file version="1">', "ASAM ODS"),
        (b"LOGG\x90\x00\x00\x00" + bytes(8), "Vector BLF"),
        (b"date Mon Jan 1 10:00:00 2024\nbase hex  timestamps absolute\n", "Vector ASC"),
        (b";$FILEVERSION=1.1\n;$STARTTIME=43474\n", "PEAK TRC"),
        (b"(1436509052.249713) vcan0 044#2A366C2B8BA\n", "candump"),
        (b"\xd4\xc3\xb2\xa1\x02\x00\x04\x00", "network packets"),
    ],
)
def test_the_first_bytes_name_a_file_whatever_its_ending(
    tmp_path: Path, ending: str, head: bytes, name: str
) -> None:
    path = tmp_path / f"run.{ending}"
    path.write_bytes(head)
    with pytest.raises(RecordError, match=name):
        read_record(path)


@pytest.mark.parametrize(
    "text",
    ["LOGGER;time_s;command_v\n", "Title: Rig 7\n\ntime_s;command_v;position_m\n"],
)
def test_text_that_begins_alike_is_still_text(tmp_path: Path, text: str) -> None:
    path = tmp_path / "run.csv"
    rows = "".join(f"{k};{0.01 * k:.2f};{VALVE[k]:.6f}\n" for k in range(N))
    path.write_text(text + rows)
    read_record(path, columns=["command_v"])


def test_a_known_content_under_an_unknown_ending_is_named(tmp_path: Path) -> None:
    path = tmp_path / "run.meas"
    path.write_text(lvm())
    with pytest.raises(RecordError, match=r"rename it to end in \.lvm"):
        read_record(path)

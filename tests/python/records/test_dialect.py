# SPDX-License-Identifier: MIT
"""Layouts of text that loggers write, and what was taken for what in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import openpyxl
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.records import RecordError, read_record, write_record
from ehsid.harness.records.kinds.dialect import sniff

PRESS = ROOT / "examples" / "data" / "mts_press_head.txt"
N = 40
TIME_S, COMMAND_V = 0.01 * np.arange(N), np.round(np.sin(0.3 * np.arange(N)), 4)
POSITION_M = np.round(0.1 + 0.05 * np.cos(0.3 * np.arange(N)), 5)


def table(separator: str, decimal: str = ".") -> str:
    rows = zip(TIME_S, COMMAND_V, POSITION_M, strict=True)
    lines = [separator.join(f"{x:.5f}" for x in row).replace(".", decimal) for row in rows]
    return "\n".join(lines) + "\n"


class Text(NamedTuple):
    label: str
    content: str
    kind: str
    encoding: str = "utf-8"


NAMES = ("time_s", "command_v", "position_m")
TEXTS = [
    Text("semicolons", ";".join(NAMES) + "\n" + table(";"), "text, columns separated by ';'"),
    Text("tabs", "\t".join(NAMES) + "\n" + table("\t"), "text, columns separated by tabs"),
    Text("bars", "|".join(NAMES) + "\n" + table("|"), "text, columns separated by '|'"),
    Text("blanks", " ".join(NAMES) + "\n" + table("   "), "text, columns separated by blanks"),
    Text("decimal comma", ";".join(NAMES) + "\n" + table(";", ","),
         "text, columns separated by ';', decimal comma"),
    Text("decimal comma and blanks", " ".join(NAMES) + "\n" + table("  ", ","),
         "text, columns separated by blanks, decimal comma"),
    Text("quoted decimal commas", ",".join(NAMES) + "\n" + "".join(
        '"' + line.replace(";", '","') + '"\n' for line in table(";", ",").splitlines()),
        "text, columns separated by commas, decimal comma"),
    Text("header block", "Rig: 7\nOperator: A, B\nRate: 100 Hz\n\n" + ";".join(NAMES) + "\n"
         + table(";"), "text, columns separated by ';', names in row 5"),
    Text("blank first row", "\n" + ",".join(NAMES) + "\n" + table(","),
         "text, columns separated by commas, names in row 2"),
    Text("row of units", ",".join(NAMES) + "\ns,V,m\n" + table(","),
         "text, columns separated by commas, a row of units"),
    Text("comment sign", "# " + " ".join(NAMES) + "\n" + table(" "),
         "text, columns separated by blanks"),
    Text("units in names", "time [s];command [V];position [m]\n" + table(";"),
         "text, columns separated by ';'"),
    Text("blanks and units in names", "time (s)  command (V)  position (m)\n" + table("  "),
         "text, columns separated by blanks"),
    Text("UTF-16", ";".join(NAMES) + "\n" + table(";"), "text, columns separated by ';'", "utf-16"),
    Text("Latin-1", "Meßwert\n" + ";".join(NAMES) + "\n" + table(";"),
         "text, columns separated by ';', names in row 2", "latin-1"),
    Text("end of Windows", (";".join(NAMES) + "\n" + table(";")).replace("\n", "\r\n"),
         "text, columns separated by ';'"),
    Text("trailing delimiter", ";".join(NAMES) + ";\n" + table(";").replace("\n", ";\n"),
         "text, columns separated by ';'"),
    Text("delimiter behind the rows only", ";".join(NAMES) + "\n"
         + table(";").replace("\n", ";\n"), "text, columns separated by ';'"),
    Text("delimiter behind the names only", ";".join(NAMES) + ";\n" + table(";"),
         "text, columns separated by ';'"),
    Text("comma behind the rows only", ",".join(NAMES) + "\n"
         + table(",").replace("\n", ",\n"), "text, columns separated by commas"),
    Text("delimiter behind some rows", ";".join(NAMES) + "\n"
         + table(";").replace("0000\n", "0000;\n"), "text, columns separated by ';'"),
]  # fmt: skip


@pytest.mark.parametrize("text", TEXTS, ids=lambda text: text.label)
def test_a_layout_is_found_and_told(tmp_path: Path, text: Text) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(text.content.encode(text.encoding))
    record = read_record(path)
    np.testing.assert_array_equal(record.column("command_v"), COMMAND_V)
    np.testing.assert_array_equal(record.column("position_m"), POSITION_M)
    np.testing.assert_allclose(np.asarray(record.time_s), TIME_S, rtol=0, atol=1e-12)
    assert record.origin is not None
    assert record.origin.kind == text.kind


def test_a_text_without_names_is_read_by_number(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(table(" "))
    with pytest.raises(RecordError, match="column_1, column_2, column_3"):
        read_record(path)
    record = read_record(path, columns=["column_2", "column_3"])
    np.testing.assert_array_equal(record.column("column_3"), POSITION_M)


def test_the_log_of_the_press_is_read_as_it_was_written() -> None:
    record = read_record(PRESS, columns=["CHANNEL2", "CHANNEL0"])
    assert record.dt_s == pytest.approx(1e-3, rel=1e-9)
    assert len(record) == 2000
    assert record.origin is not None
    assert record.origin.kind == "text, columns separated by commas, names in row 7"
    assert record.origin.taken[0].column == "Date/Time"
    # The reader of numpy gives the same values.
    expected = np.genfromtxt(PRESS, delimiter=",", skip_header=7, usecols=(2, 4))
    np.testing.assert_array_equal(record.column("CHANNEL0"), expected[:, 0])
    np.testing.assert_array_equal(record.column("CHANNEL2"), expected[:, 1])


def test_a_record_of_the_schema_is_not_touched(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    path.write_text(",".join(NAMES) + "\n" + table(","))
    record = read_record(path)
    assert record.origin is None
    write_record(record, tmp_path / "again.csv")
    assert read_record(tmp_path / "again.csv").origin is None


@pytest.mark.parametrize(
    ("spoil", "row", "column", "problem"),
    [
        (lambda t: t.replace("0.05000;", "0.05x;", 1), 7, "time_s", "'0.05x' is not a number"),
        (lambda t: t.replace("0.05000;", "0.05000;1;", 1), 7, None, "the row has 4 cells"),
        (lambda t: "only\nwords in\nhere\n", None, None, "no table of numbers was found"),
        (lambda t: "\n \n", None, None, "the file is empty"),
        (lambda t: "\x00" + t, None, None, "binary"),
    ],
)
def test_damage_is_named_and_not_mended(
    tmp_path: Path, spoil: Callable[[str], str], row: int | None, column: str | None, problem: str
) -> None:
    path = tmp_path / "log.txt"
    path.write_text(spoil(";".join(NAMES) + "\n" + table(";")))
    with pytest.raises(RecordError) as caught:
        read_record(path)
    assert problem in caught.value.problem
    assert caught.value.row == row
    assert caught.value.column == column
    assert caught.value.mend


def test_a_last_row_that_the_logger_did_not_finish_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text((";".join(NAMES) + "\n" + table(";"))[:-12])
    record = read_record(path)
    assert len(record) == N - 1
    assert record.origin is not None
    assert "the last row is not complete and is left out" in record.origin.remarks


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize(
    ("names", "remedy"),
    [
        ("Time [s],Valve,Stroke [m],Swing", "remove the name that has no values"),
        ("Time [s],Valve,Stroke [m],Swing,Boom", "remove the name that has no values"),
        ("time_s,command_v,position_m,force_n", "remove the name that has no values"),
        ("Valve,Stroke [m]", "add the name that is missing"),
        ("time_s,command_v", "add the name that is missing"),
    ],
)
def test_names_and_cells_that_differ_are_counted(
    tmp_path: Path, separator: str, names: str, remedy: str
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(names.replace(",", separator) + "\n" + table(separator))
    with pytest.raises(RecordError) as caught:
        read_record(path)
    count = names.count(",") + 1
    assert caught.value.problem == f"the header has {count} names, the rows have 3 cells"
    assert caught.value.row == 1
    assert caught.value.mend is not None
    assert remedy in caught.value.mend


@pytest.mark.parametrize("name", ["time_s", "position_m"])
def test_one_column_with_a_decimal_comma_is_read_and_told(tmp_path: Path, name: str) -> None:
    at = NAMES.index(name)
    lines = [line.split(";") for line in table(";").splitlines()]
    rows = [[*r[:at], r[at].replace(".", ","), *r[at + 1 :]] for r in lines]
    path = tmp_path / "log.csv"
    path.write_text(";".join(NAMES) + "\n" + "\n".join(map(";".join, rows)) + "\n")
    record = read_record(path)
    np.testing.assert_allclose(np.asarray(record.time_s), TIME_S, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(record.column("position_m"), POSITION_M)
    assert record.origin is not None
    assert f"'{name}' has a decimal comma, unlike other columns" in record.origin.remarks


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["-5.7m", "3k", "12.5u", "12.5µ", "1.5Meg", "50.2 mm", "3 V"])
@pytest.mark.parametrize("column", [1, 2])
@pytest.mark.parametrize("every", [True, False])
@pytest.mark.parametrize("separator", [",", ";"])
def test_numbers_with_prefixes_are_named_with_their_row(
    tmp_path: Path, cell: str, column: int, every: bool, separator: str
) -> None:
    lines = [line.split(separator) for line in table(separator).splitlines()]
    for k in range(0 if every else 7, N if every else 8):
        lines[k][column] = cell
    path = tmp_path / "log.csv"
    path.write_text(separator.join(NAMES) + "\n" + "\n".join(map(separator.join, lines)) + "\n")
    with pytest.raises(RecordError) as caught:
        read_record(path, columns=["command_v", "position_m"])
    assert caught.value.problem == f"the text '{cell}' is not a number"
    assert (caught.value.row, caught.value.column) == (2 if every else 9, NAMES[column])
    assert caught.value.mend is not None
    assert "export the column as plain numbers" in caught.value.mend


@pytest.mark.parametrize("header", ["t u y z", "t u"])
def test_a_row_above_that_is_no_names_is_told(tmp_path: Path, header: str) -> None:
    path = tmp_path / "log.txt"
    path.write_text(header + "\n" + table(" "))
    record = read_record(path, columns=["column_2"])
    assert record.origin is not None
    told = f"'{header}' above the data does not name its 3 columns: they are numbered"
    assert told in record.origin.remarks


def pressure_log(path: Path, cells: list[str], time: str = "0,{:03d}") -> FloatArray:
    rows = [f"{time.format(k)};{k % 3},5;{cell}\n" for k, cell in enumerate(cells)]
    path.write_text("t [s];Valve [V];pA [kPa]\n" + "".join(rows))
    return read_record(path).column("pressure_a_pa")


@pytest.mark.parametrize(
    ("cells", "kpa"),
    [
        (["998", "999", "1.000", "1.001"], [998, 999, 1000, 1001]),
        (["999,5", "1.000,0", "1.000,5"], [999.5, 1000, 1000.5]),
        (["1.000,5", "12.345,25", "2.000,0"], [1000.5, 12345.25, 2000]),
        (["1.234.567", "1.234.568", "1.234.569"], [1234567, 1234568, 1234569]),
        (["0.999", "1.000", "1.001"], [0.999, 1.0, 1.001]),  # this column has a decimal point
        (["1,000", "0,999", "1,001"], [1.0, 0.999, 1.001]),
    ],
)
def test_marks_between_thousands_are_told_from_decimal_ones(
    tmp_path: Path, cells: list[str], kpa: list[float]
) -> None:
    found = pressure_log(tmp_path / "log.txt", cells * 10)
    np.testing.assert_allclose(found, 1e3 * np.array(kpa * 10), rtol=1e-12)


def test_thousands_without_any_decimal_mark(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    for mark in ".,":
        rows = [f"{k};{k % 3};{990 + k:,}".replace(",", mark) for k in range(40)]
        path.write_text("t [ms];Valve [V];pA [kPa]\n" + "\n".join(rows) + "\n")
        record = read_record(path)
        np.testing.assert_allclose(record.column("pressure_a_pa"), 1e3 * (990 + np.arange(40)))
        assert record.origin is not None
        assert any("between thousands" in text for text in record.origin.remarks)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        (["1.234", "1.235", "1.236"], "row 2, column 'pA .kPa.': '1.234' may be 1234 or 1.234"),
        (["1,5", "1.5", "2,5"], "row 3, column 'pA .kPa.': the text '1.5' is not a number"),
    ],
)
def test_marks_that_may_mean_two_things_are_refused(
    tmp_path: Path, cells: list[str], message: str
) -> None:
    with pytest.raises(RecordError, match=message):
        pressure_log(tmp_path / "log.txt", cells * 10)


def test_a_thousand_in_a_text_cell_of_a_spreadsheet(tmp_path: Path) -> None:
    book = openpyxl.Workbook()
    sheet = book.worksheets[0]
    sheet.append(["t [s]", "Valve [V]", "pA [kPa]"])
    for k in range(20):
        sheet.append([f"0,{k:02d}", f"{k % 3},5", f"{990 + k:,}".replace(",", ".")])
    book.save(tmp_path / "log.xlsx")
    found = read_record(tmp_path / "log.xlsx").column("pressure_a_pa")
    np.testing.assert_allclose(found, 1e3 * (990 + np.arange(20)))


RESULTS = ["Summe;1.0;2.0", ";;\nMean;1.0;2.0\nMin;0.0;1.0\nMax:;2.0;3.0", ";1.0;2.0;avg."]


@pytest.mark.parametrize("results", RESULTS)
@pytest.mark.parametrize("delimiter", ";,")
def test_sums_and_means_below_the_samples_are_left_out(
    tmp_path: Path, results: str, delimiter: str
) -> None:
    head, tail = (";note", ";") if "avg" in results else ("", "")
    lines = [";".join(NAMES) + head, *(f"{line}{tail}" for line in table(";").splitlines())]
    path = tmp_path / "log.csv"
    path.write_text("\n".join([*lines, results, ""]).replace(";", delimiter))
    record = read_record(path)
    np.testing.assert_array_equal(record.column("position_m"), POSITION_M)
    assert record.origin is not None
    assert any("no sample" in text for text in record.origin.remarks)


def test_a_word_in_every_row_is_no_result(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    rows = [f"{line};max" for line in table(";").splitlines()]
    path.write_text("\n".join([";".join(NAMES) + ";mode", *rows, ""]))
    assert len(read_record(path)) == N


@pytest.mark.parametrize("keep", [1, 3])
def test_a_log_cut_inside_its_last_number_loses_this_row(tmp_path: Path, keep: int) -> None:
    path = tmp_path / "log.txt"
    rows = [f"{0.01 * k:.2f};1.00;{0.1 + 0.001 * k:.5f}" for k in range(90)]
    whole = "\n".join([";".join(NAMES), *rows])
    path.write_text(whole[:-keep])
    record = read_record(path)
    assert len(record) == 89
    assert record.origin is not None
    assert "the last row is not complete and is left out" in record.origin.remarks
    path.write_text(whole)
    assert len(read_record(path)) == 90


@pytest.mark.parametrize("between", [";", ";;"])
def test_tables_side_by_side_keep_their_own_times(tmp_path: Path, between: str) -> None:
    path = tmp_path / "log.txt"
    second = "Time [s]" if between == ";" else "Zeit [s]"
    rows = [f"{0.01 * k:.2f};{k % 5}{between}" for k in range(100)]
    rows = [
        row + (f"{0.3 + 0.02 * k:.2f};{100 + k}" if k < 30 else ";") for k, row in enumerate(rows)
    ]
    path.write_text("\n".join([f"Time [s];Valve [V]{between}{second};Stroke [mm]", *rows, ""]))
    record = read_record(path, required=NAMES)
    assert len(record) == 30
    # The stroke is a line through 100 mm at 0.3 s, with 1 mm in 0.02 s.
    expected = 0.1 + 1e-3 * (np.asarray(record.time_s) - 0.3) / 0.02
    np.testing.assert_allclose(record.column("position_m"), expected, atol=1e-12)


def test_a_stray_end_of_line_with_a_ragged_row_is_named(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_bytes((";".join(NAMES) + "\n" + table(";") + '0.6;\r"1;0.3";3\r;1;1\n').encode())
    with pytest.raises(RecordError, match=r"row 42: the row (cannot be divided|has \d cells)"):
        read_record(path)


@given(st.lists(st.text(max_size=60), max_size=30))
def test_any_lines_are_a_layout_or_none(lines: list[str]) -> None:
    found = sniff(lines, whole=True)
    if found is not None:
        assert 1 <= found.data_row <= len(lines)
        assert found.names_row < found.data_row
        assert found.columns >= 2

# SPDX-License-Identifier: MIT
"""Every malformed record gets a message that names file, row and column, and how to mend it."""

from __future__ import annotations

import gzip
import pickle
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
import pytest
import scipy.io
import scipy.sparse
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.records import RecordError, make_record, read_record, write_record
from ehsid.harness.records.kinds import opened
from ehsid.harness.records.log import Log

GOOD = "time_s,command_v,position_m\n" + "".join(f"{k / 10},{k},0.{k}\n" for k in range(6))


class Case(NamedTuple):
    """A file that must be refused, and the parts of the expected message."""

    label: str
    file: str
    content: bytes
    row: int | None
    column: str | None
    problem: str
    mend: str


def csv(
    label: str, text: str, row: int | None, column: str | None, problem: str, mend: str
) -> Case:
    return Case(label, "bad.csv", text.encode(), row, column, problem, mend)


CSV_CASES = [
    csv("nearest name", GOOD.replace("command_v", "comand_V"), None, "command_v",
        "no column 'command_v'", "rename 'comand_V' to 'command_v'"),
    csv("no near name", "time_s,x\n0,1\n1,2\n", None, "command_v",
        "the columns are: time_s, x", "add the column"),
    csv("text", GOOD.replace("0.3,3,", "0.3,abc,"), 5, "command_v", "'abc' is not a number",
        "correct the cell"),
    csv("late text", GOOD.replace("0.5,5,", "0.5,five,"), 7, "command_v", "'five'", "correct"),
    csv("underscore", GOOD.replace("0.3,3,", "0.3,1_000,"), 5, "command_v", "'1_000'", "correct"),
    csv("quoted decimal comma", GOOD.replace("0.3,3,", '0.3,"3,5",'), 5, "command_v", "'3,5'",
        "decimal point"),
    csv("empty cells", GOOD.replace("0.2,2,", "0.2,,").replace("0.3,3,", "0.3, ,"), 4, "command_v",
        "rows 4 to 5 are empty or NaN (2 rows)", "fill in"),
    csv("NaN run", GOOD.replace("0.2,2,", "0.2,nan,").replace("0.3,3,", "0.3,NaN,"), 4,
        "command_v", "rows 4 to 5 are empty or NaN (2 rows)", "remove these rows"),
    csv("NaN to the end", GOOD.replace("0.5,5,0.5", "0.5,5,nan"), 7, "position_m",
        "row 7 is empty or NaN", "remove"),
    csv("NaN twice", GOOD.replace(",1,", ",nan,").replace(",4,", ",nan,"), 3, "command_v",
        "and 1 more row later", "remove"),
    csv("infinite", GOOD.replace("0.2,2,", "0.2,-inf,"), 4, "command_v", "row 4 is infinite",
        "remove"),
    csv("overflow", GOOD.replace("0.2,2,", "0.2,1e999,"), 4, "command_v", "infinite", "remove"),
    csv("repeated time", GOOD.replace("0.3,3", "0.2,3"), 5, "time_s",
        "0.2 s is the same as in the row before", "repeated rows"),
    csv("reversed time", GOOD.replace("0.3,3", "0.15,3"), 5, "time_s",
        "time runs backwards, from 0.2 s to 0.15 s", "sort"),
    csv("time descends", "time_s,command_v\n2,1\n1,1\n0,1\n", 3, "time_s", "(2 such rows)",
        "sort"),
    csv("empty", "", None, None, "the file is empty", "export"),
    csv("white space only", "\n  \n", None, None, "the file is empty", "export"),
    csv("header only", "time_s,command_v\n", 1, None, "a header but no data", "with its data"),
    csv("one row", "time_s,command_v\n0,1\n", None, None, "one sample only", "export"),
    csv("no header", "0,1,2\n1,2,3\n", None, "command_v", "column_1, column_2, column_3",
        "--map command_v="),
    csv("decimal comma between commas", "time_s,command_v\n0,0,1,5\n0,1,1,6\n", 1, None,
        "the header has 2 names, the rows have 4 cells", "decimal comma"),
    csv("repeated name", "time_s,command_v,command_v\n0,1,2\n1,2,3\n", 1, "command_v",
        "occurs 2 times", "rename"),
    csv("name missing", "time_s,command_v,\n0,1,\n1,2,\n", 1, None, "column 3 of 3 has no name",
        "surplus comma"),
    csv("row too long", GOOD.replace("0.3,3,0.3", "0.3,3,0.3,7"), 5, None, "the row has 4 cells",
        "correct the row"),
    csv("row too short", GOOD.replace("0.3,3,0.3", "0.3,3"), 5, None, "the row has 2 cells",
        "correct the row"),
    csv("cut short", GOOD[:-7], 7, None, "the row has 1 cell", "cut short"),
    csv("blank row", GOOD.replace("0.3,3,0.3", ""), 5, None, "the row is blank", "remove"),
    csv("open quote", GOOD.replace("0.3,3,", '0.3,"3,'), 5, None, "cell", "quotation mark"),
    csv("stray return in the header", GOOD.replace("time_s", "time\r_s"), 1, None,
        "cannot be divided into cells", "mixed line ends"),
    csv("endless cell", GOOD.replace("0.3,3,", "0.3," + "x" * 200_000 + ","), 5, None,
        "cannot be divided into cells", "control characters"),
    csv("Arabic digits", GOOD.replace("0.3,3,", "0.3,\u0663,"), 5, "command_v", "'\u0663'",
        "digits 0 to 9"),
    csv("cut within a number", "time_s,command_v\n" + "".join(
        f"{k / 10},{k / 7:.4f}\n" for k in range(60))[:-3], 61, None,
        "the file ends within the number '8.42'", "export the file again"),
    csv("date", GOOD.replace("0.3,3", "2024-01-01,3"), 5, "time_s", "'2024-01-01'", "correct"),
    Case("UTF-16 without a mark", "bad.csv", GOOD.encode("utf-16-le"), 1, None, "zero bytes",
         "UTF-8"),
    Case("Latin-1 cell", "bad.csv", "time_s,command_v\n0,1\n1,\xb5\n".encode("latin-1"), 3,
         "command_v", "'\xb5' is not a number", "correct"),
    Case("binary", "bad.csv", b"\x89PNG\r\n\x1a\n" + bytes(range(256)), 3, None, "binary", "UTF-8"),
    Case("gzip named csv", "bad.csv", gzip.compress(GOOD.encode()), None, None, "gzip",
         "rename it to end in .csv.gz"),
    Case("csv named gzip", "bad.csv.gz", GOOD.encode(), None, None, "not gzip", "rename"),
    Case("empty gzip", "bad.csv.gz", b"", None, None, "the file is empty", "export"),
    Case("gzip of nothing", "bad.csv.gz", gzip.compress(b""), None, None, "the file is empty",
         "export"),
    Case("gzip cut short", "bad.csv.gz", gzip.compress(GOOD.encode())[:-9], None, None,
         "cut short", "compress"),
    Case("gzip damaged", "bad.csv.gz", gzip.compress(GOOD.encode())[:-8] + b"12345678", None, None,
         "damaged", "compress"),
    Case("fault inside gzip", "bad.csv.gz", gzip.compress(GOOD.replace(",3,", ",x,").encode()), 5,
         "command_v", "'x' is not a number", "correct"),
    Case("unknown extension", "bad.docx", b"x", None, None, "'.docx' is not known", "convert"),
    Case("no extension", "bad", b"x", None, None, "no extension", "convert"),
    Case("junk parquet", "bad.parquet", b"junk" * 50, None, None, "not a readable Parquet",
         "export"),
    Case("junk mat", "bad.mat", b"junk" * 50, None, None, "not a readable MAT", "export"),
    Case("junk npz", "bad.npz", b"junk" * 50, None, None, "not an NPZ file", "export"),
    Case("empty npz", "bad.npz", b"", None, None, "the file is empty", "export"),
    Case("MAT 7.3", "bad.mat", b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(400), None,
         None, "version 7.3", "'-v7'"),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("case", CSV_CASES, ids=lambda case: case.label)
def test_message_of_a_malformed_file(tmp_path: Path, case: Case) -> None:
    path = tmp_path / case.file
    path.write_bytes(case.content)
    with pytest.raises(RecordError) as caught:
        read_record(path)
    error = caught.value
    assert error.file == str(path)
    assert error.row == case.row
    assert error.column == case.column
    assert case.problem in error.problem
    assert case.mend in (error.mend or "")
    assert error.expected
    message = str(error)
    assert "\n" not in message
    assert message.startswith(str(path))
    if case.row is not None:
        assert f"row {case.row}" in message
    if case.column is not None:
        assert f"'{case.column}'" in message


def good_arrays() -> dict[str, object]:
    return {"time_s": np.arange(5.0), "command_v": np.ones(5), "position_m": np.ones(5)}


ARRAY_CASES = [
    ("unequal lengths", {"position_m": np.ones(4)}, None, "position_m", "it has 4 samples"),
    ("two-dimensional", {"position_m": np.ones((5, 2))}, None, "position_m", "5 x 2"),
    ("NaN", {"position_m": np.array([0, np.nan, np.nan, 1, 1.0])}, 2, "position_m", "rows 2 to 3"),
    ("infinite", {"command_v": np.array([0, 0, 0, np.inf, 1])}, 4, "command_v",
     "row 4 is infinite"),
    ("complex", {"command_v": np.ones(5) * 1j}, None, "command_v", "complex128"),
    ("text", {"command_v": np.array(list("abcde"))}, None, "command_v", "of type str"),
    ("reversed", {"time_s": np.arange(5.0)[::-1].copy()}, 2, "time_s", "backwards"),
    ("no samples", {name: np.zeros(0) for name in good_arrays()}, None, None, "no samples"),
]  # fmt: skip


def test_a_last_line_without_an_end_is_read_where_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "r.csv"
    numbers = ["0.25", *(f"{k / 8}" for k in range(60)), "7.5"]  # of no fixed form
    path.write_text("u,y\n" + "\n".join(f"1,{number}" for number in numbers))
    assert read_record(path, columns=("u", "y")).column("y")[-1] == 7.5
    path.write_text("u,y\n" + "\n".join("1,0.125" for _ in range(60)))
    assert len(read_record(path, columns=("u", "y"))) == 60


def test_masked_values_are_refused() -> None:
    values = np.ma.masked_greater(np.arange(6.0), 3.0)
    with pytest.raises(RecordError, match="column 'u': 2 values are masked") as raised:
        make_record({"u": values})
    assert "fill in" in str(raised.value)
    assert len(make_record({"u": np.ma.masked_array(np.arange(6.0))})) == 6


@pytest.mark.parametrize("ending", ["mat", "npz"])
@pytest.mark.parametrize(
    ("change", "row", "column", "problem"),
    [case[1:] for case in ARRAY_CASES],
    ids=[case[0] for case in ARRAY_CASES],
)
def test_message_of_malformed_arrays(
    tmp_path: Path,
    ending: str,
    change: dict[str, object],
    row: int | None,
    column: str | None,
    problem: str,
) -> None:
    path = tmp_path / f"bad.{ending}"
    content = {**good_arrays(), **change}
    if ending == "mat":
        scipy.io.savemat(path, content)
    else:
        np.savez(path, **content)  # type: ignore[arg-type]
    with pytest.raises(RecordError) as caught:
        read_record(path)
    assert problem in caught.value.problem
    assert caught.value.row == row
    if column is not None:
        assert caught.value.column == column
    assert caught.value.mend


def test_mat_structures_and_sparse_matrices(tmp_path: Path) -> None:
    path = tmp_path / "bad.mat"
    scipy.io.savemat(path, {**good_arrays(), "rig": {"mass_kg": 120.0}})
    # A structure beside the signals is a set of settings.
    assert set(read_record(path).columns) == set(good_arrays()) - {"time_s"}
    assert len(read_record(path, columns=("command_v",))) == 5
    with pytest.raises(RecordError, match="column 'rig'"):
        read_record(path, columns=("rig",))
    scipy.io.savemat(path, {**good_arrays(), "command_v": scipy.sparse.csc_array(np.eye(5))})
    with pytest.raises(RecordError, match="5 x 5"):
        read_record(path)


def test_npz_of_objects_and_a_plain_array(tmp_path: Path) -> None:
    path = tmp_path / "bad.npz"
    np.savez(path, **{**good_arrays(), "note": np.array([{}], dtype=object)})  # type: ignore[arg-type]
    with pytest.raises(RecordError, match="column 'note'"):
        read_record(path)
    with path.open("wb") as file:
        np.save(file, np.ones(5))
    with pytest.raises(RecordError, match=r"numpy\.savez"):
        read_record(path)


def test_npz_and_mat_cut_short(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    record = make_record({"time_s": np.arange(500.0), "command_v": rng.normal(size=500)})
    for ending in ("npz", "mat", "parquet"):
        path = tmp_path / f"cut.{ending}"
        write_record(record, path)
        path.write_bytes(path.read_bytes()[:-200])
        with pytest.raises(RecordError):
            read_record(path)


def test_parquet_types_and_nulls(tmp_path: Path) -> None:
    path = tmp_path / "bad.parquet"
    pl.DataFrame({"time_s": [0, 1, 2], "command_v": ["1", "2", "3"]}).write_parquet(path)
    with pytest.raises(RecordError, match="'command_v': the values are of type String"):
        read_record(path)
    pl.DataFrame({"time_s": [0, 1, 2], "command_v": [1, None, 3]}).write_parquet(path)
    with pytest.raises(RecordError, match="row 2 is empty or NaN"):
        read_record(path)


def test_a_directory_and_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="this is a directory"):
        read_record(tmp_path)
    with pytest.raises(RecordError, match=r"gone\.csv: there is no such file"):
        read_record(tmp_path / "gone.csv")


def test_surplus_cells_are_found_even_when_few_columns_are_read(tmp_path: Path) -> None:
    # "0,5" with a decimal comma would otherwise shift the columns without a message.
    path = tmp_path / "bad.csv"
    path.write_text("u,y\n0,5,1,5\n0,6,1,6\n")
    with pytest.raises(RecordError, match="row 1: the header has 2 names, the rows have 4"):
        read_record(path, columns=("u",))


def test_make_record_refuses_what_reading_refuses() -> None:
    with pytest.raises(RecordError, match="no columns"):
        make_record({})
    with pytest.raises(RecordError, match="no column beside 'time_s'"):
        make_record({"time_s": [0.0, 1.0]})
    with pytest.raises(RecordError, match="a single number"):
        make_record({"u": 3.0})


def test_writing_is_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = make_record({"u": [1.0, 2.0], "a b": [1.0, 2.0]})
    target = tmp_path / "r.csv"
    target.write_text("old")

    def refuse(self: Path, other: Path) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Path, "replace", refuse)
        with pytest.raises(RecordError, match="No space left"):
            write_record(record, target)
    assert target.read_text() == "old"
    assert list(tmp_path.iterdir()) == [target]

    with pytest.raises(RecordError, match="MATLAB does not allow"):
        write_record(record, tmp_path / "r.mat")
    with pytest.raises(RecordError, match="folder that exists"):
        write_record(record, tmp_path / "none" / "r.csv")
    with pytest.raises(RecordError, match="not known"):
        write_record(record, tmp_path / "r.txt")
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.slow
@given(data=st.data())
def test_a_damaged_file_raises_no_other_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """A file with replaced, removed or added bytes gives a record or a RecordError."""
    ending = data.draw(st.sampled_from(["csv", "csv.gz", "parquet", "mat", "npz"]))
    path = tmp_path_factory.getbasetemp() / f"fuzz.{ending}"
    write_record(make_record({"time_s": np.arange(8.0), "command_v": np.arange(8.0)}), path)
    content = bytearray(path.read_bytes())
    start = data.draw(st.integers(0, len(content) - 1))
    stop = data.draw(st.integers(start, min(start + 40, len(content))))
    content[start:stop] = data.draw(st.binary(max_size=12))
    path.write_bytes(content)
    try:
        record = read_record(path)
    except RecordError:
        return
    assert np.isfinite(record.column("command_v")).all()


def test_an_error_survives_pickling() -> None:
    error = RecordError("a.csv", "it is empty", row=3, column="y", expected="a number", mend="x")
    unpickled = pickle.loads(pickle.dumps(error))
    assert str(unpickled) == str(error)
    assert vars(unpickled) == vars(error)


def test_a_row_of_a_text_log_that_cannot_be_divided_says_what_a_log_is(tmp_path: Path) -> None:
    """A log with semicolons is not asked for commas."""
    path = tmp_path / "log.txt"
    rows = "".join(f'{k},5;"1,5";{k}\n' for k in range(40))
    path.write_text(f'Zeit [s];Ventil [V];Weg [mm]\n{rows}40,5;"1,5"x;1\n', encoding="utf-8")
    with pytest.raises(RecordError) as caught, opened(path) as (content, _, _):
        assert isinstance(content, Log)
    assert caught.value.row == 42
    assert "cannot be divided into cells" in str(caught.value)
    assert "Expected: a table of numbers as text" in str(caught.value)

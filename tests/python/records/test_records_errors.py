# SPDX-License-Identifier: MIT
"""A malformed record gets a message that names file, row and column, and how to mend it.

bad_input/records.py has the usual ones, with their whole messages.
"""

from __future__ import annotations

import gzip
import pickle
from pathlib import Path
from typing import NamedTuple

import numpy as np
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
    csv("empty cells", GOOD.replace("0.2,2,", "0.2,,").replace("0.3,3,", "0.3, ,"), 4, "command_v",
        "rows 4 to 5 are empty or NaN (2 rows)", "fill in"),
    csv("time descends", "time_s,command_v\n2,1\n1,1\n0,1\n", 3, "time_s", "(2 such rows)",
        "sort"),
    csv("cut short", GOOD[:-7], 7, None, "the row has 1 cell", "cut short"),
    csv("stray return in the header", GOOD.replace("time_s", "time\r_s"), 1, None,
        "cannot be divided into cells", "mixed line ends"),
    csv("endless cell", GOOD.replace("0.3,3,", "0.3," + "x" * 200_000 + ","), 5, None,
        "cannot be divided into cells", "control characters"),
    Case("Latin-1 cell", "bad.csv", "time_s,command_v\n0,1\n1,\xb5\n".encode("latin-1"), 3,
         "command_v", "'\xb5' is not a number", "correct"),
    Case("gzip of nothing", "bad.csv.gz", gzip.compress(b""), None, None, "the file is empty",
         "export"),
    Case("gzip damaged", "bad.csv.gz", gzip.compress(GOOD.encode())[:-8] + b"12345678", None, None,
         "damaged", "compress"),
    Case("fault inside gzip", "bad.csv.gz", gzip.compress(GOOD.replace(",3,", ",x,").encode()), 5,
         "command_v", "'x' is not a number", "correct"),
    Case("MAT 7.3", "bad.mat", b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(400), None,
         None, "version 7.3", "copy or save it again"),
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


def test_surplus_cells_are_found_even_when_few_columns_are_read(tmp_path: Path) -> None:
    # "0,5" with a decimal comma would otherwise shift the columns without a message.
    path = tmp_path / "bad.csv"
    path.write_text("u,y\n0,5,1,5\n0,6,1,6\n")
    with pytest.raises(RecordError, match="row 1: the header has 2 names, the rows have 4"):
        read_record(path, columns=("u",))


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

# SPDX-License-Identifier: MIT
"""Files that MATLAB itself has written, versions 4 to 7.4: those with which scipy tests its reader.

They stand beside the installed scipy; some of its packages leave them out.
"""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io.matlab

from ehsid.harness.records import RecordError, read_record
from ehsid.harness.records.reading import open_unread

DATA = Path(scipy.io.matlab.__file__).parent / "tests" / "data"
WRITTEN = sorted(DATA.glob("*.mat"))
needs_files = pytest.mark.skipif(not WRITTEN, reason="this scipy has no test data")
THETA = np.pi / 4.0 * np.arange(9)


def files(start: str) -> list[Path]:
    return [path for path in WRITTEN if path.name.startswith(start)]


@needs_files
def test_all_versions_are_there() -> None:
    versions = {path.stem.split("_")[1] for path in files("testdouble_")}
    assert {"4.2c", "6.1", "6.5.1", "7.1", "7.4"} <= versions


@pytest.mark.parametrize("path", [*files("testdouble_"), *files("testhdf5_")], ids=lambda p: p.stem)
def test_a_vector_of_numbers_is_a_column(path: Path) -> None:
    record = read_record(path, required=())
    np.testing.assert_allclose(record.column("testdouble"), THETA, rtol=1e-12)


@pytest.mark.parametrize("path", files("testmatrix_"), ids=lambda p: p.stem)
def test_the_signals_of_a_matrix_are_columns(path: Path) -> None:
    record = read_record(path, required=())
    rows = [record.column(f"testmatrix[{k}]") for k in (1, 2, 3)]
    np.testing.assert_array_equal(rows[0], [1.0, 2.0, 3.0, 4.0, 5.0])
    np.testing.assert_array_equal([row[1:] for row in rows[1:]], np.zeros((2, 4)))


@pytest.mark.parametrize("path", files("teststruct_"), ids=lambda p: p.stem)
def test_the_fields_of_a_structure_are_columns(path: Path) -> None:
    record = read_record(path, required=())
    assert record.origin is not None
    assert record.origin.kind == "MAT file"
    found = record.column("teststruct.doublefield")
    np.testing.assert_allclose(found, [np.sqrt(2.0), np.e, np.pi], rtol=1e-12)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("testsparse_", "the values are a sparse matrix, 3 x 5"),
        ("testcomplex_", "the values are of type complex128"),
        ("test3dmatrix_", "the values are not one column: 2 x 3 x 4"),
    ],
)
@needs_files
def test_what_is_no_signal_is_refused_by_its_reason(name: str, words: str) -> None:
    for path in files(name):
        with pytest.raises(RecordError) as caught:
            read_record(path, required=())
        assert words in str(caught.value)


@pytest.mark.parametrize("path", WRITTEN, ids=lambda p: p.stem)
def test_every_file_is_read_or_refused_in_words(path: Path) -> None:
    """Whole, damaged or of another kind: nothing else than a RecordError comes out."""
    try:
        log = open_unread(path)
    except RecordError:
        return
    assert all(one.read().size == one.size for one in log.series)


def test_cells_and_arrays_of_structures_of_version_7_3(tmp_path: Path) -> None:
    """As MATLAB has them: references into a group of their own. Sparse matrices are no signals."""
    path = tmp_path / "run.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        kept = file.create_group("#refs#")
        signals = {name: THETA + k for k, name in enumerate(("a", "b", "time_s"))}
        for name, values in signals.items():
            kept[name] = values[np.newaxis]
        cell = file.create_dataset("c", (1, 2), h5py.ref_dtype)
        cell[0, 0], cell[0, 1] = kept["a"].ref, kept["b"].ref
        cell.attrs["MATLAB_class"] = np.bytes_("cell")
        runs = file.create_group("runs")
        field = runs.create_dataset("time_s", (1, 1), h5py.ref_dtype)
        field[0, 0] = kept["time_s"].ref
        itself = kept.create_dataset("loop", (1, 1), h5py.ref_dtype)
        itself[0, 0] = itself.ref
        file.create_dataset("loop", (1, 1), h5py.ref_dtype)[0, 0] = itself.ref
        sparse = file.create_group("s")
        sparse.attrs["MATLAB_sparse"] = 9
        sparse["data"] = THETA
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file".ljust(128))
    log = open_unread(path)
    found = {one.name: one.read() for one in log.series}
    assert sorted(found) == ["c{1}", "c{2}", "runs.time_s"]
    np.testing.assert_array_equal(found["c{1}"], signals["a"])
    np.testing.assert_array_equal(found["c{2}"], signals["b"])
    np.testing.assert_array_equal(found["runs.time_s"], signals["time_s"])

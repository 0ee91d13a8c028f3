# SPDX-License-Identifier: MIT
"""Damaged logs and logs that are made to do harm end in a message; so does a missing package."""

from __future__ import annotations

import builtins
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from log_files import WRITERS

from ehsid.harness.records import RecordError, read_record
from ehsid.harness.records.errors import bounded_memory
from ehsid.harness.records.kinds import ENDINGS, KINDS
from ehsid.harness.records.record import FORMATS

BOTH = ("command_v", "position_m")
BINARY = ("excel", "mat structure", "mat 7.3", "hdf5", "mf4", "tdms", "mcap", "ros 1 bag")


@pytest.fixture(scope="module", params=BINARY)
def log(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the writers
        return WRITERS[request.param](tmp_path_factory.mktemp("whole"))


@pytest.mark.slow
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(data=st.data())
def test_a_damaged_log_is_a_record_or_a_message(log: Path, data: st.DataObject) -> None:
    content = bytearray(log.read_bytes())
    start = data.draw(st.integers(0, len(content) - 1))
    stop = data.draw(st.integers(start, min(start + 40, len(content))))
    content[start:stop] = data.draw(st.binary(max_size=12))
    damaged = log.with_name(f"damaged{log.suffix}")
    damaged.write_bytes(content)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # readers warn of some damage before they refuse it
            record = read_record(damaged, columns=BOTH)
    except RecordError:
        return
    assert np.isfinite(record.column("position_m")).all()


def test_a_log_that_is_cut_short_is_a_record_or_a_message(log: Path) -> None:
    content = log.read_bytes()
    for share in (0.0, 0.01, 0.3, 0.9):
        cut = log.with_name(f"cut{log.suffix}")
        cut.write_bytes(content[: int(share * len(content))])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                record = read_record(cut, columns=BOTH)
        except RecordError:
            continue
        assert np.isfinite(record.column("position_m")).all()


@pytest.mark.parametrize(
    "ending", [one for one in ENDINGS if one not in FORMATS and not one.endswith("gz")]
)
@pytest.mark.parametrize("content", [b"", b"junk" * 50, b"\x00\x01\x02" * 100, b'\r"\n1,2\n'])
def test_what_is_no_log_is_named(tmp_path: Path, ending: str, content: bytes) -> None:
    path = tmp_path / f"bad.{ending}"
    path.write_bytes(content)
    with pytest.raises(RecordError) as caught:
        read_record(path)
    assert str(caught.value).startswith(str(path))
    assert caught.value.expected
    assert caught.value.mend


@pytest.mark.parametrize("kind", ["excel", "mf4", "mcap"])
def test_sizes_are_checked_before_content_is_decompressed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    """The file fits the limit, and what comes out of it does not."""
    path = WRITERS[kind](tmp_path)
    monkeypatch.setenv("EHSID_MAX_BYTES", str(path.stat().st_size))
    with pytest.raises(RecordError, match=r"EHSID_MAX_BYTES") as caught:
        read_record(path)
    assert "content" in caught.value.problem


def hdf5_bomb(path: Path) -> Path:
    import h5py

    path = path / "bomb.h5"
    with h5py.File(path, "w") as file:
        shape = (2**31,)
        zeros = {"compression": "gzip", "chunks": (2**20,)}
        for name in ("time", "command", "position"):
            file.create_dataset(name, shape, "f8", **zeros)
    return path


def excel_bomb(path: Path) -> Path:
    path = path / "bomb.xlsx"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
        archive.open("xl/worksheets/sheet1.xml", "w", force_zip64=True) as sheet,
    ):
        for _ in range(1025):
            sheet.write(bytes(2**20))
    return path


def far_cells(path: Path) -> Path:
    import openpyxl

    book = openpyxl.Workbook()
    book.active["A1"] = book.active["BXX1048576"] = 1.0
    book.save(path / "far.xlsx")
    return path / "far.xlsx"


def shared_text(path: Path) -> Path:
    rows = "".join(f'<row r="{k}"><c r="A{k}" t="s"><v>1</v></c></row>' for k in range(1, 20_001))
    text = "<si><t>a</t></si><si><t>" + "x" * 100_000 + "</t></si>"
    with zipfile.ZipFile(path / "text.xlsx", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/worksheets/sheet1.xml", f"<worksheet><sheetData>{rows}</sheetData>")
        archive.writestr("xl/sharedStrings.xml", f"<sst>{text}</sst>")
    return path / "text.xlsx"


def ods(path: Path, rows: str) -> Path:
    names = " ".join(
        f'xmlns:{one}="urn:oasis:names:tc:opendocument:xmlns:{one}:1.0"'
        for one in ("office", "table", "text")
    )
    with zipfile.ZipFile(path / "log.ods", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr(
            "content.xml",
            f"<office:document-content {names}><office:body><office:spreadsheet><table:table "
            f'table:name="S">{rows}</table:table></office:spreadsheet></office:body>'
            "</office:document-content>",
        )
    return path / "log.ods"


def ods_far(path: Path) -> Path:
    one = '<table:table-cell office:value-type="float" office:value="1"/>'
    far = '<table:table-cell table:number-columns-repeated="1900"/>'
    return ods(
        path,
        f"<table:table-row>{one}</table:table-row><table:table-row table:number-rows-repeated="
        f'"1000000"/><table:table-row>{far}{one}</table:table-row>',
    )


def ods_text(path: Path) -> Path:
    text = f'<table:table-cell office:value-type="string"><text:p>{"x" * 20_000}</text:p>'
    return ods(
        path,
        f'<table:table-row table:number-rows-repeated="100000">{text}</table:table-cell>'
        "</table:table-row>",
    )


@pytest.mark.slow
@pytest.mark.parametrize("bomb", [hdf5_bomb, excel_bomb, far_cells, shared_text, ods_far, ods_text])
def test_bombs_are_refused(tmp_path: Path, bomb: Callable[[Path], Path]) -> None:
    path = bomb(tmp_path)
    assert path.stat().st_size < 10 * 2**20
    with pytest.raises(RecordError, match="EHSID_MAX_"):
        read_record(path)


def test_a_link_in_hdf5_does_not_lead_to_another_file(tmp_path: Path) -> None:
    import h5py

    other, path = tmp_path / "secret.h5", tmp_path / "log.h5"
    with h5py.File(other, "w") as file:
        file["command"] = np.arange(50.0)
    with h5py.File(path, "w") as file:
        file["time"] = 0.01 * np.arange(50)
        file["position"] = np.arange(50.0)
        file["command"] = h5py.ExternalLink("secret.h5", "/command")
    with pytest.raises(RecordError, match="no column 'command_v'; the columns are: position, time"):
        read_record(path)


def test_objects_of_python_are_never_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "log.npz"
    np.savez(
        path,
        t=0.01 * np.arange(50),
        u=np.arange(50.0),
        y=np.array([{}] * 50, dtype=object),
    )  # type: ignore[arg-type]
    with pytest.raises(RecordError, match="Python objects, which are never loaded"):
        read_record(path)


@pytest.mark.parametrize(
    ("ending", "package"),
    [("xlsx", "fastexcel"), ("h5", "h5py"), ("mf4", "asammdf"), ("tdms", "nptdms"),
     ("mcap", "mcap"), ("bag", "rosbags")],
)  # fmt: skip
def test_a_missing_package_is_named_with_the_command_that_installs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str, package: str
) -> None:
    real = builtins.__import__

    def without(name: str, *rest: Any, **more: Any) -> Any:
        if name.split(".")[0] == package:
            raise ModuleNotFoundError(f"No module named '{package}'", name=package)
        return real(name, *rest, **more)

    monkeypatch.setattr(builtins, "__import__", without)
    path = tmp_path / f"log.{ending}"
    path.write_bytes(b"some content")
    with pytest.raises(RecordError, match=rf"'{package}'.*pip install 'ehsid\[logs\]'"):
        read_record(path)


@pytest.mark.slow
def test_memory_is_bounded_where_a_file_states_too_little(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("EHSID_MAX_BYTES", "1000000")
    with pytest.raises(RecordError, match="EHSID_MAX_BYTES"), bounded_memory(tmp_path):
        np.empty(2**31, np.uint8)
    assert np.empty(2**31, np.uint8).size == 2**31  # the bound ends with the block


def test_every_ending_has_one_reader() -> None:
    endings = [ending for kind in KINDS for ending in kind.endings]
    assert sorted(endings) == sorted(ENDINGS)

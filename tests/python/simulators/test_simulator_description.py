# SPDX-License-Identifier: MIT
"""What an FMU says of itself, and files that are none, damaged or made to do harm."""

from __future__ import annotations

import io
import os
import zipfile
from pathlib import Path

import pytest
from user_simulators import FOLDER, description_of, fmu_with

from ehsid.harness.simulators import description as of
from ehsid.harness.simulators.description import (
    Description,
    FmuError,
    parse_description,
    read_description,
)


def of_bench(name: str = "bench.fmu") -> Description:
    return read_description(FOLDER / name)


def refused(path: Path) -> str:
    with pytest.raises(FmuError) as caught:
        read_description(path)
    assert len(str(caught.value).splitlines()) == 1
    return str(caught.value)


@pytest.mark.parametrize(("name", "major"), [("bench.fmu", 2), ("bench3.fmu", 3)])
def test_a_description_is_read(name: str, major: int) -> None:
    found = of_bench(name)
    assert found.major == major
    assert found.identifier == name.removesuffix(".fmu")
    assert found.has_state
    assert not found.once_per_process
    assert not found.needs_tool
    mass = found.variables["mass"]
    assert (mass.start, mass.causality, mass.kind, mass.reference) == (
        150.0,
        "parameter",
        "real",
        20,
    )
    assert mass.is_settable
    assert found.variables["u"].causality == "input"
    assert not found.variables["y"].is_settable
    assert found.token.startswith("{")
    assert found.platforms == ("linux64",) if major == 2 else ("x86_64-linux",)


def test_flags_units_and_kinds_are_read() -> None:
    text = (
        '<fmiModelDescription fmiVersion="2.0" modelName="m" guid="g" description="a  b">'
        '<CoSimulation modelIdentifier="m" needsExecutionTool="true"'
        ' canBeInstantiatedOnlyOncePerProcess="true"/>'
        '<TypeDefinitions><SimpleType name="Length"><Real unit="mm"/></SimpleType>'
        "</TypeDefinitions>"
        "<ModelVariables>"
        '<ScalarVariable name="a" valueReference="1" description="stroke of  rod">'
        '<Real declaredType="Length" start="1e400"/></ScalarVariable>'
        '<ScalarVariable name="b" valueReference="2" causality="parameter"><Boolean start="true"/>'
        "</ScalarVariable>"
        '<ScalarVariable name="c" valueReference="3"><String start="x"/></ScalarVariable>'
        '<ScalarVariable name="d" valueReference="4" variability="constant" causality="parameter">'
        '<Real start="1"/></ScalarVariable>'
        '<ScalarVariable name="e" valueReference="5" causality="local" initial="exact">'
        '<Real start="1" unit="Pa"/></ScalarVariable>'
        "</ModelVariables></fmiModelDescription>"
    )
    found = parse_description(text.encode())
    assert found.needs_tool
    assert found.once_per_process
    assert found.description == "a b"
    a, b, c, d, e = found.variables.values()
    assert (a.unit, a.start, a.description) == ("mm", None, "stroke of rod")
    assert (b.kind, b.start) == ("yes or no", 1.0)
    assert c.kind == "other"
    assert not d.is_settable
    assert e.is_settable
    assert e.unit == "Pa"


def test_arrays_of_fmi_3_are_no_numbers() -> None:
    text = (
        '<fmiModelDescription fmiVersion="3.0" modelName="m" instantiationToken="g">'
        '<CoSimulation modelIdentifier="m"/><TypeDefinitions><Float64Type name="L" unit="m"/>'
        '</TypeDefinitions><ModelVariables><Float64 name="a" valueReference="1" declaredType="L">'
        '<Dimension start="3"/></Float64><Float64 name="b" valueReference="2" declaredType="L"/>'
        "</ModelVariables></fmiModelDescription>"
    )
    a, b = parse_description(text.encode()).variables.values()
    assert (a.kind, b.kind, b.unit) == ("other", "real", "m")


def test_what_is_no_fmu(tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    assert "there is no such file" in refused(path)
    path.write_bytes(b"")
    assert "is no FMU, or damaged" in refused(path)
    path.write_text("text")
    assert "is no FMU, or damaged" in refused(path)
    assert "is a directory" in refused(tmp_path)
    assert "device or a pipe" in refused(Path(os.devnull))
    fmu_with(path, None)
    assert "has no modelDescription.xml" in refused(path)


@pytest.mark.parametrize("share", [0.3, 0.9, 0.999])
def test_an_fmu_that_is_cut(tmp_path: Path, share: float) -> None:
    whole = (FOLDER / "bench.fmu").read_bytes()
    path = tmp_path / "cut.fmu"
    path.write_bytes(whole[: int(share * len(whole))])
    assert "is no FMU, or damaged" in refused(path)


def test_an_fmu_with_other_bytes_in_its_description(tmp_path: Path) -> None:
    whole = bytearray((FOLDER / "bench.fmu").read_bytes())
    start = whole.index(b"modelDescription.xml") + 60
    whole[start : start + 20] = bytes(20)
    path = tmp_path / "damaged.fmu"
    path.write_bytes(whole)
    assert "is no FMU, or damaged" in refused(path)


ENTITIES = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]><fmiModelDescription/>'
SAID = [
    (ENTITIES, "declares a document type or entities"),
    ('<!DOCTYPE x SYSTEM "file:///etc/passwd"><x/>', "declares a document type or entities"),
    ("<fmiModelDescription", "is not XML"),
    ("", "is not XML"),
    ("<x/>", "describes no FMU"),
    ('<fmiModelDescription fmiVersion="1.0"/>', "is of FMI 1.0: expected co-simulation of FMI 2.0"),
    (
        '<fmiModelDescription fmiVersion="2.0"><ModelExchange modelIdentifier="m"/>'
        "</fmiModelDescription>",
        "is for model exchange only: expected an FMU for co-simulation",
    ),
    (
        '<fmiModelDescription fmiVersion="2.0"><CoSimulation modelIdentifier="../m"/>'
        "</fmiModelDescription>",
        "its modelIdentifier is '../m'",
    ),
    (
        '<fmiModelDescription fmiVersion="2.0"><CoSimulation modelIdentifier="m"/><ModelVariables>'
        '<ScalarVariable name="a"><Real/></ScalarVariable></ModelVariables></fmiModelDescription>',
        "its variable 'a' has no value reference",
    ),
]


@pytest.mark.parametrize(("text", "says"), SAID)
def test_descriptions_that_are_none(tmp_path: Path, text: str, says: str) -> None:
    assert says in refused(fmu_with(tmp_path / "x.fmu", text))


def test_xml_of_another_encoding_hides_nothing(tmp_path: Path) -> None:
    path = fmu_with(tmp_path / "x.fmu", ENTITIES.encode("utf-16"))
    assert "or is not UTF-8" in refused(path)


@pytest.mark.parametrize("name", ["../out.so", "/etc/x", "a/../../x", "..\\x", "C:/x"])
def test_names_that_leave_the_folder(tmp_path: Path, name: str) -> None:
    path = fmu_with(tmp_path / "x.fmu", description_of(), more={name: b"x"})
    assert "which leaves its folder" in refused(path)


def test_sizes_are_checked_before_anything_is_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = fmu_with(tmp_path / "x.fmu", description_of(), more={"resources/zeros": bytes(10**5)})
    monkeypatch.setattr(of, "MOST_UNPACKED_BYTES", 10**5)
    assert "bytes: expected at most 100000" in refused(path)
    monkeypatch.undo()
    monkeypatch.setattr(of, "MOST_XML_BYTES", 100)
    assert "its modelDescription.xml has" in refused(path)
    monkeypatch.undo()
    monkeypatch.setattr(of, "MOST_MEMBERS", 3)
    assert "files in it: expected at most 3" in refused(path)
    monkeypatch.undo()
    monkeypatch.setattr(of, "MOST_FMU_BYTES", 100)
    assert "bytes: expected at most 100" in refused(path)


def test_an_encrypted_fmu(tmp_path: Path) -> None:
    data = io.BytesIO((FOLDER / "bench.fmu").read_bytes())
    raw = bytearray(data.getvalue())
    # Bit 0 of the general purpose flags, in the local header and in the directory.
    for mark, place in ((b"PK\x03\x04", 6), (b"PK\x01\x02", 8)):
        at = raw.index(mark)
        raw[at + place] |= 1
    path = tmp_path / "x.fmu"
    path.write_bytes(raw)
    assert zipfile.is_zipfile(path)
    assert "is encrypted" in refused(path)

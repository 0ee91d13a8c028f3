# SPDX-License-Identifier: MIT
"""The walls between the rooms, read off the sources."""

import re
from pathlib import Path

import pytest
from sources import HARNESS, ROOT, imported, imported_below

INCLUDE = ROOT / "cpp" / "include"

HEADERS = sorted(
    path.relative_to(INCLUDE).as_posix()
    for path in (INCLUDE / "ehsid").rglob("*.hpp")
    if "plant" not in path.relative_to(INCLUDE).parts
)
# For hosts: the banks keep their estimators on the heap.
BANK = [header for header in HEADERS if "bank" in Path(header).parts]


def included(text: str) -> list[str]:
    """Return the names in the #include lines of a C++ text."""
    return re.findall(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', text, flags=re.MULTILINE)


def reachable(header: str) -> set[str]:
    """Return every name that `header` includes, directly or through our own headers."""
    seen: set[str] = set()
    waiting = [header]
    while waiting:
        current = INCLUDE / waiting.pop()
        for name in included(current.read_text(encoding="utf-8")):
            beside = current.parent / name
            ours = beside if beside.is_file() else INCLUDE / name
            key = ours.relative_to(INCLUDE).as_posix() if ours.is_file() else name
            if key not in seen:
                seen.add(key)
                if ours.is_file():
                    waiting.append(key)
    return seen


def test_relative_imports_have_their_full_names() -> None:
    names = imported(HARNESS / "gap" / "diagnosis_file.py")
    assert {"ehsid.harness.gap.schema", "ehsid.harness.encoding.from_json"} <= names
    assert "ehsid.harness.gap" not in names


def test_packages_import_themselves_relatively() -> None:
    """So that every tool resolves them: the folder of ehsid.harness is not named like it."""
    absolute = re.compile(r"^\s*(from|import) ehsid\.harness\b", re.MULTILINE)
    assert not [path for path in HARNESS.rglob("*.py") if absolute.search(path.read_text("utf-8"))]


def test_headers_were_found() -> None:
    assert "ehsid/ehsid.hpp" in HEADERS
    assert "ehsid/types.hpp" in reachable("ehsid/ehsid.hpp")


def test_includes_are_read_in_every_form() -> None:
    assert included('#include <a.hpp>\n  # include "b/c.hpp"\n// #include <no>\n') == [
        "a.hpp",
        "b/c.hpp",
    ]


@pytest.mark.parametrize("header", HEADERS)
def test_estimator_headers_never_reach_the_plant(header: str) -> None:
    assert not [name for name in reachable(header) if "plant" in Path(name).parts]


@pytest.mark.parametrize("header", [header for header in HEADERS if header not in BANK])
def test_estimator_headers_never_reach_the_banks(header: str) -> None:
    assert not [name for name in reachable(header) if "bank" in Path(name).parts]


@pytest.mark.parametrize("header", [header for header in HEADERS if header not in BANK])
def test_estimator_headers_never_reach_streams_or_the_heap(header: str) -> None:
    forbidden = {"iostream", "ostream", "sstream", "string", "vector", "memory", "stdexcept", "map"}
    assert not forbidden & reachable(header)


# What each room may import of the others, from the ground up: no room imports one below it in this
# table, so no two import each other. `cli` alone may import all of them. A name with a slash is a
# room inside another room.
ROOMS: dict[str, set[str]] = {
    "catalogue": set(),
    "records": set(),
    "rigs": {"records"},
    "excitation": set(),
    "identification": {"records"},
    "estimation": {"identification"},
    "simulation": {"excitation", "records", "rigs"},
    "gap/tables": {"records", "rigs"},
    "gap/data": {"gap/tables", "records", "rigs", "simulation"},
    "rig_check": {"gap/data", "gap/tables", "records", "rigs", "simulation"},
    "gap/model": {"gap/data", "gap/tables", "records", "rigs", "simulation"},
    "gap/inference": {"gap/data", "gap/model", "gap/tables", "records", "rigs", "simulation"},
    "gap/laws": {
        "gap/data",
        "gap/inference",
        "gap/model",
        "gap/tables",
        "records",
        "rigs",
        "simulation",
    },
    "gap/design": {
        "excitation",
        "gap/data",
        "gap/model",
        "gap/tables",
        "records",
        "rigs",
        "simulation",
    },
    "gap": {
        "gap/data",
        "gap/design",
        "gap/inference",
        "gap/laws",
        "gap/model",
        "gap/tables",
        "records",
        "rigs",
    },
    "deploy": {"estimation", "identification", "records", "rigs", "simulation"},
    "validation/reality": set(),
    "validation": {"gap/tables", "records", "rigs"},
    "validation/blind": {
        "gap",
        "gap/tables",
        "records",
        "rigs",
        "validation",
        "validation/reality",
    },
    "validation/fleet": {"gap/tables", "records", "validation", "validation/blind"},
    "validation/scoring": {
        *("gap/data", "gap/inference", "gap/model", "gap/tables"),
        *("records", "rigs", "validation/blind"),
    },
    "validation/calibration": {
        *("gap/inference", "gap/tables", "validation/blind", "validation/scoring"),
    },
    "report": {
        *("deploy", "estimation", "gap", "gap/tables", "identification", "records"),
        *("rig_check", "rigs", "simulation"),
        *("validation/calibration", "validation/fleet", "validation/scoring"),
    },
    "studies": {
        *("deploy", "excitation", "identification", "records", "report", "rigs", "simulation"),
    },
    "api": {
        *("estimation", "excitation", "gap", "gap/tables", "identification", "records", "report"),
        *("rigs", "simulation"),
    },
    "app": {
        *("deploy", "estimation", "excitation", "gap", "gap/data", "gap/tables", "identification"),
        *("records", "report", "rig_check", "rigs", "simulation", "validation/fleet"),
    },
}
# Of gap: what comes out, as data and as a file, and the numbers that decide.
TABLES = {"deciding.py", "diagnosis_file.py", "options.py", "schema.py", "thresholds.py"}
# Modules of no room, which every room may use.
SHARED = {
    *("arrays", "encoding", "error_words", "exchange", "files", "manifest", "parallel"),
    *("plain_number", "text"),
    "surroundings",
    "time_to_go",
}
# The room of the tables, which every room but the independent generator may read.
TABLE_ROOM = "catalogue"


def room_of(path: Path) -> str:
    """The room of a file of the harness, or its name where it stands beside the rooms."""
    parts = path.relative_to(HARNESS).parts
    if parts[0] == "gap" and parts[1] in TABLES:
        return "gap/tables"
    for depth in (2, 1):
        name = "/".join(parts[:depth])
        if len(parts) > depth and (name in ROOMS or depth == 1):
            return name
    return path.stem


def imports() -> dict[str, set[tuple[str, str]]]:
    """By room: the modules of other rooms that it imports, each with the room it is of."""
    found: dict[str, set[tuple[str, str]]] = {name: set() for name in ROOMS}
    for path in HARNESS.rglob("*.py"):
        room = room_of(path)
        if room not in ROOMS:
            continue
        for name in imported(path):
            of = HARNESS.joinpath(*name.split(".")[2:])
            if not name.startswith("ehsid.harness."):
                continue
            if of.is_dir():
                of = of / "__init__.py"
            elif of.with_suffix(".py").is_file():
                of = of.with_suffix(".py")
            else:  # a name in a module, which is in the list by itself
                continue
            if room_of(of) not in (room, TABLE_ROOM, *SHARED):
                found[room].add((room_of(of), name))
    return found


IMPORTS = imports()


def test_every_folder_is_a_room() -> None:
    folders = {room_of(path) for path in HARNESS.rglob("*.py")} - SHARED
    assert folders == {*ROOMS, "cli", "__init__"}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_what_its_walls_let_in(room: str) -> None:
    others = {of for of, _ in IMPORTS[room]}
    assert others <= ROOMS[room], sorted(IMPORTS[room])


def test_rooms_stand_on_those_before_them() -> None:
    before: set[str] = set()
    for room, allowed in ROOMS.items():
        assert allowed <= before, (room, allowed - before)
        before.add(room)


DRAWING = ("matplotlib", "bokeh", "jinja2", "ehsid.harness.report")


SHOWING = ("api", "app", "gap/tables", "report", "studies")


@pytest.mark.parametrize("room", [room for room in ROOMS if room not in SHOWING])
def test_computing_rooms_draw_nothing(room: str) -> None:
    names = imported_below(HARNESS / room)
    if room == "deploy":  # its headers are made of templates
        names -= {name for name in names if name.startswith("jinja2")}
    assert not [name for name in names if name.startswith(DRAWING)]


def test_reality_never_imports_the_simulator() -> None:
    folder = HARNESS / "validation" / "reality"
    allowed = tuple(
        f"ehsid.harness.{name}" for name in ("arrays", "files", "parallel", "validation.reality")
    )
    ours = {name for name in imported_below(folder) if name.startswith("ehsid")}
    assert ours
    assert not [name for name in ours if not name.startswith(allowed)]


def test_tests_stand_where_what_they_test_does() -> None:
    """Beside `core`, the compiled module, and `docs`, every folder is one of the harness."""
    here = Path(__file__).parent
    folders = {path.parent.relative_to(here).as_posix() for path in here.rglob("test_*.py")}
    harness = {path.relative_to(HARNESS).as_posix() for path in HARNESS.rglob("*") if path.is_dir()}
    assert folders - {".", "core", "docs"} <= harness

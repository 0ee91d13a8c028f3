# SPDX-License-Identifier: MIT
"""The walls between the rooms, read off the sources."""

import re
from pathlib import Path

import pytest
from sources import HARNESS, PYTHON, ROOT, imported, imported_below

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
    names = imported(HARNESS / "diagnosis" / "schema.py")
    assert {"ehsid.harness.rigs.rig", "ehsid.harness.base.encoding.from_json"} <= names
    assert "ehsid.harness.diagnosis" not in names


@pytest.mark.parametrize("house", ["harness", "hil", "lab", "workbench"])
def test_packages_import_themselves_relatively(house: str) -> None:
    """So that every tool resolves them: the folder of ehsid.harness is not named like it."""
    absolute = re.compile(rf"^\s*(from|import) ehsid\.{house}\b", re.MULTILINE)
    sources = (PYTHON / house).rglob("*.py")
    assert not [path for path in sources if absolute.search(path.read_text("utf-8"))]


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
# table, so no two import each other. A name with a slash is a room inside another room. Every room
# but the independent generator may import `base` and `catalogue`.
BELOW_DIAGNOSIS = {"diagnosis/data", "diagnosis/tables", "records", "rigs", "signals/simulation"}
PRODUCT: dict[str, set[str]] = {
    "base": set(),
    "catalogue": set(),
    "records": set(),
    "simulators/description": set(),
    "simulators/source": set(),
    "rigs": {"records", "simulators/description", "simulators/source"},
    "signals/excitation": set(),
    "simulators": {"records", "rigs", "simulators/description", "simulators/source"},
    "signals/simulation": {"records", "rigs", "signals/excitation", "simulators"},
    "signals/injection": {"records", "rigs"},
    "models/identification": {"records"},
    "models/estimation": {"models/identification"},
    "firmware": {
        *("models/estimation", "models/identification", "records", "rigs", "signals/simulation"),
    },
    "diagnosis/tables": {"records", "rigs"},
    "diagnosis/data": {"diagnosis/tables", "records", "rigs", "signals/simulation"},
    "fitness": {"diagnosis/data", "diagnosis/tables", "records", "rigs"},
    "diagnosis/model": {*BELOW_DIAGNOSIS, "simulators"},
    "diagnosis/search": {*BELOW_DIAGNOSIS, "diagnosis/model"},
    "diagnosis/decision": {"diagnosis/model", "diagnosis/search", "diagnosis/tables", "rigs"},
    "diagnosis/laws": {
        *("diagnosis/decision", "diagnosis/model", "diagnosis/search", "diagnosis/tables"),
        "rigs",
    },
    "diagnosis/edits": {
        *BELOW_DIAGNOSIS,
        "diagnosis/decision",
        "diagnosis/model",
        "diagnosis/search",
    },
    "diagnosis/next_experiment": {*BELOW_DIAGNOSIS, "diagnosis/model", "signals/excitation"},
    "diagnosis": {
        *("diagnosis/data", "diagnosis/decision", "diagnosis/laws", "diagnosis/model"),
        *("diagnosis/next_experiment", "diagnosis/search", "diagnosis/tables", "records", "rigs"),
        *("signals/excitation", "signals/simulation", "simulators"),
    },
    "diagnosis/traces": {*BELOW_DIAGNOSIS, "diagnosis/model", "diagnosis/search"},
    "fleet": {"diagnosis", "diagnosis/tables", "records"},
    "watch": {
        *("diagnosis/data", "diagnosis/model", "diagnosis/search", "models/estimation"),
        *("models/identification", "records", "rigs"),
    },
    "hunt": {
        *("diagnosis", "diagnosis/data", "diagnosis/next_experiment", "diagnosis/tables"),
        *("records", "rigs", "signals/excitation", "signals/simulation", "simulators"),
        "simulators/source",
    },
    "commissioning": {"diagnosis/tables", "firmware", "rigs", "signals/simulation"},
    "show": {
        "commissioning",
        *(
            "diagnosis/edits",
            "diagnosis/tables",
            "fitness",
            "fleet",
            "hunt",
            "models/estimation",
            "models/identification",
        ),
        *("records", "rigs", "signals/simulation", "watch"),
    },
    "api": {
        *(
            "diagnosis",
            "diagnosis/edits",
            "diagnosis/tables",
            "hunt",
            "models/estimation",
            "models/identification",
        ),
        *(
            "records",
            "rigs",
            "simulators",
            "show",
            "signals/excitation",
            "signals/simulation",
            "watch",
        ),
    },
    "cli": {
        "commissioning",
        *("diagnosis", "diagnosis/data", "diagnosis/edits", "diagnosis/tables"),
        *("diagnosis/traces", "firmware"),
        *("fitness", "fleet", "hunt", "models/estimation", "models/identification"),
        *("records", "rigs"),
        *("show", "signals/injection", "signals/simulation", "watch"),
    },
}
# The guests of the product: nothing in the product imports one.
GUESTS: dict[str, set[str]] = {
    "hil": {
        *("cli", "firmware", "hunt", "models/estimation", "models/identification", "records"),
        *("rigs", "show", "signals/simulation"),
    },
    "lab/reality": set(),
    "lab/blind": {"diagnosis", "diagnosis/tables", "lab/reality", "records", "rigs"},
    "lab/scoring": {
        *("diagnosis/data", "diagnosis/decision", "diagnosis/edits", "diagnosis/model"),
        "diagnosis/search",
        *("diagnosis/tables", "lab/blind", "records", "rigs"),
    },
    "lab/calibration": {
        *("diagnosis/decision", "diagnosis/search", "diagnosis/tables"),
        *("lab/blind", "lab/scoring"),
    },
    "lab/pages": {"diagnosis/edits", "lab/calibration", "lab/scoring", "show"},
    "lab/studies": {
        *("firmware", "hil", "models/identification", "records", "rigs", "show"),
        *("signals/excitation", "signals/simulation"),
    },
    "lab/cli": {
        *("cli", "diagnosis", "lab/blind", "lab/calibration", "lab/pages", "lab/scoring"),
        *("lab/studies", "models/identification", "records", "rigs", "show"),
    },
    "lab": {"cli"},
    "workbench": {
        *(
            "cli",
            "commissioning",
            "diagnosis",
            "diagnosis/data",
            "diagnosis/tables",
            "firmware",
            "fitness",
        ),
        *("fleet", "hil", "models/estimation", "models/identification", "records", "rigs"),
        *("show", "signals/excitation", "signals/simulation", "watch"),
    },
}
ROOMS = PRODUCT | GUESTS
# Of the diagnosis: what comes out, as data and as a file, and the numbers that decide.
TABLES = {"deciding", "limits", "options", "result", "schema"}
FOR_ALL = ("base", "catalogue")
# They hold rooms and nothing else, and the package itself.
HALLS = {"harness", "models", "signals", "ehsid"}


def room_of(path: Path) -> str:
    """The room of a file below `python`: its folder, or the file itself."""
    parts = path.relative_to(PYTHON).with_suffix("").parts
    parts = parts[1:] if parts[0] == "harness" and parts[1] != "__init__" else parts
    if parts[0] == "diagnosis" and parts[1] in TABLES:
        return "diagnosis/tables"
    inner = "/".join(parts[:2])
    return inner if inner in ROOMS else parts[0]


def imports() -> dict[str, set[tuple[str, str]]]:
    """By room: the modules of other rooms that it imports, each with the room it is of."""
    found: dict[str, set[tuple[str, str]]] = {name: set() for name in ROOMS}
    for path in PYTHON.rglob("*.py"):
        room = room_of(path)
        if room in HALLS:
            continue
        for name in imported(path):
            of = PYTHON.joinpath(*name.split(".")[1:])
            if not name.startswith("ehsid."):
                continue
            if of.is_dir():
                of = of / "__init__.py"
            elif of.with_suffix(".py").is_file():
                of = of.with_suffix(".py")
            else:  # a name in a module, which is in the list by itself
                continue
            if room_of(of) not in {room, *FOR_ALL, *HALLS}:
                found[room].add((room_of(of), name))
    return found


IMPORTS = imports()


def test_every_folder_is_a_room() -> None:
    assert {room_of(path) for path in PYTHON.rglob("*.py")} == {*ROOMS, *HALLS}


def test_nothing_in_the_product_imports_a_guest() -> None:
    guests = {room.split("/")[0] for room in GUESTS}
    assert guests == {path.name for path in PYTHON.iterdir() if path.is_dir()} - HALLS
    found = {one for room in PRODUCT for one in IMPORTS[room]}
    assert not [name for of, name in found if of.split("/")[0] in guests]


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_what_its_walls_let_in(room: str) -> None:
    others = {of for of, _ in IMPORTS[room]}
    assert others <= ROOMS[room], sorted(IMPORTS[room])


def test_rooms_stand_on_those_before_them() -> None:
    before: set[str] = set()
    for room, allowed in ROOMS.items():
        assert allowed <= before, (room, allowed - before)
        before.add(room)


@pytest.mark.parametrize(("room", "allowed"), [("base", ()), ("catalogue", ("base",))])
def test_what_every_room_may_import_stands_by_itself(room: str, allowed: tuple[str, ...]) -> None:
    names = {name for name in imported_below(HARNESS / room) if name.startswith("ehsid.")}
    may = tuple(f"ehsid.{one}" for one in ("_core", *(f"harness.{name}" for name in allowed)))
    assert not [name for name in names if not name.startswith((*may, f"ehsid.harness.{room}"))]


DRAWING = ("matplotlib", "bokeh", "jinja2", "ehsid.harness.show")

SHOWING = ("api", "cli", "diagnosis", "hil", "lab", "show", "workbench")


@pytest.mark.slow
@pytest.mark.parametrize("room", [room for room in ROOMS if room.split("/")[0] not in SHOWING])
def test_computing_rooms_draw_nothing(room: str) -> None:
    names = imported_below(HARNESS / room)
    if room in ("commissioning", "firmware"):  # their files are made of templates
        names -= {name for name in names if name.startswith("jinja2")}
    assert not [name for name in names if name.startswith(DRAWING)]


@pytest.mark.slow
@pytest.mark.parametrize(
    "folder", [HARNESS / "diagnosis", *(PYTHON / "lab" / name for name in ("blind", "reality"))]
)
def test_diagnosis_and_blind_checks_draw_nothing(folder: Path) -> None:
    assert not [name for name in imported_below(folder) if name.startswith(DRAWING)]


def test_reality_never_imports_the_simulator() -> None:
    folder = PYTHON / "lab" / "reality"
    base = ("error_words", "files", "numbers", "parallel")
    allowed = ("ehsid.lab.reality", *(f"ehsid.harness.base.{name}" for name in base))
    ours = {name for name in imported_below(folder) if name.startswith("ehsid")}
    assert ours
    assert not [name for name in ours if not name.startswith(allowed)]


def test_no_two_files_of_tests_have_one_name() -> None:
    """They are imported by their names alone."""
    names = [path.name for path in Path(__file__).parents[1].rglob("test_*.py")]
    assert not sorted({name for name in names if names.count(name) > 1})


def test_tests_stand_where_what_they_test_does() -> None:
    """Beside `core`, the compiled module, and `docs`, every folder is one of `python`."""
    here = Path(__file__).parent
    folders = {path.parent.relative_to(here).as_posix() for path in here.rglob("test_*.py")}
    rooms = {
        path.relative_to(root).with_suffix("").as_posix()
        for root in (HARNESS, PYTHON)
        for path in root.rglob("*")
    }
    assert folders - {".", "core", "docs"} <= rooms

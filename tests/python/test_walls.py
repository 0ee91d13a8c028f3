# SPDX-License-Identifier: MIT
"""The walls between the rooms, read off the sources."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
INCLUDE = ROOT / "cpp" / "include"
HARNESS = ROOT / "python" / "harness"

HEADERS = sorted(
    path.relative_to(INCLUDE).as_posix()
    for path in (INCLUDE / "ehsid").rglob("*.hpp")
    if "plant" not in path.relative_to(INCLUDE).parts
)


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


def imported(source: str) -> set[str]:
    """Return the full names of all modules that a Python text imports, anywhere in it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide where a name comes from"
            names |= {node.module or ""} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def imported_below(folder: Path) -> set[str]:
    return set().union(
        *(imported(path.read_text(encoding="utf-8")) for path in folder.rglob("*.py"))
    )


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


@pytest.mark.parametrize("header", HEADERS)
def test_estimator_headers_never_reach_streams_or_the_heap(header: str) -> None:
    forbidden = {"iostream", "ostream", "sstream", "string", "vector", "memory", "stdexcept", "map"}
    assert not forbidden & reachable(header)


WRITING = ("check", "cli", "report", "export")
COMPUTING = sorted(
    folder.name
    for folder in HARNESS.iterdir()
    if (folder / "__init__.py").is_file() and folder.name not in WRITING
)


@pytest.mark.parametrize("room", COMPUTING)
def test_computing_rooms_draw_nothing(room: str) -> None:
    folder = HARNESS / room
    drawing = ("matplotlib", "jinja2", "ehsid.harness.report")
    assert not [name for name in imported_below(folder) if name.startswith(drawing)]


def test_only_what_people_see_uses_the_checks() -> None:
    users = {
        folder.name
        for folder in HARNESS.iterdir()
        if folder.is_dir()
        and [name for name in imported_below(folder) if name.startswith("ehsid.harness.check")]
    }
    assert users <= {"check", "cli", "report"}


def test_reality_never_imports_the_simulator() -> None:
    folder = HARNESS / "reality"
    if not folder.is_dir():
        pytest.skip("no reality yet")
    forbidden = ("ehsid._core", "ehsid.harness.gap", "ehsid.harness.rigs", "ehsid.harness.simulat")
    assert not [name for name in imported_below(folder) if name.startswith(forbidden)]

# SPDX-License-Identifier: MIT
"""What is told of a simulator by the text of its Python file, which is never run."""

from __future__ import annotations

from pathlib import Path

import pytest

from ehsid.harness.simulators import source as of
from ehsid.harness.simulators.source import Place, Source, SourceError, read_place, read_source


def told(folder: Path, text: str, name: str = "Mine") -> Source:
    path = folder / "mine.py"
    path.write_text(text, encoding="utf-8")
    return read_source(path, name)


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ("bench.py:Bench", Place("bench.py", "Bench")),
        (r"C:\rigs\bench.py:Bench", Place(r"C:\rigs\bench.py", "Bench")),
        ("my.module:Outer.inner", Place("my.module", "Outer.inner")),
        ("bench.py", None),
        ("bench.py:", None),
        ("bench.py:3", None),
        ("my-module:Bench", None),
    ],
)
def test_where_a_simulator_stands(text: str, place: Place | None) -> None:
    assert read_place(text) == place
    assert place is None or place.is_file == text.split(":")[-2].endswith(".py")


def test_attributes_that_are_written_out_are_read(tmp_path: Path) -> None:
    found = told(
        tmp_path,
        "raise RuntimeError\n"
        "if True:\n"
        "    class Mine:\n"
        "        inputs: tuple = ('u', 'f')\n"
        "        outputs = ['y']\n"
        "        parameters = {'mass': 3, 'name': 'x', 4: 1.0}\n"
        "        def reset(self, parameters=None, *, position_m=0.0): pass\n",
    )
    assert found == Source(
        True, ("u", "f"), ("y",), {"mass": 3.0}, ("self", "parameters", "position_m")
    )


def test_attributes_that_are_computed_are_not_known(tmp_path: Path) -> None:
    found = told(
        tmp_path,
        "class Mine:\n"
        "    inputs = tuple(NAMES)\n"
        "    outputs = ('y', 3)\n"
        "    parameters = dict(OTHERS, mass=1.0)\n",
    )
    assert found == Source(True)


def test_functions_and_other_names(tmp_path: Path) -> None:
    assert told(tmp_path, "def Mine(u, dt, position_m=0.0): pass") == Source(
        False, start_arguments=("u", "dt", "position_m")
    )
    for text in (
        "Mine = make()",
        "from plants import Other as Mine",
        "from plants import *",
        "try:\n    import Mine\nexcept ImportError:\n    Mine = None",
        "for Mine, x in plants: pass",
    ):
        assert told(tmp_path, text) == Source(None)
    assert told(tmp_path, "class Outer:\n    class Mine: pass", "Outer.Mine") == Source(None)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("Other = 1\ndef third(): pass", "has the name 'Mine'.* the names are: Other, third$"),
        ("", "the names are: none$"),
        ("def Mine(:", "^line 1: invalid syntax: expected Python$"),
        ("x = '\0'", "cannot be read as Python|line 1"),
        ("(" * 5000, "line 1: too many nested|cannot be read as Python"),
    ],
)
def test_files_without_a_simulator(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(SourceError, match=says):
        told(tmp_path, text)


def test_files_that_are_too_large_or_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(SourceError, match="there is no such file"):
        read_source(tmp_path / "no.py", "Mine")
    with pytest.raises(SourceError, match="cannot be read"):
        read_source(tmp_path, "Mine")
    monkeypatch.setattr(of, "MOST_BYTES", 10)
    with pytest.raises(SourceError, match="more than 10 bytes"):
        told(tmp_path, "class Mine: pass")

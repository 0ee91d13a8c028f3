# SPDX-License-Identifier: MIT
"""The notebooks run, and print what they show."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from printed_pages import DOCS, made_by, text_of, without_digits

pytest.importorskip("nbclient")
pytest.importorskip("ipykernel")

MAKE = made_by("notebooks/make.py")
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))


def printed(notebook: dict[str, Any]) -> list[str]:
    """Of each cell of code: what it prints, and the kinds of what it shows."""
    return [
        without_digits(one["text"]) if "text" in one else "+".join(sorted(one["data"]))
        for cell in notebook["cells"]
        for one in cell.get("outputs", [])
        if one.get("name") != "stderr"
    ]


def test_there_are_three() -> None:
    assert [path.stem for path in NOTEBOOKS] == [
        "diagnose_a_gap",
        "identify_and_estimate",
        "reproduce_the_published_experiment",
    ]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_small_and_of_no_machine(path: Path) -> None:
    text = text_of(path)
    assert len(text) < 500_000
    assert "stderr" not in text
    assert not re.search(r"/(home|root|tmp|usr|work)/", text)


@pytest.mark.thorough
@pytest.mark.filterwarnings("default")  # of the packages that run a kernel
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_prints_what_it_shows(path: Path) -> None:
    import nbformat

    shown = printed(nbformat.read(path, as_version=4))
    assert len(shown) >= 5
    assert printed(MAKE["run"](path)) == shown

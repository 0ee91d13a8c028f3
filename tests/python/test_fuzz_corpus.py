# SPDX-License-Identifier: MIT
"""What script/fuzz has found, again: rig texts and commands. CTest does the compiled targets."""

from pathlib import Path

import commands
import pytest
import rig_text
from commands import Example
from sources import ROOT

CORPUS = ROOT / "tests" / "fuzz" / "corpus"
RIG_TEXTS = sorted((CORPUS / "rig_text").iterdir())
EXAMPLES = [path for name in ("options", "records", "rigs") for path in (CORPUS / name).iterdir()]


@pytest.mark.parametrize("path", RIG_TEXTS, ids=lambda path: path.name)
def test_a_rig_text_is_refused_or_written_back(path: Path) -> None:
    rig_text.check(path.read_bytes())


@pytest.mark.parametrize(
    "path", sorted(EXAMPLES), ids=lambda path: f"{path.parent.name}-{path.stem}"
)
def test_a_command_ends_as_it_should(path: Path) -> None:
    assert commands.check(Example.from_json(path.read_text(encoding="utf-8")))

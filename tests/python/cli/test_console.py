# SPDX-License-Identifier: MIT
"""What commands print is data, whatever it looks like."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from sources import HARNESS, ROOT
from typer.testing import CliRunner

from ehsid.harness.base.error_words import printable
from ehsid.harness.cli import cli
from ehsid.harness.cli.console import Console, print_blocks, print_points, refuse
from ehsid.harness.cli.progress import progress_of
from ehsid.harness.rigs import read_rig, write_rig
from ehsid.harness.show.page import Table, Told

pytestmark = pytest.mark.usefixtures("blank_pictures")

BENCH = ROOT / "examples" / "rigs" / "bench.toml"
EVIL = ["[/red]", "[bold]x[/bold]", "[link=file:///etc/passwd]x[/link]", ":smile:", "\\[x]"]


def printed(what: Told) -> str:
    console = Console(force_terminal=True, width=200, color_system=None)
    with console.capture() as captured:
        print_blocks([what], console)
    return captured.get()


@pytest.mark.parametrize("text", EVIL)
def test_markup_in_data_is_printed_as_it_is(text: str) -> None:
    assert printed(text) == f"{text}\n"
    assert text in printed(Table(text, (text,), [(text,)]))


def test_escape_sequences_in_data_are_written_out(capsys: pytest.CaptureFixture[str]) -> None:
    evil = "\x1b[2Jgone\r\x07\u202e"
    for text in (printed(evil), printed(Table("", ("a",), [(evil,)]))):
        assert "\\x1b[2Jgone\\r\\x07\\u202e" in text
    with pytest.raises(Exception, match="2"):
        refuse(evil)
    assert capsys.readouterr().err == "ehsid: \\x1b[2Jgone\\r\\x07\\u202e\n"


@pytest.mark.parametrize("indent", [0, 2])
def test_further_lines_of_a_point_stand_below_its_text(indent: int) -> None:
    console = Console(width=30)
    words = "With [--nk 2] the estimate converges on this record."
    with console.capture() as captured:
        print_points([words, "short"], console, indent=indent)
    *lines, last = captured.get().splitlines()
    assert max(map(len, lines)) <= 30
    assert [line[: indent + 2] for line in lines] == [
        f"{' ' * indent}- ",
        *[" " * (indent + 2)] * (len(lines) - 1),
    ]
    assert " ".join(line[indent + 2 :] for line in lines) == words
    assert len(lines) > 1
    assert last == f"{' ' * indent}- short"


def test_spaces_of_all_kinds_and_letters_stay() -> None:
    text = "412\u00a0N, 3\u202fmm, Größe, 油圧\nnext"
    assert printable(text) == text


def test_a_name_that_is_no_text_can_be_printed() -> None:
    assert printed(os.fsdecode(b"r\xff.csv")) == "r\\udcff.csv\n"


def test_a_bar_shows_names_as_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ehsid.harness.cli.progress.QUICK_S", 0.0)
    shown = Console(force_terminal=True, width=100, color_system=None)
    monkeypatch.setattr("ehsid.harness.cli.progress.Console", lambda **_: shown)
    with shown.capture() as captured, progress_of("simulating [/red]\x1b[2J") as progress:
        progress(0.5)
    assert "simulating [/red]\\x1b[2J" in captured.get()


def test_nothing_in_a_command_prints_through_another_console() -> None:
    """rich takes text for markup wherever it is not forbidden, which is in one module only."""
    sources = {path.name: path.read_text("utf-8") for path in (HARNESS / "cli").glob("*.py")}
    del sources["console.py"]
    pattern = r"rich\.(console|markup)|from rich import|import rich|\bTextColumn|from_markup"
    assert not [name for name, text in sources.items() if re.search(pattern, text)]


@pytest.mark.slow
@pytest.mark.parametrize("text", ["[/red]", "\x1b[2J", "$x_{$"])
def test_a_rig_and_a_record_with_evil_names(text: str, tmp_path: Path) -> None:
    rig, out = tmp_path / "rig.toml", tmp_path / f"{text.replace('/', '')}.csv"
    write_rig(replace(read_rig(BENCH), name=text), rig)
    arguments = ["simulate", str(rig), "--excitation", "steps", "--duration", "0.1"]
    outcome = CliRunner().invoke(cli, [*arguments, "--out", str(out)])
    assert outcome.exit_code == 0, outcome.output
    assert out.is_file()
    assert text.replace("\x1b", "\\x1b") in outcome.stdout

# SPDX-License-Identifier: MIT
"""The blocks of a page are run in their order, and what they print replaces what it shows."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from printed_pages import made_by

BLOCKS = made_by("blocks.py")


def page(*blocks: tuple[str, str]) -> str:
    return "\n".join(f"```{language}\n{text}```\n" for language, text in blocks)


def run(folder: Path, *blocks: tuple[str, str]) -> tuple[str, dict[str, Any]]:
    made: tuple[str, dict[str, Any]] = BLOCKS["run_in"](folder, page(*blocks))
    return made


def test_python_has_one_interpreter_and_sh_the_same_folder(tmp_path: Path) -> None:
    write = 'from pathlib import Path\ntext = "a"\nPath("file.txt").write_text(text)\n'
    made, names = run(tmp_path, ("python", write), ("sh", "cat file.txt\n"), ("text", "old\n"))
    assert made.endswith(page(("sh", "cat file.txt\n"), ("text", "a\n")))
    assert names["text"] == "a"


def test_a_block_that_names_a_file_is_written_and_others_are_left_alone(tmp_path: Path) -> None:
    code = "// file: src/main.cpp\nint main() {}\n"
    blocks = [("cpp", code), ("cpp", "no file\n"), ("text", "left as it is\n")]
    made, _ = run(tmp_path, *blocks)
    assert (tmp_path / "src/main.cpp").read_text(encoding="utf-8") == code
    assert made == page(*blocks)


def test_lines_that_are_left_out_stay_left_out(tmp_path: Path) -> None:
    code = 'print("head\\nsize 2.5 mm\\nnext\\nmiddle\\nend")\n'
    made, _ = run(tmp_path, ("python", code), ("text", "...\nsize 7 mm\nold\n...\nend\n"))
    assert made.endswith("```text\n...\nsize 2.5 mm\nnext\n...\nend\n```\n")


def test_a_line_that_is_no_longer_printed_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no line like\nweight"):
        run(tmp_path, ("python", 'print("size 2.5 mm")\n'), ("text", "...\nweight 3 kg\n"))


@pytest.mark.thorough
def test_a_command_that_fails_stops_the_page(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match="exit code 2 of"):
        run(tmp_path, ("sh", "ehsid identify nothing.csv\ntouch never\n"))
    assert not (tmp_path / "never").exists()

# SPDX-License-Identifier: MIT
"""In every kind of page a name is text, whatever it looks like: no element, attribute or template.

Each page is made twice, with a plain name and with an evil one. A browser must find the same
elements with the same attributes in both, and the evil name as it is among the words.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from identification_truth import model16
from made_pages import KINDS
from page_names import EVIL, PLAIN, Reader, file_name, read_page, words
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.base.error_words import printable
from ehsid.harness.cli import cli
from ehsid.harness.rigs import read_rig, write_rig

BENCH = ROOT / "examples" / "rigs" / "bench.toml"
# What stands in most places of a page, and what can do harm in pictures, headers and JSON. Where
# time counts, each page has all of them in one name.
OTHERS = ("element", "end of script", "attribute", "expression", "direction")
IN_FILES = ("formula", "comment", "expression", "console", "direction", "control", "long")
NAMES = EVIL | {
    "all together": "".join(EVIL[one] for one in OTHERS),
    "all in files": "".join(EVIL[one] for one in IN_FILES if one != "long"),
}


def thorough(*case: str) -> Any:
    return pytest.param(*case, marks=pytest.mark.thorough)


PAGES = [
    *((kind, "all together") for kind in KINDS),
    *(thorough("gap", name) for name in EVIL),
    *(thorough(kind, name) for kind in KINDS if kind != "gap" for name in OTHERS),
]
plain_pages: dict[str, Reader] = {}


def plain_page(kind: str, folder: Path) -> Reader:
    if kind not in plain_pages:
        plain_pages[kind] = read_page(KINDS[kind](PLAIN, folder))
    return plain_pages[kind]


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
@pytest.mark.parametrize(("kind", "which"), PAGES)
def test_a_name_is_text_in_a_page(kind: str, which: str, tmp_path: Path) -> None:
    name = NAMES[which]
    for folder in ("plain", "evil"):
        (tmp_path / folder).mkdir()
    plain = plain_page(kind, tmp_path / "plain")
    evil = read_page(KINDS[kind](name, tmp_path / "evil"))
    assert evil.elements == plain.elements
    shown = {words(printable(one)).strip() for one in (name, file_name(name))}
    text = words(" ".join(evil.words))
    assert [one for one in shown if one in text], text[:2000]


@pytest.mark.slow
@pytest.mark.parametrize("which", ["all in files", *(thorough(one) for one in IN_FILES)])
def test_a_name_is_text_in_the_files_of_a_command(which: str, tmp_path: Path) -> None:
    """Columns, record, rig and folder have the name; pictures are drawn."""
    name = NAMES[which]
    u, y = model16(seed=1, n=600, noise=0.1)
    record, out = tmp_path / f"{file_name(name)}.parquet", tmp_path / file_name(name)
    columns = {"time_s": 0.02 * np.arange(u.size), name: u, f"{name}2": y}
    pl.DataFrame(columns).write_parquet(record)
    signals = [f"--input={name}", f"--output={name}2"]
    for verb in ("identify", "estimate"):
        run([verb, str(record), *signals, "--out", str(out)])
        json.loads((out / f"{verb}.json").read_text(encoding="utf-8"))
    header = tmp_path / f"{file_name(name)}.h"
    run(["export", str(record), *signals, "--c", "--out", str(header)])
    text = header.read_text(encoding="utf-8")
    assert text.count("/*") == text.count("*/")
    rig, new = tmp_path / f"{file_name(name)}.toml", tmp_path / f"{file_name(name)}.csv"
    write_rig(replace(read_rig(BENCH), name=name), rig)
    assert read_rig(rig).name == name
    test_signal = ["--excitation", "multisine", "--duration", "1"]
    run(["simulate", str(rig), *test_signal, "--out", str(new)])
    assert new.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    again = tmp_path / f"2{file_name(name)}.csv"
    put_in = ["--effect", "gain", "--set", "factor=1.1"]
    run(["inject", str(new), "--rig", str(rig), *put_in, "--out", str(again)])
    answer = json.loads(Path(f"{again}.answer.json").read_text(encoding="utf-8"))
    assert (answer["rig"], answer["source"]["file"]) == (name, new.name)


def run(arguments: list[str]) -> None:
    ended = CliRunner().invoke(cli, arguments)
    assert ended.exit_code == 0, ended.output

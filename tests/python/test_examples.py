# SPDX-License-Identifier: MIT
"""The examples in Python print what those in C++ and C print, and docs/examples.md has them all.

The programs in C++ and C are compiled and compared with the same text in tests/install.
"""

import re
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from sources import ROOT

EXAMPLES = ROOT / "examples"
SAMPLES = EXAMPLES / "data" / "servo_samples.csv"
PAGE = ROOT / "docs" / "examples.md"
# What a column of the table of calls may be quoted from.
QUOTED = {
    "C++": ("cpp/online.cpp", "cpp/CMakeLists.txt"),
    "C": ("c/online.c", "c/CMakeLists.txt"),
    "Python": ("python/online.py", "python/README.md"),
}


def run(program: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(EXAMPLES / "python" / program), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def read(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@pytest.mark.slow
def test_python_prints_what_the_other_languages_print() -> None:
    done = run("online.py", str(SAMPLES))
    assert done.returncode == 0, done.stderr
    assert done.stdout == read(EXAMPLES / "servo_online.txt")


def test_without_samples_it_says_how_it_is_called() -> None:
    done = run("online.py")
    assert done.returncode == 1
    assert done.stderr.startswith("usage: online.py SAMPLES.csv")


def test_samples_are_those_that_the_script_makes() -> None:
    script = runpy.run_path(str(EXAMPLES / "data" / "make_servo_samples.py"))
    command, position = script["simulate"]()
    kept = np.loadtxt(SAMPLES, delimiter=",", skiprows=1)
    wrong = [script["NO_NUMBER"], script["IMPOSSIBLE"]]
    assert np.isnan(kept[wrong[0], 2])
    assert kept[wrong[1], 2] == 1e9
    good = np.delete(np.arange(len(kept)), wrong)
    np.testing.assert_allclose(kept[good, 1], command[good], rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(kept[good, 2], position[good], rtol=1e-4, atol=1e-8)


def test_the_page_has_the_programs_as_they_are() -> None:
    page = read(PAGE)
    blocks = page.count("<!-- examples/")
    assert page.count("```") == 2 * blocks == 16
    assert runpy.run_path(str(ROOT / "docs" / "examples" / "make.py"))["filled"](page) == page, (
        "docs/examples.md has programs of another version; write it again: "
        "python docs/examples/make.py"
    )


@pytest.mark.parametrize(("column", "language"), list(enumerate(QUOTED, start=2)))
def test_calls_in_the_table_stand_in_the_programs(column: int, language: str) -> None:
    texts = "\n".join(read(EXAMPLES / name) for name in QUOTED[language])
    rows = [line.split("|") for line in read(PAGE).splitlines() if line.startswith("| ")]
    calls = [found for row in rows for found in re.findall("`(.+?)`", row[column])]
    assert len(calls) == 9
    assert not [call for call in calls if "".join(call.split()) not in "".join(texts.split())]


@pytest.mark.thorough
def test_the_diagnosis_finds_the_friction() -> None:
    done = run("diagnose.py")
    assert done.returncode == 0, done.stderr
    words = re.sub(r"\d+", "#", done.stdout)
    assert words == re.sub(r"\d+", "#", read(EXAMPLES / "gap_found.txt"))
    found = re.search(r"force_n = (\d+)", done.stdout)
    assert found is not None
    assert float(found[1]) == pytest.approx(400.0, rel=0.05)

# SPDX-License-Identifier: MIT
"""Builds the program of the recursions in C and C++, and runs it on a series."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from series import Series

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
BUILD = ROOT / "build" / "peers"
# What a compiler may not change: the bits of every other machine, see ehsid::reproducible.
FLAGS = "-DNDEBUG -ffp-contract=off"
# Rows of libraries that are left out where they are not installed, and how to install them.
INSTALL = {
    "dlib rls": "apt-get install libdlib-dev",
    "dlib rls, not regularised": "apt-get install libdlib-dev",
    "liquid-dsp eqrls_rrrf": "apt-get install libliquid-dev",
}

# What the program prints for each recursion.
Row = dict[str, Any]


def tool(name: str) -> str:
    """Path of a program that is installed beside this Python, or elsewhere."""
    beside = Path(sys.executable).parent / name
    found = str(beside) if beside.exists() else shutil.which(name)
    if found is None:
        sys.exit(f"peers: {name} was not found; python -m pip install {name}")
    return found


def output_of(command: Sequence[str | Path]) -> str:
    """Standard output of a command that must not fail."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"peers: failed ({done.returncode}): {command[0]}\n{done.stdout}{done.stderr}")
    return done.stdout


def build(
    level: str, sizes: Sequence[int], folder: Path = BUILD, compiler: str | None = None
) -> Path:
    """Compiles the program at -O`level` for these numbers of parameters; only what has changed."""
    cmake, place = tool("cmake"), folder / f"O{level}"
    options = {
        "CMAKE_CXX_FLAGS": f"-O{level} {FLAGS}",
        "PEERS_SIZES": ";".join(map(str, sizes)),
        "CMAKE_MAKE_PROGRAM": tool("ninja"),
    }
    if compiler is not None:
        options["CMAKE_CXX_COMPILER"] = compiler
    settings = [f"-D{name}={value}" for name, value in options.items()]
    output_of([cmake, "-G", "Ninja", "-S", HERE, "-B", place, *settings])
    output_of([cmake, "--build", place, "--target", "peers"])
    return place / "peers"


def compiler(program: Path) -> str:
    """Name and version of the compiler that a program was built with."""
    cache = (program.parent / "CMakeCache.txt").read_text(encoding="utf-8")
    path = next(line for line in cache.splitlines() if line.startswith("CMAKE_CXX_COMPILER:"))
    return output_of([path.partition("=")[2], "--version"]).splitlines()[0]


def call(
    program: Path,
    mode: str,
    series: Series,
    factor: float,
    variance0: float,
    numbers: Sequence[int],
) -> list[Row]:
    """Runs all recursions on the series; the modes and numbers are in cpp/program.cpp."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "series"
        series.write(file)
        orders = [str(series.na), str(series.nb), repr(factor), repr(variance0)]
        text = output_of([program, mode, file, *orders, *map(str, numbers)])
    return [json.loads(line) for line in text.splitlines()]


def missing(rows: Sequence[Row]) -> dict[str, str]:
    """Recursions that are not among these rows, with the command that installs them."""
    names = {row["name"] for row in rows}
    return {name: command for name, command in INSTALL.items() if name not in names}

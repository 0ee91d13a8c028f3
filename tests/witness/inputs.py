# SPDX-License-Identifier: MIT
"""The files that the commands of the witness read, each made when a command names it.

The package is used by its command alone, so that its modules may move.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import polars as pl

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tests" / "python"))

from log_files import WRITERS  # noqa: E402

# Neither the terminal nor the settings of a user show in what a command writes.
ENVIRONMENT = {
    **{name: value for name, value in os.environ.items() if not name.startswith("EHSID")},
    **{"COLUMNS": "100", "LC_ALL": "C.UTF-8", "NO_COLOR": "1", "TERM": "dumb"},
    **{"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
}

Maker = Callable[[Path], object]  # writes the file or folder of this path, and its needs beside it


class LeftOutError(Exception):
    """An input that cannot be made on this machine."""


def ehsid(folder: Path, words: list[str]) -> subprocess.CompletedProcess[str]:
    """Runs a command in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "ehsid", *words],
        cwd=folder,
        env=ENVIRONMENT,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )


def made(path: Path) -> Path:
    """The path, made if it is that of an input which is not there yet."""
    if path.name in INPUTS and not path.exists():
        INPUTS[path.name](path)
    return path


def _copied(source: str) -> Maker:
    return lambda path: shutil.copyfile(ROOT / source, path)


def _log(kind: str) -> Maker:
    return lambda path: WRITERS[kind](path.parent)


def _changed(old: str, new: str) -> Maker:
    """The rig of the bench, with one text instead of another."""

    def write(path: Path) -> None:
        text = made(path.with_name("bench.toml")).read_text(encoding="utf-8")
        assert old in text
        path.write_text(text.replace(old, new, 1), encoding="utf-8")

    return write


def _simulated(words: str, *columns: str) -> Maker:
    """Command and these columns of a simulated machine, with the noise of its sensors."""

    def write(path: Path) -> None:
        whole = path.with_name(f"whole_{path.name}")
        arguments = ["simulate", *words.split(), "--noise", "--out", whole.name]
        for word in arguments:
            made(path.with_name(word))
        done = ehsid(path.parent, arguments)
        assert done.returncode == 0, done.stderr
        pl.read_csv(whole).select("time_s", "command_v", *columns).write_csv(path)
        whole.unlink()
        whole.with_suffix(".png").unlink()

    return write


def _slow_command(path: Path) -> None:
    """Far below the corner of the valve, and not periodic."""
    time_s = 0.002 * np.arange(4000)
    turns = 2.0 * np.pi * np.outer(time_s, (0.31, 0.73, 1.17, 1.61)) + (0.3, 1.9, 4.1, 5.5)
    command_v = 0.3 * np.sin(turns).sum(axis=1)
    pl.DataFrame({"time_s": time_s, "command_v": command_v}).write_csv(path)


def _folder(files: dict[str, str]) -> Maker:
    """A folder with copies of inputs, by their names in it, and a file that is no record."""

    def write(path: Path) -> None:
        for name, source in files.items():
            (path / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(made(path.with_name(source)), path / name)

    return write


def _note(path: Path) -> None:
    path.write_text("what,who\nseal changed,MM\n", encoding="utf-8")


def _firmware(path: Path) -> None:
    """The controller of the examples, for the emulator."""
    for tool in ("arm-none-eabi-g++", "qemu-system-arm", "cmake", "ninja"):
        if shutil.which(tool) is None:
            raise LeftOutError(f"no {tool}")
    for words in (["--preset", "firmware"], ["--build", "--preset", "firmware", "-t", path.stem]):
        done = subprocess.run(["cmake", *words], cwd=ROOT, capture_output=True, check=False)
        assert done.returncode == 0, done.stderr.decode() + done.stdout.decode()
    shutil.copyfile(ROOT / "build" / "firmware" / path.name, path)


# A friction that comes up with the velocity: no effect of the catalogue does.
SPEEDS = np.linspace(-0.6, 0.6, 25)
DRAG = f"""
[effects.table.drag]
adds_to = "force"
of = "velocity_m_s"
knots = {SPEEDS.round(3).tolist()}
values = {(2500.0 * np.tanh(SPEEDS / 0.1)).round(1).tolist()}
"""
LAG = """[effects.valve_lag]
bandwidth_hz = 70.0
damping = 0.85
"""
DELAY = "[effects.transport_delay]\ndelay_s = 0.008\n"
LOOP = "--excitation multisine --loop pi --dt 0.002"
PRESSURES = ("position_m", "pressure_a_pa", "pressure_b_pa")

INPUTS: dict[str, Maker] = {
    "prüfstand.txt": _log("text"),
    "run.xlsx": _log("excel"),
    "run.parquet": _log("parquet"),
    "run.npz": _log("npz"),
    "run.mat": _log("mat structure"),
    "run.h5": _log("hdf5"),
    "run.mf4": _log("mf4"),
    "run.tdms": _log("tdms"),
    "run.mcap": _log("mcap"),
    "run.bag": _log("ros 1 bag"),
    "press.txt": _copied("examples/data/mts_press_head.txt"),
    "crane.csv": _copied("examples/data/hydraulic_crane.csv"),
    "note.csv": _note,
    "bench.toml": _copied("examples/rigs/bench.toml"),
    "axis.toml": _copied("examples/rigs/axis.toml"),
    "servo_an386.elf": _firmware,
    "larger.toml": _changed("bore_m = 0.063", "bore_m = 0.080"),
    "quick.toml": _changed(LAG, ""),
    "late.toml": _changed(LAG, DELAY),
    "worn.toml": _changed(LAG, LAG + DRAG),
    "friction.csv": _simulated(
        f"bench.toml {LOOP} --duration 8 --seed 1 --effect coulomb_friction.force_n=600", *PRESSURES
    ),
    "more_friction.csv": _simulated(
        f"bench.toml {LOOP} --duration 6 --seed 2 --effect coulomb_friction.force_n=900", *PRESSURES
    ),
    "fits.csv": _simulated(f"bench.toml {LOOP} --duration 6 --seed 3", *PRESSURES),
    "short.csv": _simulated("bench.toml --excitation steps --duration 1 --seed 4", *PRESSURES),
    "slow.csv": _slow_command,
    "late.csv": _simulated("late.toml --command slow.csv", "position_m"),
    "worn.csv": _simulated(f"worn.toml {LOOP} --duration 8 --seed 5", *PRESSURES),
    "worn2.csv": _simulated(f"worn.toml {LOOP} --duration 6 --seed 8", *PRESSURES),
    "logs": _folder({name: name for name in ("friction.csv", "fits.csv", "note.csv")}),
    "machines": _folder(
        {
            "lift/rig.toml": "bench.toml",
            "lift/run.csv": "more_friction.csv",
            "press/rig.toml": "bench.toml",
            "press/run.csv": "friction.csv",
            "shear/rig.toml": "bench.toml",
            "shear/run.csv": "fits.csv",
            "torn/rig.toml": "bench.toml",
            "torn/run.csv": "note.csv",
        }
    ),
}

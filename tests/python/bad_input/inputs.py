# SPDX-License-Identifier: MIT
"""Good inputs, from which the bad ones are made by one change each."""

from __future__ import annotations

import os
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from sources import ROOT

BENCH = (ROOT / "examples" / "rigs" / "bench.toml").read_text("utf-8")
AXIS = """\
name = "axis"
plant = "axis"

[axis]
mass_kg = 100.0
viscous_friction_n_s_m = 200.0
force_per_volt = 50.0
"""


def signals(samples: int, dt_s: float = 1e-3) -> dict[str, np.ndarray[Any, Any]]:
    """Columns of a short run: random steps of the command, and an integrator behind them."""
    rng = np.random.default_rng(5)
    command = np.repeat(rng.uniform(-3.0, 3.0, -(-samples // 8)), 8)[:samples]
    position = 0.15 + 0.02 * dt_s * np.cumsum(command)
    return {"time_s": dt_s * np.arange(samples), "command_v": command, "position_m": position}


def csv(columns: dict[str, Any]) -> str:
    """CSV with a fixed number of decimals."""
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(f"{value:.9f}" for value in row) for row in rows]
    return "\n".join([",".join(columns), *lines]) + "\n"


GOOD = "time_s,command_v,position_m\n" + "".join(f"{k / 10},{k},0.{k}\n" for k in range(6))
LONG = csv(signals(400))


def made(write: Callable[[Any], None]) -> bytes:
    """The bytes that a function writes into a file."""
    file = BytesIO()
    write(file)
    return file.getvalue()


def npz(**arrays: Any) -> bytes:
    return made(lambda file: np.savez(file, **arrays))


def mat(**arrays: Any) -> bytes:
    import scipy.io

    return made(lambda file: scipy.io.savemat(file, arrays))


def parquet(**columns: Any) -> bytes:
    import polars as pl

    return made(lambda file: pl.DataFrame(columns).write_parquet(file))


def a_folder(path: Path) -> None:
    path.mkdir()


def a_pipe(path: Path) -> None:
    os.mkfifo(path)


def a_link_to(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)

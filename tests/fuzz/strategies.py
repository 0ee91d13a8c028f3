# SPDX-License-Identifier: MIT
"""Hypothesis strategies for records, rig files and options, most of them nearly good."""

from __future__ import annotations

import io
import tempfile
import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import scipy.io
import tomli_w
import typer.main
from commands import Example
from hypothesis import strategies as st

from ehsid.harness.cli import cli
from ehsid.harness.records import make_record, write_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import simulate

ROOT = Path(__file__).parents[2]
RIGS = {name: ROOT / "examples" / "rigs" / name for name in ("bench.toml", "axis.toml")}
ENDINGS = ("csv", "csv.gz", "npz", "mat", "parquet")
SAMPLES = 200
DT_S = 5e-3

# Names and numbers that programs have stumbled over.
ODD_TEXT = (
    "",
    " ",
    "-",
    "--",
    "nan",
    "[/red]",
    "[bold]x",
    "{{ 7 * 7 }}",
    "<script>alert(1)</script>",
    "a\nb",
    "x" * 300,
    "\u0663",
    "\ufeff",
    "../up",
    "/dev/null",
    "con",
    "é",
)
ODD_NUMBERS = (
    0.0,
    -0.0,
    -1.0,
    1e-300,
    5e-324,
    1e12,
    1e38,
    1e300,
    -1e300,
    float("inf"),
    float("-inf"),
    float("nan"),
)
ODD_WHOLE = (0, -1, 1, 7, 21, 2**31 - 1, 2**31, 2**63, 10**22, -(10**22))


@cache
def good_columns() -> dict[str, np.ndarray]:
    """A short record of the bench: time, command, position and both pressures."""
    command = 3.0 * np.sign(np.sin(2.0 * np.pi * 3.0 * np.arange(SAMPLES) * DT_S + 0.1))
    record = simulate(read_rig(RIGS["bench.toml"]), command, dt_s=DT_S).record
    return {name: record.column(name) for name in ("command_v", "position_m")} | {
        "time_s": np.arange(SAMPLES) * DT_S
    }


@cache
def good_record(ending: str) -> bytes:
    """The bytes of that record in a format."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"record.{ending}"
        write_record(make_record(good_columns()), path)
        return path.read_bytes()


@st.composite
def damaged(draw: st.DrawFn, good: bytes) -> bytes:
    """The bytes with up to three parts replaced, removed, repeated or moved."""
    data = bytearray(good)
    for _ in range(draw(st.integers(1, 3))):
        start = draw(st.integers(0, max(len(data) - 1, 0)))
        stop = min(start + draw(st.integers(0, 64)), len(data))
        match draw(st.sampled_from(("replace", "remove", "repeat", "cut", "flip"))):
            case "replace":
                data[start:stop] = draw(st.binary(max_size=24))
            case "remove":
                del data[start:stop]
            case "repeat":
                data[start:start] = data[start:stop] * draw(st.integers(1, 40))
            case "cut":
                del data[start:]
            case "flip":
                if data:
                    data[start % len(data)] ^= 1 << draw(st.integers(0, 7))
    return bytes(data)


odd_text = st.one_of(st.sampled_from(ODD_TEXT), st.text(max_size=20))
odd_number = st.one_of(st.sampled_from(ODD_NUMBERS), st.floats())


CHANGES = ("number", "constant", "scale", "rename", "drop", "add", "cut")


@st.composite
def odd_columns(draw: st.DrawFn) -> dict[str, np.ndarray]:
    """The good columns with some changed, renamed, left out or added."""
    columns = {name: values.copy() for name, values in good_columns().items()}
    for _ in range(draw(st.integers(1, 3))):
        name = draw(st.sampled_from(sorted(columns)))
        values = columns[name]
        match draw(
            st.sampled_from(("number", "constant", "scale", "rename", "drop", "add", "cut"))
        ):
            case "number" if values.size:
                values[draw(st.integers(0, values.size - 1))] = draw(odd_number)
            case "constant":
                values[:] = draw(odd_number)
            case "scale":
                with np.errstate(all="ignore"):
                    values *= draw(odd_number)
            case "rename":
                columns[draw(odd_text)] = columns.pop(name)
            case "drop" if len(columns) > 1:
                del columns[name]
            case "add":
                columns[draw(odd_text)] = np.full(values.shape, draw(odd_number))
            case "cut":
                rows = draw(st.integers(0, 12))
                columns = {key: column[:rows] for key, column in columns.items()}
            case _:
                pass
    return columns


def _csv_text(columns: dict[str, np.ndarray], separator: str) -> bytes:
    lines = [separator.join(columns)]
    lines += [
        separator.join(repr(float(value)) for value in row)
        for row in zip(*columns.values(), strict=False)
    ]
    return "\n".join(lines).encode("utf-8", "surrogatepass")


@st.composite
def odd_table(draw: st.DrawFn, ending: str) -> bytes:
    """A well-formed file of a table that is none of ours, or nearly ours."""
    columns = draw(odd_columns())
    buffer = io.BytesIO()
    if ending in ("csv", "csv.gz"):
        return _csv_text(columns, draw(st.sampled_from((",", ";", "\t", ", "))))
    kind = draw(st.sampled_from((np.float64, np.float32, np.int64, np.complex128, np.bool_, str)))
    with np.errstate(all="ignore"):
        typed = {name: values.astype(kind) for name, values in columns.items()}
    try:
        if ending == "npz":
            shaped = draw(st.sampled_from(("as they are", "square", "one number")))
            if shaped == "square":
                typed = {name: np.atleast_2d(values) for name, values in typed.items()}
            elif shaped == "one number":
                typed = {name: values[:1].reshape(()) for name, values in typed.items()}
            np.savez(buffer, **{name or "empty": values for name, values in typed.items()})
        elif ending == "mat":
            scipy.io.savemat(buffer, {name or "empty": v for name, v in typed.items()})
        else:
            pl.DataFrame({name: values.tolist() for name, values in columns.items()}).write_parquet(
                buffer
            )
    except (ValueError, TypeError, OSError, pl.exceptions.PolarsError):
        return good_record(ending)  # the format cannot hold such names or numbers
    return buffer.getvalue()


# Each with the record in place of RECORD.
RECORD_COMMANDS = (
    ("identify", "RECORD"),
    ("identify", "RECORD", "--input", "command_v", "--output", "position_m"),
    ("estimate", "RECORD", "--out", "estimates.csv"),
    ("export", "RECORD", "--out", "servo.hpp"),
    ("simulate", "bench.toml", "--command", "RECORD", "--out", "simulated.csv"),
    ("gap", "RECORD", "--rig", "bench.toml", "--out", "out"),
)


@st.composite
def records(draw: st.DrawFn) -> Example:
    """A command on a record whose bytes or whose table are odd."""
    ending = draw(st.sampled_from(ENDINGS))
    good = good_record(ending)
    data = draw(st.one_of(damaged(good), odd_table(ending)))
    named = f"record.{draw(st.sampled_from(ENDINGS)) if draw(st.integers(0, 9)) == 0 else ending}"
    command = draw(st.sampled_from(RECORD_COMMANDS))
    files = {named: data, "bench.toml": RIGS["bench.toml"].read_bytes()}
    return Example([named if part == "RECORD" else part for part in command], files)


odd_value = st.one_of(
    odd_number,
    st.sampled_from(ODD_WHOLE[:-3]),
    odd_text.filter(lambda text: "\r" not in text),
    st.booleans(),
    st.lists(st.integers(-1, 1), max_size=3),
    st.just({}),
)


@st.composite
def odd_rig(draw: st.DrawFn) -> bytes:
    """A rig file of the examples with some keys changed, removed or added, or damaged bytes."""
    name = draw(st.sampled_from(sorted(RIGS)))
    if draw(st.booleans()):
        return draw(damaged(RIGS[name].read_bytes()))
    rig = tomllib.loads(RIGS[name].read_text(encoding="utf-8"))
    for _ in range(draw(st.integers(1, 3))):
        tables = [rig, *(value for value in rig.values() if isinstance(value, dict))]
        table = draw(st.sampled_from(tables))
        keys = sorted(table)
        match draw(st.sampled_from(("change", "remove", "add"))):
            case "change" if keys:
                table[draw(st.sampled_from(keys))] = draw(odd_value)
            case "remove" if keys:
                del table[draw(st.sampled_from(keys))]
            case _:
                table[draw(odd_text)] = draw(odd_value)
    return tomli_w.dumps(rig).encode("utf-8", "surrogatepass")


RIG_COMMANDS = (
    ("simulate", "rig.toml", "--excitation", "prbs", "--duration", "0.5", "--out", "made.csv"),
    ("simulate", "rig.toml", "--command", "record.csv", "--out", "made.csv"),
    ("gap", "record.csv", "--rig", "rig.toml", "--out", "out"),
)


@st.composite
def rigs(draw: st.DrawFn) -> Example:
    """A command on an odd rig."""
    files = {"rig.toml": draw(odd_rig()), "record.csv": good_record("csv")}
    return Example(draw(st.sampled_from(RIG_COMMANDS)), files)


# Those whose work is short, or is left out by `commands.check`.
OPTION_COMMANDS = ("identify", "estimate", "export", "simulate", "inject", "gap", "effects")
# Small numbers, and absurd ones. Those in between are allowed, and keep a command busy.
VALUES = (
    *("0", "1", "2", "3", "5", "0.01", "0.5", "-1", "-0.5", "nan", "inf", "-inf", "1e300"),
    *("1e-300", "1e22", "99999999999999999999999", "\u0663", "0x10", "1_0", "true", "None"),
    *ODD_TEXT,
    *("record.csv", "bench.toml", "none.csv", ".", "out/made.csv", "out.npz", "out.html"),
    *("command_v", "position_m", "time_s", "multisine", "prbs", "steps", "chirp", "triangle"),
    *("constant", "f-ratio", "exponential", "coulomb_friction", "coulomb_friction.force_n=400"),
    *("valve_dead_band.overlap=0.04", "coulomb_friction.force_n=nan", "x=1", "=", "a.b=c"),
)


@cache
def _options(command: str) -> tuple[str, ...]:
    """Names of all options of a command; --dask would look for a cluster."""
    verb: Any = typer.main.get_command(cli)
    context = verb.commands[command].make_context(command, [], resilient_parsing=True)
    names = [name for one in context.command.params for name in (*one.opts, *one.secondary_opts)]
    return tuple(name for name in names if name.startswith("-") and name != "--dask")


@st.composite
def options(draw: st.DrawFn) -> Example:
    """Any command with some of its options and odd values."""
    command = draw(st.sampled_from(OPTION_COMMANDS))
    arguments = [command]
    if draw(st.integers(0, 3)) > 0:
        arguments.append(draw(st.sampled_from(("record.csv", "bench.toml", "none.csv", "."))))
    for _ in range(draw(st.integers(0, 5))):
        arguments.append(draw(st.sampled_from(_options(command))))
        if draw(st.integers(0, 4)) > 0:
            arguments.append(draw(st.sampled_from(VALUES)))
    files = {"record.csv": good_record("csv"), "bench.toml": RIGS["bench.toml"].read_bytes()}
    return Example(arguments, files)


TARGETS = {"records": records, "rigs": rigs, "options": options}

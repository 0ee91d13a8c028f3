# SPDX-License-Identifier: MIT
"""Records that can be read, and are of no use to the command that gets them."""

from __future__ import annotations

import numpy as np
from bad_input.case import Case, Content, command
from bad_input.inputs import AXIS, BENCH, GOOD, LONG, csv, signals

TITLE = "Records of no use to a command"
ABOUT = "These records are valid. The command needs something that they do not contain."

ONE = signals(400)
SHORT = csv({name: values[:30] for name, values in ONE.items()})
CONSTANT_COMMAND = csv(ONE | {"command_v": np.ones(400)})
CONSTANT_POSITION = csv(ONE | {"position_m": np.full(400, 0.15)})
WITH_HOLE = csv({name: np.delete(values, slice(200, 230)) for name, values in ONE.items()})
BY_CHANCE = csv(
    ONE | {"time_s": np.cumsum(np.random.default_rng(1).exponential(0.1, ONE["time_s"].size))}
)
NO_TIME = csv({name: ONE[name] for name in ("command_v", "position_m")})
NO_POSITION = csv({name: ONE[name] for name in ("time_s", "command_v")})
HUGE = csv(ONE | {"position_m": ONE["position_m"] * 1e300})
OUTSIDE = csv(ONE | {"position_m": ONE["position_m"] + 5.0})
MAPPED = BENCH + '\n[columns]\nposition_m = { name = "Stroke", unit = "mm" }\n'


def given(
    wrong: str,
    line: str,
    record: str,
    *,
    files: dict[str, Content] | None = None,
    writes: tuple[str, ...] = (),
    library: str | None = None,
) -> Case:
    """A record beside a rig, given to a command."""
    there: dict[str, Content] = {"record.csv": record}
    if "rig.toml" in line:
        there["rig.toml"] = BENCH
    files = there | (files or {})
    return command(wrong, line, files=files, writes=writes, library=library)


GAP = "ehsid gap record.csv --rig rig.toml --out out"
INJECT = "ehsid inject record.csv --rig rig.toml --out new.csv"
SIMULATE = "ehsid simulate rig.toml --command record.csv --out new.csv"

CASES = (
    given("too few samples", "ehsid identify record.csv", SHORT),
    given("too few samples", "ehsid estimate record.csv", GOOD),
    given("too few samples", "ehsid export record.csv", GOOD),
    given("a command that is constant", "ehsid identify record.csv", CONSTANT_COMMAND),
    given("a command that is constant", "ehsid estimate record.csv", CONSTANT_COMMAND),
    given("a command that is constant", "ehsid export record.csv", CONSTANT_COMMAND),
    given("a position that is constant", "ehsid identify record.csv", CONSTANT_POSITION),
    given("a position that is constant", "ehsid estimate record.csv", CONSTANT_POSITION),
    given("a position that is constant", "ehsid export record.csv", CONSTANT_POSITION),
    given("rows by chance", "ehsid identify record.csv", BY_CHANCE),
    given("rows by chance", "ehsid estimate record.csv", BY_CHANCE),
    given("numbers of 1e299", "ehsid identify record.csv", HUGE),
    given("numbers of 1e299", "ehsid estimate record.csv", HUGE),
    given("numbers of 1e299", "ehsid export record.csv", HUGE),
    given("an input that is not there", "ehsid identify record.csv --input u", LONG),
    given("an output that is not there", "ehsid estimate record.csv --output positon_m", LONG),
    given("one column for input and output", "ehsid identify record.csv --input position_m", LONG),
    given("time for the input", "ehsid identify record.csv --input time_s", LONG),
    given("no time", GAP, NO_TIME),
    given("no position", GAP, NO_POSITION),
    given("the same record twice", GAP.replace("gap", "gap record.csv"), LONG),
    given("the same record fitted and held out", GAP + " --validate record.csv", LONG),
    given(
        "a copy of the record held out",
        GAP + " --validate copy.csv",
        LONG,
        files={"copy.csv": LONG},
    ),
    given(
        "two records of one name in folders of one name",
        GAP.replace("record.csv", "a/x/run.csv b/x/run.csv"),
        LONG,
        files={"a/x/run.csv": LONG, "b/x/run.csv": GOOD},
    ),
    given(
        "a position without a unit",
        GAP,
        "time_s,command_v,Position\n0,1,2\n0.1,1,2\n0.2,1,2\n",
    ),
    given(
        "names of the logger that the rig does not have",
        GAP,
        LONG.replace("position_m", "Hub"),
        files={"rig.toml": MAPPED},
    ),
    given("no time", SIMULATE, NO_TIME),
    given("no command", SIMULATE, LONG.replace("command_v", "q")),
    given("a hole in the command", SIMULATE, WITH_HOLE),
    given("a command of 1e299 V", SIMULATE, csv(ONE | {"command_v": 1e299 * ONE["command_v"]})),
    given("no effect to put in", INJECT, LONG),
    given("no time", INJECT + " --effect gain --set factor=1.1", NO_TIME),
    given("no position", INJECT + " --effect gain --set factor=1.1", NO_POSITION),
    given(
        "a delay longer than the record", INJECT + " --effect transport_delay --set delay_s=9", LONG
    ),
    given(
        "a dead band wider than the command",
        INJECT + " --effect valve_dead_band --set overlap=0.99",
        LONG,
    ),
    given(
        "an effect of the valve on an axis",
        INJECT + " --effect valve_dead_band --set overlap=0.04",
        LONG,
        files={"rig.toml": AXIS},
    ),
    given(
        "no time",
        "ehsid experiment --record record.csv --out out",
        NO_TIME,
        writes=("out",),
        library=r"(?<=no sound model: ).*(?=; see out)",
    ),
    given(
        "too few samples", "ehsid experiment --record record.csv --out out", SHORT, writes=("out",)
    ),
    given(
        "a record of an axis for the published experiment",
        "ehsid experiment --rig rig.toml --out out",
        GOOD,
        files={"rig.toml": AXIS},
    ),
    given(
        "a machine whose record cannot be read",
        "ehsid gap-fleet machines --out out",
        GOOD,
        files={"machines/m1/rig.toml": BENCH, "machines/m1/run.csv": "no log\nat all\n"},
        writes=("out",),
    ),
)

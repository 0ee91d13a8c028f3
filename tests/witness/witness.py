# SPDX-License-Identifier: MIT
"""Keeps what the commands write, and tells which lines of it have changed: see README.md.

python tests/witness/witness.py record|compare [DIR] [--only NAME ...]
"""

from __future__ import annotations

import argparse
import difflib
import shutil
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from inputs import INPUTS, ROOT, LeftOutError, ehsid, made
from plain_text import NUMBER, Plain, brief, same

KEPT = Path(__file__).parent / "kept"
WHOLE, FITTED = 6, 4  # significant digits that are kept: of plain arithmetic, of an optimiser
PRESS = "--map command_v=CHANNEL2 --map position_m=CHANNEL0"
CRANE = "crane.csv --input valve_opening --output oil_pressure"

HEAD = "==== "  # of a section in a kept file
Sections = dict[str, list[str]]  # the lines of a command and of each of its files, by their heads


class Command(NamedTuple):
    """Commands that are run one after the other in one folder, each without `ehsid`."""

    name: str
    lines: tuple[str, ...]
    digits: int = WHOLE
    brief: tuple[str, ...] = ()  # files of which only a sum is kept


def _imported(log: str, out: str = "record.csv") -> Command:
    name = log.partition(".")[2]
    return Command(f"import_{name}", (f"import {log} --out {out}",))


COMMANDS = (
    Command("help", ("--help", "gap --help", "effects")),
    _imported("prüfstand.txt"),
    _imported("run.xlsx"),
    _imported("run.parquet", "record.parquet"),
    _imported("run.npz", "record.npz"),
    _imported("run.mat", "record.mat"),
    _imported("run.h5"),
    _imported("run.mf4"),
    _imported("run.tdms"),
    _imported("run.mcap"),
    _imported("run.bag"),
    Command("import_mapped", (f"import press.txt {PRESS} --dt 0.002 --json --out record.csv",)),
    Command("identify", ("identify friction.csv --orders 2-4 --out out",)),
    Command("identify_no_time", (f"identify {CRANE} --json",)),
    Command("estimate", ("estimate friction.csv --out out",)),
    Command("estimate_no_time", (f"estimate {CRANE} --na 2 --nb 2 --forgetting f-ratio --json",)),
    Command("estimate_riv", ("estimate fits.csv --method riv",)),
    Command("estimate_folder", ("estimate logs --out out",)),
    Command(
        "simulate",
        ("simulate bench.toml --excitation multisine --loop pi --noise --seed 7 --out sim.csv",),
    ),
    Command(
        "simulate_command",
        ("simulate bench.toml --command slow.csv --effect valve_dead_band.overlap=0.02 --json",),
    ),
    Command("simulate_axis", ("simulate axis.toml --excitation steps --out sim.parquet",)),
    Command(
        "inject",
        (
            "inject fits.csv --rig bench.toml --effect valve_dead_band --set overlap=0.04 "
            "--out dead_band.csv",
        ),
    ),
    Command(
        "rig_new",
        (
            "rig new --bore 63mm --rod 35mm --stroke 300mm --supply 120bar --rated-flow 38l/min "
            "--mass 120kg --out rig.toml",
            "rig new --plant axis --mass 95kg --force-gain 35N/V --out motor.toml",
        ),
    ),
    Command(
        "rig_check",
        ("rig check bench.toml fits.csv --out fits", "rig check larger.toml friction.csv"),
        FITTED,
    ),
    Command("gap_pressures", ("gap friction.csv --rig bench.toml --out out",), FITTED),
    Command("gap_position", ("gap late.csv --rig quick.toml --out out",), FITTED),
    Command(
        "gap_law",
        ("gap worn.csv --rig bench.toml --validate worn2.csv --fail-on any --out out",),
        FITTED,
    ),
    Command("gap_short", ("gap short.csv --rig bench.toml --out out",), FITTED),
    Command("gap_fleet", ("gap-fleet machines --out out",), FITTED, ("out/*/*",)),
    Command(
        "export",
        (
            "export fits.csv --out servo.hpp",
            "export fits.csv --identify --c --name press --out press.h",
            "export fits.csv --servo --out observed.hpp",
            "export fits.csv --servo --c --out observed.h",
        ),
    ),
    Command(
        "hil",
        ("hil --qemu servo_an386.elf --rig bench.toml --loop position --duration 5 --out out",),
    ),
    Command(
        "gap_check",
        ("gap-check --out out --count 4 --seconds 4 --seed 3",),
        FITTED,
        ("out/*/*", "out/*/*/*", "out/answers.json", "out/check.md"),
    ),
    Command("experiment", ("experiment --runs 20 --out out",)),
    Command("experiment_record", ("experiment --record fits.csv --out out",), brief=("*.json",)),
)


def run(command: Command, work: Path, version: str) -> Sections:
    """What the commands write, in a new folder below `work`; the inputs are kept beside it."""
    inputs, folder = work / "inputs", work / command.name
    inputs.mkdir(exist_ok=True)
    folder.mkdir()
    names = {str(folder): "<work>", str(work): "<work>", str(ROOT): "<root>"}
    plain = Plain(command.digits, {**names, version: "<version>"})
    given = {name for line in command.lines for name in line.split()} & set(INPUTS)
    for name in given:
        source = made(inputs / name)
        (shutil.copytree if source.is_dir() else shutil.copyfile)(source, folder / name)
    sections: Sections = {}
    for line in command.lines:
        done = ehsid(folder, line.split())
        sections[f"$ ehsid {line}"] = [f"exit code {done.returncode}"]
        sections[f"stdout of {line}"] = plain.text(done.stdout)
        sections[f"stderr of {line}"] = plain.text(done.stderr)
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder)
        if path.is_file() and name.parts[0] not in given and ".ehsid" not in name.parts:
            lines = plain.file(path)
            short = any(name.match(pattern) for pattern in command.brief)
            sections[f"file {name.as_posix()}"] = brief(lines) if short else lines
    return sections


def as_text(sections: Sections) -> str:
    lines = (line for head, body in sections.items() for line in (HEAD + head, *body))
    return "".join(f"{line}\n" for line in lines)


def from_text(text: str) -> Sections:
    sections: Sections = {}
    head = ""
    for line in text.split("\n")[:-1]:
        if line.startswith(HEAD):
            head = line.removeprefix(HEAD)
            sections[head] = []
        else:
            sections[head].append(line)
    return sections


def differences(name: str, old: Sections, new: Sections, digits: int) -> Iterator[str]:
    """The lines that differ by more than the rounding of a number, as a unified diff."""
    for head in dict.fromkeys((*old, *new)):
        one, other = old.get(head, []), list(new.get(head, []))
        texts = [[NUMBER.sub("#", line) for line in lines] for lines in (one, other)]
        matcher = difflib.SequenceMatcher(None, *texts, autojunk=False)
        for start, begin, size in matcher.get_matching_blocks():
            for k in range(size):
                if same(one[start + k], other[begin + k], digits):
                    other[begin + k] = one[start + k]
        yield from difflib.unified_diff(
            one, other, f"kept: {name}, {head}", f"now: {name}, {head}", lineterm=""
        )


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("mode", choices=("record", "compare"))
    parser.add_argument("folder", nargs="?", type=Path, default=KEPT)
    parser.add_argument("--only", nargs="+", metavar="NAME", help="commands whose names begin so")
    given = parser.parse_args(arguments)
    chosen = [one for one in COMMANDS if not given.only or one.name.startswith(tuple(given.only))]
    if not chosen:
        parser.error(f"expected names of {', '.join(one.name for one in COMMANDS)}")
    differ = False
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary).resolve()
        version = ehsid(work, ["--version"]).stdout.split()[-1]
        for command in chosen:
            kept = given.folder / f"{command.name}.txt"
            try:
                sections = run(command, work, version)
            except LeftOutError as error:
                print(f"{command.name} is left out: {error}", file=sys.stderr)
                continue
            if given.mode == "record":
                kept.parent.mkdir(parents=True, exist_ok=True)
                kept.write_text(as_text(sections), encoding="utf-8")
                continue
            old = from_text(kept.read_text(encoding="utf-8")) if kept.exists() else {}
            for line in differences(command.name, old, sections, command.digits):
                differ = True
                print(line, flush=True)
    return int(differ)


if __name__ == "__main__":
    sys.exit(main())

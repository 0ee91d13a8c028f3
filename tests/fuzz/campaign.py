# SPDX-License-Identifier: MIT
"""Runs all fuzz targets for a given time and reports what they found; started by script/fuzz.

The targets are dealt out to as many lanes as there are processor cores, and each lane divides the
time among its targets. What is kept between campaigns stands in build/fuzz/targets; a finding goes
to tests/fuzz/corpus/TARGET as well, where the ordinary tests run it again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import re
import secrets
import shutil
import subprocess
import sys
import threading
import time
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path

ROOT = Path(__file__).parents[2]
HERE = ROOT / "tests" / "fuzz"
WORK = ROOT / "build" / "fuzz"
PROGRAMS = WORK / "tests" / "fuzz"

COMPILED = ("restore", "c_calls", "frames")
COMMANDS = ("records", "rigs", "options")
RIG_TEXT = "rig_text"

PROGRESS_S = 20.0
MINIMISE_S = 30
# After its time libFuzzer finishes the running input, and hypothesis its smallest example.
GRACE_S = 1200.0
MOST_BYTES = 4096  # of one input
MEMORY_MB = 2048


@dataclass
class Outcome:
    """Result of one target."""

    target: str
    seconds: float
    executions: int
    coverage: str
    """Edges of the program that were reached (libFuzzer, atheris), or different answers of the
    commands."""
    findings: list[str]
    """Stored inputs, relative to the project."""

    @property
    def rate(self) -> float:
        """Executions per second."""
        return self.executions / self.seconds if self.seconds > 0 else 0.0


def keep(target: str, data: bytes, ending: str = "") -> str:
    """Stores an input that found something; returns its path relative to the project."""
    folder = HERE / "corpus" / target
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"found-{hashlib.sha256(data).hexdigest()[:12]}{ending}"
    path.write_bytes(data)
    return path.relative_to(ROOT).as_posix()


def command_of(target: str) -> list[str]:
    """The program of a target of libFuzzer or atheris, without options."""
    if target == RIG_TEXT:
        return [sys.executable, str(HERE / "fuzz_rig_text.py")]
    return [str(PROGRAMS / f"fuzz_{target}")]


def run_coverage_guided(target: str, seconds: float, seed: int) -> Outcome:
    """Runs libFuzzer or atheris; a finding ends the target and is made smaller."""
    folder = WORK / "targets" / target
    corpus, artefacts = folder / "corpus", folder / "artefacts"
    shutil.rmtree(artefacts, ignore_errors=True)
    for made in (corpus, artefacts):
        made.mkdir(parents=True, exist_ok=True)
    seeds = [HERE / "corpus" / target]
    more = []
    if target == RIG_TEXT:
        seeds.append(ROOT / "examples" / "rigs")
        more.append(f"-dict={HERE / 'rig_text.dict'}")
    log = folder / "log"
    began = time.monotonic()
    with log.open("w") as file:
        status = subprocess.run(
            [
                *command_of(target),
                f"-max_total_time={max(round(seconds), 1)}",
                f"-seed={seed}",
                f"-max_len={MOST_BYTES}",
                "-timeout=25",
                f"-rss_limit_mb={MEMORY_MB}",
                "-print_final_stats=1",
                f"-artifact_prefix={artefacts}/",
                *more,
                str(corpus),
                *(str(one) for one in seeds if one.is_dir()),
            ],
            stdout=file,
            stderr=subprocess.STDOUT,
            timeout=seconds + GRACE_S,
            check=False,
        ).returncode
    spent = time.monotonic() - began
    text = log.read_text(errors="replace")
    findings = [minimised(target, one) for one in sorted(artefacts.iterdir())]
    if status != 0 and not findings:
        print(text[-2000:], file=sys.stderr)
        raise SystemExit(f"ehsid: fuzz target {target} did not run; the end of its log is above")
    executions = _last(r"stat::number_of_executed_units: (\d+)", text) or _last(r"#(\d+)\t", text)
    edges = _last(r"cov: (\d+)", text)
    return Outcome(target, spent, int(executions or 0), f"{edges or 0} edges", findings)


def _last(pattern: str, text: str) -> str | None:
    found = re.findall(pattern, text)
    return found[-1] if found else None


def minimised(target: str, artefact: Path) -> str:
    """Makes an input smaller that found something, and stores it."""
    smaller = artefact.with_name(f"small-{artefact.name}")
    with (artefact.parent.parent / "minimise.log").open("w") as file:
        subprocess.run(
            [
                *command_of(target),
                "-minimize_crash=1",
                f"-max_total_time={MINIMISE_S}",
                f"-exact_artifact_path={smaller}",
                str(artefact),
            ],
            stdout=file,
            stderr=subprocess.STDOUT,
            check=False,
        )
    best = smaller if smaller.exists() else artefact
    return keep(target, best.read_bytes())


def run_commands(target: str, seconds: float, seed: int) -> Outcome:
    """Runs commands on what hypothesis makes, in a process of its own with a limit of memory."""
    folder = WORK / "targets" / target
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    began = time.monotonic()
    with (folder / "log").open("w") as file:
        process = subprocess.run(
            [
                sys.executable,
                HERE / "fuzz_commands.py",
                target,
                str(seconds),
                str(seed),
                str(folder),
            ],
            stdout=file,
            stderr=subprocess.STDOUT,
            timeout=seconds + GRACE_S,
            check=False,
        )
    spent = time.monotonic() - began
    findings = []
    if process.returncode != 0:
        # Without a finding the process has died: the example that was running is to blame.
        found = folder / "finding.json"
        blamed = found if found.exists() else folder / "running.json"
        print((folder / "log").read_text(errors="replace")[-2000:], file=sys.stderr)
        findings.append(keep(target, blamed.read_bytes(), ".json"))
    statistics = folder / "statistics.json"
    plain = json.loads(statistics.read_text()) if statistics.exists() else {}
    answers = f"{plain.get('answers', 0)} answers"
    return Outcome(target, spent, plain.get("executions", 0), answers, findings)


def run_target(target: str, seconds: float, seed: int) -> Outcome:
    """Runs one target for so many seconds."""
    run = run_commands if target in COMMANDS else run_coverage_guided
    return run(target, seconds, seed)


def run_lane(
    targets: list[str], seconds: float, seed: int, outcomes: dict[str, Outcome], now: list[str]
) -> None:
    """Runs targets one after the other; what one does not use is left to the next."""
    end = time.monotonic() + seconds
    for place, target in enumerate(targets):
        now.append(target)
        share = max(end - time.monotonic(), 1.0) / (len(targets) - place)
        outcomes[target] = run_target(target, share, seed)
        now.remove(target)


def table(outcomes: list[Outcome]) -> str:
    """The closing table, as Markdown."""
    rows = [
        "| target | seconds | executions | executions/s | coverage | findings |",
        "|---|---|---|---|---|---|",
    ]
    for one in outcomes:
        rows.append(
            f"| {one.target} | {one.seconds:.0f} | {one.executions} | {one.rate:.1f} "
            f"| {one.coverage} | {len(one.findings)} |"
        )
    return "\n".join(rows)


def main() -> int:
    """Runs all targets; exit code 1 where one of them found something."""
    parser = argparse.ArgumentParser(prog="script/fuzz", description="Fuzzes ehsid.")
    parser.add_argument("minutes", type=float, nargs="?", default=10.0, help="default: 10")
    parser.add_argument("--seed", type=int, help="of all targets; default: by chance")
    options = parser.parse_args()
    if not 0.0 < options.minutes < 1e6:
        parser.error(f"{options.minutes:g} minutes: expected a number above 0")
    seed = secrets.randbelow(2**31 - 1) + 1 if options.seed is None else options.seed
    seconds = 60.0 * options.minutes

    targets = [*COMMANDS, RIG_TEXT, *COMPILED]
    cores = len(os.sched_getaffinity(0))
    lanes = [lane for i in range(cores) if (lane := targets[i::cores])]
    print(f"{len(targets)} targets, {len(lanes)} at a time, {options.minutes:g} min, seed {seed}")
    outcomes: dict[str, Outcome] = {}
    running: list[str] = []
    failures: list[BaseException] = []

    def lane(mine: list[str]) -> None:
        try:
            run_lane(mine, seconds, seed, outcomes, running)
        except BaseException as error:  # shown by the main thread
            failures.append(error)

    threads = [threading.Thread(target=lane, args=(mine,), daemon=True) for mine in lanes]
    began = time.monotonic()
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        time.sleep(min(PROGRESS_S, seconds / 4))
        left = max(seconds - (time.monotonic() - began), 0.0)
        print(f"{left:4.0f} s left; done {len(outcomes)}; now {', '.join(running)}", flush=True)
    if failures:
        raise failures[0]

    done = [outcomes[target] for target in targets]
    (WORK / "results.json").write_text(
        json.dumps(
            {
                "minutes": options.minutes,
                "cores": cores,
                "seed": seed,
                "targets": [asdict(one) for one in done],
            },
            indent=1,
        )
        + "\n"
    )
    when = f"{date.today()}, seed {seed}"
    heading = f"{options.minutes:g} minutes on {cores} processor cores, {when}."
    (WORK / "results.md").write_text(f"{heading}\n\n{table(done)}\n")
    print(table(done))
    found = [path for one in done for path in one.findings]
    for path in found:
        print(f"found, made small and stored: {path}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

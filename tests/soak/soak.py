# SPDX-License-Identifier: MIT
"""Runs the soaks for a given time and reports what they measured; started by script/soak.

Each soak goes on where the last call ended: its state stands in build/soak/state. One processor
core holds estimators all the time; another first runs hardware in the loop and fleets, and then
holds estimators too.
"""

from __future__ import annotations

import argparse
import json
import os
import secrets
import subprocess
import sys
import threading
import time
from datetime import date
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
HERE = ROOT / "tests" / "soak"
BUILD = ROOT / "build" / "soak"
STATE = BUILD / "state"

UPDATES = 1_000_000_000
SLICE_S = 20.0  # of one estimator; then it is the turn of another
LINE_SHARE, FLEETS_SHARE = 0.55, 0.2  # of the time of the second core
PROGRESS_S = 20.0
NEVER = 3000  # samples; held.cpp looks no further
MOST_MOVED = 1e-3
MOST_GROWTH_BYTES = 16 * 2**20
POLICIES = ("constant", "exponential", "error_driven", "f_ratio")


class Holds:
    """The estimators that are held, each in a process of its own while it is its turn."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._busy: set[tuple[str, bool]] = set()
        self.results: dict[tuple[str, bool], dict[str, Any]] = {}
        for policy in POLICIES:
            for reset in (False, True):
                self._run((policy, reset), 0.0)  # reads the state of the call before

    def soak_until(self, end: float) -> None:
        """Lets one estimator after the other have its turn."""
        while (left := end - time.monotonic()) > 1.0 and (turn := self._next()) is not None:
            try:
                self._run(turn, min(SLICE_S, left))
            finally:
                self._busy.discard(turn)

    def updates(self) -> int:
        """Held updates of all estimators."""
        return sum(one["held"] for one in self.results.values())

    def _next(self) -> tuple[str, bool] | None:
        with self._lock:
            waiting = [
                (len(result["checkpoints"]), reset, result["held"], policy)
                for (policy, reset), result in self.results.items()
                if (policy, reset) not in self._busy and result["held"] < UPDATES
            ]
            if not waiting:
                return None
            # First those that have passed the fewest checkpoints, and those without the reset.
            _, reset, _, policy = min(waiting)
            self._busy.add((policy, reset))
            return policy, reset

    def _run(self, turn: tuple[str, bool], seconds: float) -> None:
        policy, reset = turn
        word = "reset" if reset else "no_reset"
        printed = subprocess.run(
            [
                BUILD / "tests" / "soak" / "soak_held",
                policy,
                word,
                STATE / f"{policy}-{word}",
                str(seconds),
            ],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        self.results[turn] = json.loads(printed)


def judged(result: dict[str, Any]) -> dict[str, Any]:
    """A result of soak_held with the goals of each checkpoint.

    The estimator shall come back after the hold as fast as without it: in the median no later than
    the slowest of the 41 returns without a hold. With the reset: within 20 samples in the median.
    """
    checkpoints = result["checkpoints"]
    before = checkpoints[0]
    judged_ones = []
    for one in checkpoints:
        goal = 20 if result["reset"] else before["worst_back"]
        judged_ones.append(
            one
            | {
                "goal_back": goal,
                # Who never comes back without a hold either has nothing to be compared with.
                "back_met": one["median_back"] <= goal,
                "moved_met": one["moved"] <= MOST_MOVED,
                "lost": not one["finite"] or (one["median_back"] >= NEVER > before["median_back"]),
            }
        )
    return result | {"checkpoints": judged_ones}


def run_python(program: str, *arguments: str | Path | float) -> None:
    """One of the soaks in Python; what did not hold stands in its state."""
    environment = os.environ | {
        "PYTHONPATH": str(ROOT / "tests" / "python"),
        "OPENBLAS_NUM_THREADS": "1",
    }
    command = [sys.executable, str(HERE / program), *map(str, arguments)]
    status = subprocess.run(command, env=environment, check=False).returncode
    if status not in (0, 1):
        raise SystemExit(f"ehsid: {program} ended with {status}; its message stands above")


def read_state(name: str) -> dict[str, Any]:
    """What a soak in Python has counted so far; empty before its first run."""
    path = STATE / name
    plain: dict[str, Any] = json.loads(path.read_text()) if path.exists() else {}
    return plain


def table(holds: list[dict[str, Any]]) -> str:
    """The holds as Markdown."""
    rows = [
        "| policy | reset | held | back, samples: median (slowest) | goal | parameters moved | "
        "goal | excitation | met |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for one in holds:
        for seen in one["checkpoints"]:
            median, worst = (
                "never" if seen[name] >= NEVER else seen[name]
                for name in ("median_back", "worst_back")
            )
            goal = "-" if seen["goal_back"] >= NEVER else seen["goal_back"]
            met = seen["finite"] and seen["back_met"] and seen["moved_met"]
            word = "-" if seen["held"] == 0 else "yes" if met else "**no**"
            rows.append(
                f"| {one['policy']} | {'yes' if one['reset'] else 'no'} | {seen['held']:.0e} "
                f"| {median} ({worst}) | {goal} | {seen['moved']:.1e} | {MOST_MOVED:g} "
                f"| {seen['excitation']:.2g} | {word} |"
            )
    return "\n".join(rows)


def summary(line: dict[str, Any], fleets: dict[str, Any], holds: list[dict[str, Any]]) -> str:
    """The other soaks as Markdown."""
    faults = sum(line.get("faults", {}).values())
    held = [one["held"] for one in holds]
    return "\n".join(
        [
            "| soak | done | disturbed by | did not hold |",
            "|---|---|---|---|",
            f"| held float32 updates | {sum(held):.3g} in {len(held)} estimators, "
            f"{min(held):.2g} to {max(held):.2g} in each | - "
            f"| {sum(seen['lost'] for one in holds for seen in one['checkpoints'])} checkpoints "
            "not finite or never back |",
            f"| samples of hardware in the loop | {line.get('samples', 0)} in "
            f"{line.get('runs', 0)} runs | {faults} faults on the line, "
            f"{line.get('resets', 0)} resets | {len(line.get('problems', []))}; memory grew by "
            f"{line.get('memory_growth_bytes', 0) / 2**20:.1f} MiB |",
            f"| fleets | {fleets.get('rounds', 0)}, with {fleets.get('machines', 0)} machines "
            f"in all | {fleets.get('kills', 0)} kills | {len(fleets.get('problems', []))} |",
        ]
    )


def main() -> int:
    """Runs all soaks; exit code 1 where something did not hold."""
    parser = argparse.ArgumentParser(prog="script/soak", description="Soaks ehsid.")
    parser.add_argument("minutes", type=float, nargs="?", default=10.0, help="default: 10")
    parser.add_argument("--seed", type=int, help="of faults and kills; default: by chance")
    options = parser.parse_args()
    if not 0.0 < options.minutes < 1e6:
        parser.error(f"{options.minutes:g} minutes: expected a number above 0")
    seed = secrets.randbelow(2**31) if options.seed is None else options.seed
    seconds = 60.0 * options.minutes
    STATE.mkdir(parents=True, exist_ok=True)
    began = time.monotonic()
    end = began + seconds
    print(f"{options.minutes:g} min, seed {seed}", flush=True)
    holds = Holds()
    beside = ["hardware in the loop"]  # what the second core does
    failures: list[BaseException] = []

    def first_core() -> None:
        holds.soak_until(end)

    def second_core() -> None:
        servo = BUILD / "tests" / "soak" / "soak_servo"
        run_python("line_with_faults.py", servo, STATE / "line.json", LINE_SHARE * seconds, seed)
        beside[0] = "fleets"
        run_python("killed_fleets.py", STATE / "fleets.json", FLEETS_SHARE * seconds, seed)
        beside[0] = "estimators"
        holds.soak_until(end)

    def kept(work: Any) -> None:
        try:
            work()
        except BaseException as error:  # shown by the main thread
            failures.append(error)

    threads = [
        threading.Thread(target=kept, args=(work,), daemon=True)
        for work in (first_core, second_core)
    ]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        time.sleep(min(PROGRESS_S, seconds / 4))
        left = max(end - time.monotonic(), 0.0)
        print(
            f"{left:4.0f} s left; {holds.updates():.2e} held updates; beside them: {beside[0]}",
            flush=True,
        )
    if failures:
        raise failures[0]

    done = [judged(one) for one in holds.results.values()]
    line, fleets = read_state("line.json"), read_state("fleets.json")
    results = {
        "minutes": options.minutes,
        "seed": seed,
        "holds": done,
        "line": line,
        "fleets": fleets,
    }
    (BUILD / "results.json").write_text(json.dumps(results, indent=1) + "\n")
    page = f"{summary(line, fleets, done)}\n\n{table(done)}\n"
    heading = f"The last call: {options.minutes:g} minutes, {date.today()}, seed {seed}."
    (BUILD / "results.md").write_text(f"{heading}\n\n{page}")
    print(page)
    problems = [*line.get("problems", []), *fleets.get("problems", [])]
    if line.get("memory_growth_bytes", 0) > MOST_GROWTH_BYTES:
        problems.append("hardware in the loop: the memory grows")
    problems += [
        f"{one['policy']}, {'with' if one['reset'] else 'without'} reset: not finite or never back "
        f"after {seen['held']:.0e} held samples"
        for one in done
        for seen in one["checkpoints"]
        if seen["lost"]
    ]
    for problem in problems:
        print(f"did not hold: {problem}")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())

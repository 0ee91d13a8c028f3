# SPDX-License-Identifier: MIT
"""Soak of fleets: killed at random moments and resumed, until all machines are diagnosed.

    python tests/soak/killed_fleets.py STATE SECONDS SEED

Each round runs a fleet of machines once without disturbance, and once killed again and again
(SIGKILL to the command alone, or to its worker processes too). Then the results are those of the
undisturbed run but for the seconds it took; no file is half-written; what was finished before a
kill was neither lost nor made again; and no worker process outlives its command. Adds to the JSON
file STATE; exit code 1 where something did not hold.
"""

from __future__ import annotations

import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

from interrupts import left_of_session
from made_diagnoses import bench, measured_record

from ehsid.harness.records import write_record
from ehsid.harness.rigs import write_rig

HERE = Path(__file__).parent
MACHINES = 8
# Their pages have the same bytes each time. The plots of an ambiguous diagnosis have identifiers
# that depend on what else the process has drawn.
VERDICTS = ("effects", "no_gap", "parameters")
KILLS = 5  # of a round, then it may end
LONGEST_S = 300.0  # of one run that is not killed
GONE_S = 30.0  # after a kill no process of the run is left, on a busy machine


def make_fleet(folder: Path) -> None:
    """Machines with a rig file and a record each."""
    for number in range(MACHINES):
        machine = folder / f"m{number}"
        machine.mkdir(parents=True)
        verdict = VERDICTS[number % len(VERDICTS)]
        write_rig(replace(bench(), name=f"{verdict}-m{number}"), machine / "rig.toml")
        record = measured_record("record", number, seconds=1.0, dt_s=5e-3)
        write_record(record, machine / "monday.csv")


def started(fleet: Path, out: Path, workers: int, log: Path) -> subprocess.Popen[bytes]:
    """The command, in a group of processes of its own."""
    with log.open("ab") as file:
        return subprocess.Popen(
            [sys.executable, HERE / "fleet_process.py", str(fleet), str(out), str(workers)],
            stdout=file,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )


def finished(out: Path) -> dict[str, tuple[int, int]]:
    """By machine with a result: identity of its diagnosis as a file, and when it was written."""
    found = {}
    for path in sorted(out.glob("*/inputs.json")):
        diagnosis = path.with_name("diagnosis.json")
        if diagnosis.is_file():
            status = diagnosis.stat()
            found[path.parent.name] = (status.st_ino, status.st_mtime_ns)
    return found


def contents(out: Path) -> dict[str, bytes]:
    """All files by path, without the times that a run took and the manifest of checksums."""
    found = {}
    for path in sorted(out.rglob("*")):
        name = path.relative_to(out).as_posix()
        if path.is_file() and path.name != ".ehsid":
            found[name] = re.sub(rb'"seconds": [0-9.e+-]+', b'"seconds": 0', path.read_bytes())
    return found


def kill(process: subprocess.Popen[bytes], rng: random.Random) -> None:
    """Kills the command alone, or its whole group; its workers then end by themselves."""
    if rng.random() < 0.5:
        process.kill()
    else:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def one_round(rng: random.Random, state: dict) -> list[str]:
    """One fleet; what did not hold."""
    problems = []
    with tempfile.TemporaryDirectory(prefix="ehsid-soak-") as name:
        folder = Path(name)
        fleet, calm, killed, log = (folder / one for one in ("fleet", "calm", "killed", "log"))
        make_fleet(fleet)
        workers = rng.randint(1, 2)
        began = time.monotonic()
        if started(fleet, calm, workers, log).wait(LONGEST_S) != 0:
            return [f"the undisturbed run failed: {log.read_text()[-500:]}"]
        usual_s = time.monotonic() - began
        for _ in range(KILLS):
            before = finished(killed)
            process = started(fleet, killed, workers, log)
            try:
                process.wait(rng.uniform(0.1, 0.7) * usual_s)
            except subprocess.TimeoutExpired:
                kill(process, rng)
                state["kills"] += 1
                if left := left_of_session(process.pid, GONE_S):
                    problems.append(f"{len(left)} processes outlive a killed command by {GONE_S} s")
                    os.killpg(process.pid, signal.SIGKILL)
            after = finished(killed)
            lost = [machine for machine in before if after.get(machine) != before[machine]]
            if lost:
                problems.append(f"finished before a kill, and lost or made again: {lost}")
        status = started(fleet, killed, workers, log).wait(LONGEST_S)
        if status != 0:
            problems.append(f"the last run ended with {status}: {log.read_text()[-500:]}")
        expected, found = contents(calm), contents(killed)
        if parts := [one for one in found if ".part" in one]:
            problems.append(f"half-written files are left: {parts}")
        differ = [one for one in {*expected, *found} if expected.get(one) != found.get(one)]
        if differ:
            problems.append(f"not as in the undisturbed run: {sorted(differ)}")
    state["rounds"] += 1
    state["machines"] += MACHINES
    return problems


def main() -> int:
    """Runs rounds until the time is up, at least one; returns the exit code."""
    state_file, end, seed = Path(sys.argv[1]), time.monotonic() + float(sys.argv[2]), sys.argv[3]
    state = {"rounds": 0, "machines": 0, "kills": 0, "seconds": 0.0, "problems": []}
    if state_file.exists():
        state |= json.loads(state_file.read_text())
    rng = random.Random(f"{seed} {state['rounds']}")
    began = time.monotonic()
    while True:
        problems = one_round(rng, state)
        state["problems"] += [f"round {state['rounds']}, seed {seed}: {one}" for one in problems]
        if time.monotonic() >= end:
            break
    state["seconds"] += time.monotonic() - began
    state_file.write_text(json.dumps(state, indent=1) + "\n")
    return 1 if state["problems"] else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""What `ehsid gap-fleet --dask` costs beside the diagnoses: python benchmarks/fleet_dask.py

Starts a Dask scheduler and workers as processes of their own, on this machine, and runs a fleet
through the functions of the command, once with one worker and once with two:

- 1,000 machines, each with two records of 20 s at 1 kHz. A stand-in takes the place of the
  diagnosis: it sleeps for --seconds, and returns the files of a real diagnosis of such records. It
  sleeps, because on a cluster the workers do not share the cores of this machine.
- --real machines, each with two records of 4 s at 200 Hz, with the real diagnosis.
- 40 machines of the first kind, while one of the workers is killed.

Efficiency is the time with one worker over twice the time with two. "At work" is the share of the
time in which the workers had a case; it does not suffer where other programs take the cores. About
six minutes with the defaults; --json prints the figures, too.
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cloudpickle
import numpy as np
import psutil
from distributed import Client

from ehsid.harness.cli.gap_fleet import read_machine
from ehsid.harness.excitation import random_steps
from ehsid.harness.gap import diagnose
from ehsid.harness.gap.schema import Diagnosis
from ehsid.harness.parallel import on_cluster, workers
from ehsid.harness.records import Record, write_record
from ehsid.harness.report.diagnosis_files import write_diagnosis
from ehsid.harness.report.fleet_page import write_fleet
from ehsid.harness.rigs import Rig, read_rig, write_rig
from ehsid.harness.simulation import draw_noise, simulate
from ehsid.harness.validation.fleet.ranking import read_fleet
from ehsid.harness.validation.fleet.running import run_fleet, unfinished_machines
from ehsid.harness.validation.jobs import Diagnose, Outcome, Write

RIG = Path(__file__).parents[1] / "examples" / "rigs" / "bench.toml"
WAIT_S = 60.0


@dataclass(frozen=True)
class Figures:
    """One run of a fleet.

    Attributes
    ----------
    cases, failed, workers
        machines, those without a diagnosis, and workers.
    seconds
        from the first look at the folder to the last result.
    at_work
        share of the time of all workers in which they had a case.
    client_ms, scheduler_ms
        CPU time for each case in this process and in the scheduler, ms.
    worker_ms
        CPU time of the workers for each case, ms; with the stand-in all of it is overhead.
    scheduler_mb, worker_mb
        largest memory of the scheduler and of a worker, MB.
    """

    cases: int
    failed: int
    workers: int
    seconds: float
    at_work: float
    client_ms: float
    scheduler_ms: float
    worker_ms: float
    scheduler_mb: float
    worker_mb: float


def add_machine(folder: Path, rig: Rig, seconds: float, dt_s: float) -> None:
    """A machine with Coulomb friction: its rig file, a record to fit and one held out."""
    folder.mkdir(parents=True)
    write_rig(rig, folder / "rig.toml")
    for seed, name in enumerate(("monday", "validate_tuesday")):
        rng = np.random.default_rng(seed)
        size = round(seconds / dt_s)
        hold = (round(0.05 / dt_s), round(0.5 / dt_s))
        command = random_steps(size, amplitude=1.0, hold=hold, rng=rng)
        noise = draw_noise(rig, size, rng)
        values = {"effects.coulomb_friction.force_n": 400.0}
        run = simulate(rig, command, dt_s=dt_s, values=values, noise=noise)
        write_record(run.record, folder / f"{name}.csv")


def make_fleet(folder: Path, count: int, seconds: float, dt_s: float) -> list[Path]:
    """So many machines; their files are links to those of the first one."""
    first = folder / "machine00000"
    add_machine(first, read_rig(RIG), seconds, dt_s)
    for i in range(1, count):
        machine = folder / f"machine{i:05d}"
        machine.mkdir()
        for file in first.iterdir():
            os.link(file, machine / file.name)
    return sorted(folder.iterdir())


class StandIn:
    """Sleeps, and returns a diagnosis that was made before."""

    def __init__(self, kept: Path, seconds: float) -> None:
        self.kept = kept
        self.seconds = seconds

    def __call__(self, records: Sequence[Record], rig: Rig, **options: Any) -> Diagnosis:
        """As `ehsid.harness.gap.diagnose`."""
        time.sleep(self.seconds)
        return cloudpickle.loads((self.kept / "diagnosis.pickle").read_bytes())  # type: ignore[no-any-return]

    def write(self, folder: Path, *_: object) -> None:
        """As `write_diagnosis`: the files that it wrote for the diagnosis."""
        for file in (self.kept / "files").iterdir():
            (folder / file.name).write_bytes(file.read_bytes())


def kept_diagnosis(kept: Path, machine: Path) -> int:
    """Diagnoses a machine, keeps result and files, and returns the bytes of the files."""
    job = read_machine(machine)
    with workers(1):
        found = diagnose(list(job.fitted), job.rig, validate=list(job.held_out))
    (kept / "files").mkdir(parents=True)
    (kept / "diagnosis.pickle").write_bytes(cloudpickle.dumps(found))
    write_diagnosis(kept / "files", found, (*job.fitted, *job.held_out), job.rig_file)
    return sum(file.stat().st_size for file in (kept / "files").iterdir())


@contextmanager
def cluster(count: int) -> Iterator[tuple[str, psutil.Process, list[psutil.Process]]]:
    """Address, process of the scheduler, and processes that run the cases; ended afterwards."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scheduler.json"
        common = [f"--scheduler-file={file}", "--dashboard-address=:0"]
        module = [sys.executable, "-m"]
        commands = [[*module, "distributed.cli.dask_scheduler", "--port=0", *common]]
        one = [*module, "distributed.cli.dask_worker", "--nthreads=1", *common]
        commands += [[*one, f"--local-directory={folder}"] for _ in range(count)]
        started = [
            subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            for command in commands
        ]
        try:
            deadline = time.monotonic() + WAIT_S
            while not file.exists() and time.monotonic() < deadline:
                time.sleep(0.05)
            address = json.loads(file.read_text(encoding="utf-8"))["address"]
            with Client(address, set_as_default=False) as client:
                client.wait_for_workers(count, timeout=WAIT_S)
                running = [psutil.Process(pid) for pid in client.run(os.getpid).values()]
            yield address, psutil.Process(started[0].pid), running
        finally:
            for process in reversed(started):
                process.terminate()
            for process in started:
                process.wait(timeout=WAIT_S)


def cpu_s(process: psutil.Process) -> float:
    """CPU time of a process so far, s."""
    times = process.cpu_times()
    return float(times.user + times.system)


def peak_mb(process: psutil.Process) -> float:
    """The largest memory that a process has had, MB."""
    status = Path(f"/proc/{process.pid}/status")
    if status.exists():
        lines = status.read_text(encoding="ascii").splitlines()
        return int(next(line for line in lines if line.startswith("VmHWM")).split()[1]) / 1e3
    return float(process.memory_info().rss) / 1e6


def run(
    machines: list[Path],
    out: Path,
    count: int,
    diagnose: Diagnose,
    write: Write,
    after_each: Callable[[int, list[psutil.Process]], None] = lambda done, running: None,
) -> Figures:
    """One fleet with so many workers, from nothing to the page."""
    with cluster(count) as (address, scheduler, running), on_cluster(address):
        before = [cpu_s(scheduler), *map(cpu_s, running)]
        own, began = time.process_time(), time.monotonic()
        outcomes: list[Outcome] = []
        todo = unfinished_machines(machines, out, ())
        read = functools.partial(read_machine)
        for outcome in run_fleet(todo, out, (), read, diagnose, write):
            outcomes.append(replace(outcome, files={}))
            after_each(len(outcomes), running)
        seconds = time.monotonic() - began
        client_s = time.process_time() - own
        alive = [process for process in running if process.is_running()]
        after = [cpu_s(scheduler), *map(cpu_s, alive)]
        peaks = [peak_mb(scheduler), *map(peak_mb, alive)]
    out.mkdir(exist_ok=True)
    fleet = read_fleet(out, [machine.name for machine in machines], {})
    write_fleet(fleet, out)
    used = [late - early for late, early in zip(after, before, strict=False)]
    cases = len(outcomes)
    return Figures(
        cases,
        sum(outcome.failed for outcome in outcomes),
        count,
        seconds,
        sum(outcome.seconds for outcome in outcomes) / (count * seconds),
        1e3 * client_s / cases,
        1e3 * used[0] / cases,
        1e3 * sum(used[1:]) / cases,
        peaks[0],
        max(peaks[1:], default=float("nan")),
    )


def kill_once(done: int, running: list[psutil.Process]) -> None:
    """Kills the first worker behind the tenth case; its nanny starts another."""
    if done == 10:
        running[0].send_signal(signal.SIGKILL)


def row(words: str, figures: Figures) -> str:
    """A line of the table."""
    return (
        f"{words:34s} {figures.cases:6d} {figures.failed:6d} {figures.workers:7d} "
        f"{figures.seconds:8.1f} {figures.at_work:8.3f} {figures.client_ms:9.1f} "
        f"{figures.scheduler_ms:12.1f} {figures.worker_ms:9.1f} {figures.scheduler_mb:12.0f} "
        f"{figures.worker_mb:9.0f}"
    )


HEAD = (
    f"{'':34s} {'cases':>6s} {'failed':>6s} {'workers':>7s} {'s':>8s} {'at work':>8s} "
    f"{'client ms':>9s} {'scheduler ms':>12s} {'worker ms':>9s} "
    f"{'scheduler MB':>12s} {'worker MB':>9s}"
)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--machines", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=0.2, help="of the stand-in")
    parser.add_argument("--real", type=int, default=16, help="machines with the real diagnosis")
    parser.add_argument("--json", action="store_true")
    chosen = parser.parse_args()
    all_figures: list[Figures] = []
    with tempfile.TemporaryDirectory() as top:
        place = Path(top)
        short = make_fleet(place / "short", max(1, chosen.real), 4.0, 5e-3)
        long = make_fleet(place / "long", max(40, chosen.machines), 20.0, 1e-3)
        result_bytes = kept_diagnosis(place / "kept", short[0])
        stand_in = StandIn(place / "kept", chosen.seconds)
        task = functools.partial(run_fleet, read_machine(long[0]), stand_in, stand_in.write)
        print(f"bytes of a case: {len(cloudpickle.dumps(task)):,} there, {result_bytes:,} back")
        print(HEAD)

        def compared(words: str, machines: list[Path], diagnose: Diagnose, write: Write) -> None:
            both = []
            for count in (1, 2):
                out = place / f"{words}-{count}"
                both.append(run(machines, out, count, diagnose, write))
                print(row(words, both[-1]), flush=True)
            all_figures.extend(both)
            print(f"{words}: efficiency {both[0].seconds / (2.0 * both[1].seconds):.3f}")

        if chosen.machines:
            compared("stand-in", long[: chosen.machines], stand_in, stand_in.write)
        if chosen.real:
            compared("real diagnosis", short[: chosen.real], diagnose, write_diagnosis)
        killed = run(long[:40], place / "killed", 2, stand_in, stand_in.write, kill_once)
        print(row("one of two workers is killed", killed))
        all_figures.append(killed)
    if chosen.json:
        print(json.dumps([asdict(one) for one in all_figures], indent=1))


if __name__ == "__main__":
    main()

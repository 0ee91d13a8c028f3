# SPDX-License-Identifier: MIT
"""What `ehsid gap-fleet --dask` costs beside the diagnoses: python benchmarks/fleet_dask.py

Starts a Dask scheduler and workers as processes of their own, on this machine, and runs a fleet
through the functions of the command, once with one worker and once with two:

- --machines, each with two records of --length seconds at --rate. --real of them, spread evenly,
  get the real diagnosis (records of 4 s at 200 Hz). For the others a stand-in takes its place: it
  sleeps for --seconds, and returns the files of a real diagnosis. It sleeps, because on a cluster
  the workers do not share the cores of this machine.
- 40 of these machines, while one of the workers is killed.

Efficiency is the time with one worker over twice the time with two. "At work" is the share of the
time in which the workers had a case; it does not suffer where other programs take the cores.

--folder keeps everything that was done in this folder: after Ctrl-C or a kill the same command goes
on where it stopped, and the times of all sessions are added, each with the start of its cluster.
--json prints the figures, too.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cloudpickle
import numpy as np
import psutil
from distributed import Client

from ehsid.harness.base.files import write_text
from ehsid.harness.base.parallel import on_cluster, workers
from ehsid.harness.cli.gap_fleet import read_machine
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.fleet import read_fleet, run_fleet, unfinished_machines
from ehsid.harness.records import Record, write_record
from ehsid.harness.rigs import Rig, read_rig, write_rig
from ehsid.harness.show.fleet_page import write_fleet
from ehsid.harness.show.gap_page import write_diagnosis
from ehsid.harness.signals.excitation import random_steps
from ehsid.harness.signals.simulation import draw_noise, simulate

REAL, REAL_S, REAL_HZ = "real", 4.0, 200.0
RIG = Path(__file__).parents[1] / "examples" / "rigs" / "bench.toml"
WAIT_S = 60.0
KEEP_EVERY = 10  # cases between two notes of the times: a kill loses less than that


@dataclass(frozen=True)
class Session:
    """A part of a run of a fleet, from the first look at the folder to its last result."""

    cases: int
    failed: int
    """Machines that were finished, and those of them without a diagnosis."""
    seconds: float
    """Duration, s."""
    at_work_s: float
    """Time in which the workers had a case, s."""
    client_s: float
    scheduler_s: float
    worker_s: float
    """CPU time of this process, of the scheduler, and of all workers, s."""
    scheduler_mb: float
    worker_mb: float
    """Largest memory of the scheduler and of a worker, MB."""


@dataclass(frozen=True)
class Figures:
    """A run of a fleet: `workers`, and the sum of its sessions, with the largest memory."""

    name: str
    workers: int
    sessions: int
    total: Session

    @classmethod
    def of(cls, name: str, count: int, sessions: Sequence[Session]) -> Figures:
        """The figures of these sessions."""
        values = {
            field.name: (max if field.name.endswith("_mb") else sum)(
                getattr(one, field.name) for one in sessions
            )
            for field in fields(Session)
        }
        return cls(name, count, len(sessions), Session(**values))


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


def make_fleet(folder: Path, count: int, real: int, seconds: float, rate_hz: float) -> list[Path]:
    """So many machines, of which `real` ones have records for a real diagnosis.

    Their files are links to those of two machines. The rig of a real one is called REAL.
    """
    rig = read_rig(RIG)
    kinds = folder.with_name(f"{folder.name}-kinds")
    for name, length, hertz in (("stand-in", seconds, rate_hz), (REAL, REAL_S, REAL_HZ)):
        if not (kinds / name).exists():
            add_machine(kinds / name, replace(rig, name=name), length, 1.0 / hertz)
    machines = [folder / f"machine{i:05d}" for i in range(count)]
    every = count / real if real else count + 1
    chosen = {int((i + 0.5) * every) for i in range(real)}
    for i, machine in enumerate(machines):
        machine.mkdir(parents=True, exist_ok=True)
        for file in (kinds / (REAL if i in chosen else "stand-in")).iterdir():
            with contextlib.suppress(FileExistsError):
                os.link(file, machine / file.name)
    return machines


class StandIn:
    """Sleeps, and returns a diagnosis that was made before."""

    def __init__(self, kept: Path, seconds: float) -> None:
        self.kept = kept
        self.seconds = seconds
        self.real = False

    def __call__(self, records: Sequence[Record], rig: Rig, **options: Any) -> Diagnosis:
        """As `ehsid.harness.diagnosis.diagnose`, which it calls for the machines with REAL rigs."""
        self.real = rig.name == REAL
        if self.real:
            return diagnose(records, rig, **options)
        time.sleep(self.seconds)
        return cloudpickle.loads((self.kept / "diagnosis.pickle").read_bytes())  # type: ignore[no-any-return]

    def write(
        self, folder: Path, found: Diagnosis, records: Sequence[Record], rig_file: str
    ) -> None:
        """As `write_diagnosis`: the files that it wrote for the diagnosis that was kept."""
        if self.real:
            write_diagnosis(folder, found, records, rig_file)
            return
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
        commands[0].append("--idle-timeout=60s")  # should this process be killed
        one = [*module, "distributed.cli.dask_worker", "--nthreads=1", *common]
        commands += [[*one, f"--local-directory={folder}"] for _ in range(count)]
        started = [
            subprocess.Popen(
                command,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for this process, which ends them
            )
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
    place: Path,
    count: int,
    stand_in: StandIn,
    after_each: Callable[[int, list[psutil.Process]], None] = lambda done, running: None,
) -> Figures:
    """One fleet with so many workers, from nothing to the page; goes on with an earlier session.

    The results are removed at the end, and the sessions kept in PLACE.json.
    """
    kept, complete = (place.with_suffix(ending) for ending in (".unfinished.json", ".json"))
    earlier: list[Session] = []
    for path in (kept, complete):
        if path.exists():
            earlier = [Session(**one) for one in json.loads(path.read_text(encoding="utf-8"))]
    if complete.exists():
        return Figures.of(place.name, count, earlier)
    with cluster(count) as (address, scheduler, running), on_cluster(address):
        before = [cpu_s(scheduler), *map(cpu_s, running)]
        own, began = time.process_time(), time.monotonic()
        cases, failed, at_work_s = 0, 0, 0.0

        def session() -> Session:
            alive = [process for process in running if process.is_running()]
            after = [cpu_s(scheduler), *map(cpu_s, alive)]
            used = [late - early for late, early in zip(after, before, strict=False)]
            peaks = [peak_mb(scheduler), *map(peak_mb, alive)]
            return Session(
                cases,
                failed,
                time.monotonic() - began,
                at_work_s,
                time.process_time() - own,
                used[0],
                sum(used[1:]),
                peaks[0],
                max(peaks[1:], default=0.0),
            )

        def keep_sessions() -> None:
            write_text(kept, json.dumps([asdict(one) for one in (*earlier, session())]))

        todo = unfinished_machines(machines, place, ())
        read = functools.partial(read_machine)
        try:
            for outcome in run_fleet(todo, place, (), read, stand_in, stand_in.write):
                cases += 1
                failed += outcome.failed
                at_work_s += outcome.seconds
                if cases % KEEP_EVERY == 0:
                    keep_sessions()
                after_each(cases, running)
        finally:
            keep_sessions()
        last = session()
    fleet = read_fleet(place, [machine.name for machine in machines], {})
    write_fleet(fleet, place, place)
    kept.replace(complete)
    shutil.rmtree(place)
    return Figures.of(place.name, count, [*earlier, last])


def kill_once(done: int, running: list[psutil.Process]) -> None:
    """Kills the first worker behind the tenth case; its nanny starts another."""
    if done == 10:
        running[0].send_signal(signal.SIGKILL)


def row(figures: Figures) -> str:
    """A line of the table."""
    total = figures.total
    each = 1e3 / total.cases
    return (
        f"{figures.name:14s} {total.cases:6d} {total.failed:6d} {figures.sessions:8d} "
        f"{figures.workers:7d} {total.seconds:8.1f} "
        f"{total.at_work_s / (figures.workers * total.seconds):8.3f} {each * total.client_s:9.1f} "
        f"{each * total.scheduler_s:12.1f} {each * total.worker_s:9.1f} "
        f"{total.scheduler_mb:12.0f} {total.worker_mb:9.0f}"
    )


HEAD = (
    f"{'':14s} {'cases':>6s} {'failed':>6s} {'sessions':>8s} {'workers':>7s} {'s':>8s} "
    f"{'at work':>8s} {'client ms':>9s} {'scheduler ms':>12s} {'worker ms':>9s} "
    f"{'scheduler MB':>12s} {'worker MB':>9s}"
)


def measure(place: Path, chosen: argparse.Namespace) -> list[Figures]:
    """Runs the fleets in this folder and prints each."""
    machines = make_fleet(place / "fleet", chosen.machines, chosen.real, chosen.length, chosen.rate)
    mortal = machines[:40]
    kept = place / "kept"
    if not (kept / "diagnosis.pickle").exists():
        kept_diagnosis(kept, place / "fleet-kinds" / REAL)
    stand_in = StandIn(kept, chosen.seconds)
    there, back = (
        sum(file.stat().st_size for file in folder.iterdir())
        for folder in (place / "fleet-kinds" / "stand-in", kept / "files")
    )
    print(f"bytes of a case: {there:,} there, {back:,} back")
    print(HEAD, flush=True)
    found = []
    for count, name in ((1, "one worker"), (2, "two workers")):
        found.append(run(machines, place / name, count, stand_in))
        print(row(found[-1]), flush=True)
    one, two = (figures.total.seconds for figures in found)
    print(f"efficiency {one / (2.0 * two):.3f}", flush=True)
    found.append(run(mortal, place / "killed", 2, stand_in, kill_once))
    print(row(found[-1]), flush=True)
    return found


def main() -> None:
    """Measure and print."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # ends the cluster, too
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--machines", type=int, default=1000)
    parser.add_argument("--seconds", type=float, default=0.25, help="of the stand-in")
    parser.add_argument("--length", type=float, default=4.0, help="of a record, s")
    parser.add_argument("--rate", type=float, default=200.0, help="of a record, Hz")
    parser.add_argument("--real", type=int, default=20, help="machines with the real diagnosis")
    parser.add_argument("--folder", type=Path, help="keep everything here, and go on with it")
    parser.add_argument("--json", action="store_true")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as top:
        figures = measure(chosen.folder or Path(top), chosen)
    if chosen.json:
        print(json.dumps([asdict(one) for one in figures], indent=1))


if __name__ == "__main__":
    main()

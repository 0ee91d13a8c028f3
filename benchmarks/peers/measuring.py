# SPDX-License-Identifier: MIT
"""All measurements of the comparison, one after the other."""

from __future__ import annotations

import gc
import importlib.metadata
import platform
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import native
import numpy as np
from checking import from_program, from_python, has_own_weighting, judge, name_of
from python_peers import PEERS, PythonPeer, control_note
from results import BASE, PYTHON, SHOWN_N, Errors, Hold, Name, Results, Times
from series import batch, easy_series, held_series, series_16

FACTOR, VARIANCE0 = 0.99, 1e4
# Model (16) as published, and the same servo sampled ten times as fast.
FASTER = (1, 10)

Say = Callable[[str], None]


@dataclass(frozen=True)
class Plan:
    """How much is measured."""

    sizes: Sequence[int] = tuple(range(2, 13))
    """Numbers of parameters."""
    levels: Sequence[str] = ("2", "3")
    """Optimisation levels of the compiler; all sizes at the first one, SHOWN_N at the others."""
    compilers: Sequence[str] = ("clang++",)
    """Compilers beside the usual one, at the first level and SHOWN_N; left out where not there."""
    passes: int = 100
    samples: int = 1000
    """Passes of the recursions in C++, and samples of each."""
    python_passes: int = 3
    """The same for those that are called from Python."""
    checked: int = 2000
    """Samples behind which the answers are compared."""
    accurate: int = 100_000
    """Samples of the runs in float."""
    held: int = 1_000_000
    python_held: int = 100_000
    """Samples for which the input is held, in C++ and in Python."""
    seeds: int = 3
    """Runs with a held input."""

    def sizes_at(self, level: str) -> Sequence[int]:
        """Numbers of parameters that are timed at a level."""
        return self.sizes if level == self.levels[0] else (SHOWN_N,)


# A run of seconds, for tests.
TINY = Plan((2, 6), ("2",), (), 3, 200, 1, 500, 2000, 3000, 300, 1)
EXCITED = 2000


def measure(plan: Plan, peers: Sequence[PythonPeer] = PEERS, say: Say = print) -> Results:
    """Build, measure and check; `say` is told what goes on."""
    programs: dict[str, Path] = {}
    for level in plan.levels:
        say(f"compiling at -O{level}")
        programs[level] = native.build(level, sorted({*plan.sizes_at(level), SHOWN_N}))
    others = {
        name: native.build(plan.levels[0], (SHOWN_N,), native.BUILD / name, path)
        for name in plan.compilers
        if (path := shutil.which(name)) is not None
    }
    program = programs[plan.levels[0]]
    results = Results(machine_lines([program, *others.values()]), {}, control_note())
    results.missing |= {peer.name: peer.missing for peer in peers if peer.missing}
    say("comparing the answers")
    found = []
    for n in plan.sizes:
        series = easy_series(n, plan.checked, seed=n)
        rows = native.call(program, "theta", series, FACTOR, VARIANCE0, [plan.checked])
        results.missing |= native.missing(rows)
        found += from_program(rows, series, FACTOR, plan.checked)
        found += from_python(peers, series, FACTOR, VARIANCE0)
    results.answers = judge(found)
    say("errors in float")
    results.errors = errors_in_float(program, plan)
    say("held input")
    results.holds = [*holds_in_program(program, plan), *holds_in_python(peers, plan)]
    for level, one in programs.items():
        say(f"times at -O{level}")
        results.times += times_in_program(one, level, plan.sizes_at(level), plan)
    for name, one in others.items():
        say(f"times with {name}")
        results.others[name] = times_in_program(one, plan.levels[0], (SHOWN_N,), plan)
    say("times in Python")
    results.times += times_in_python(peers, plan)
    return results


def machine_lines(programs: Sequence[Path]) -> list[str]:
    """What the times belong to."""
    processor = platform.processor() or platform.machine()
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        lines = cpuinfo.read_text(encoding="utf-8").splitlines()
        named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
        processor = named[0] if named else processor
    packages = ("numpy", "padasip", "filterpy", "statsmodels")
    versions = [f"{name} {version(name)}" for name in packages]
    return [
        processor,
        *map(native.compiler, programs),
        f"Python {platform.python_version()}, {', '.join(versions)}",
    ]


def version(package: str) -> str:
    """Its version, or that it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def errors_in_float(program: Path, plan: Plan) -> list[Errors]:
    """Errors at some counts of samples; a recursion with an own weighting is left out."""
    counts = np.unique(np.geomspace(50, plan.accurate, 25).astype(int))
    found = []
    for faster in FASTER:
        series = series_16(plan.accurate, seed=1, noise=1e-3, times_faster=faster)
        for factor in (1.0, FACTOR):
            rows = native.call(program, "theta", series, factor, VARIANCE0, counts.tolist())
            truths: dict[float, list[np.ndarray]] = {}
            for row in rows:
                name = name_of(row)
                if name.scalar != "float" or has_own_weighting(name):
                    continue
                start = float(row["variance0"])
                if start not in truths:
                    pairs = [series.regressors(int(count)) for count in counts]
                    truths[start] = [batch(phi, y, factor, start) for phi, y in pairs]
                errors = [
                    relative_error(row["theta"][str(count)], truth)
                    for count, truth in zip(counts, truths[start], strict=True)
                ]
                found.append(Errors(name, faster, factor, counts.astype(float), np.array(errors)))
    return found


def relative_error(theta: Sequence[float | None], truth: np.ndarray) -> float:
    """Largest error relative to the largest parameter; infinite where a parameter is no number."""
    if any(value is None for value in theta):
        return float(np.inf)
    return float(np.max(np.abs(np.array(theta, dtype=float) - truth)) / np.max(np.abs(truth)))


def holds_in_program(program: Path, plan: Plan) -> list[Hold]:
    """Every recursion in C and C++, for each seed."""
    runs: dict[Name, list[tuple[int | None, int | None]]] = {}
    for seed in range(1, plan.seeds + 1):
        series = held_series(EXCITED, plan.held, seed)
        for row in native.call(program, "hold", series, FACTOR, VARIANCE0, [EXCITED]):
            both = tuple(None if row[key] < 0 else int(row[key]) for key in ("moved", "not_finite"))
            runs.setdefault(name_of(row), []).append((both[0], both[1]))
    return [
        Hold(name, *map(tuple, zip(*both, strict=True)), held=plan.held)
        for name, both in runs.items()
    ]


def holds_in_python(peers: Sequence[PythonPeer], plan: Plan) -> list[Hold]:
    """Those libraries that take single samples and forget; ours is the one of C++, bit for bit."""
    found = []
    for peer in peers:
        if peer.start is None or not peer.forgets or peer.missing or peer.ours:
            continue
        both = [hold_in_python(peer, seed, plan.python_held) for seed in range(1, plan.seeds + 1)]
        name = Name(peer.name, "double", PYTHON, peer.ours)
        found.append(Hold(name, *map(tuple, zip(*both, strict=True)), held=plan.python_held))
    return found


def hold_in_python(peer: PythonPeer, seed: int, held: int) -> tuple[int | None, int | None]:
    """Samples until a parameter has moved, and until one is no number, as in C++."""
    assert peer.start is not None
    series = held_series(EXCITED, held, seed)
    phi, y = series.regressors()
    recursion = peer.start(series.parameters, FACTOR, VARIANCE0)
    behind = EXCITED - series.first
    before, moved = np.zeros(series.parameters), None
    with np.errstate(all="ignore"):
        for k, (row, value) in enumerate(zip(phi, y.tolist(), strict=True), start=1):
            try:
                recursion.update(row, value)
            except (ArithmeticError, ValueError, np.linalg.LinAlgError):
                return moved, k - behind  # it refuses what it has become
            if k <= behind:
                before = np.array(recursion.theta)
                continue
            if not np.all(np.isfinite(recursion.theta)):
                return (k - behind if moved is None else moved), k - behind
            change = np.max(np.abs(recursion.theta - before))
            if moved is None and change > 0.01 * np.max(np.abs(before)):
                moved = k - behind
    return moved, None


def times_in_program(program: Path, level: str, sizes: Sequence[int], plan: Plan) -> list[Times]:
    """Interleaved passes in one process, for each number of parameters."""
    found = []
    for n in sizes:
        series = easy_series(n, plan.samples, seed=n)
        rows = native.call(program, "time", series, FACTOR, VARIANCE0, [plan.passes])
        base = {row["scalar"]: np.array(row["ns"]) for row in rows if row["name"] == BASE}
        found += [
            Times(name_of(row), level, n, np.array(row["ns"]), base[row["scalar"]]) for row in rows
        ]
    return found


def times_in_python(peers: Sequence[PythonPeer], plan: Plan) -> list[Times]:
    """Interleaved passes in this process; the making of the recursion is part of a pass."""
    found = []
    installed = [peer for peer in peers if not peer.missing]
    for n in plan.sizes:
        series = easy_series(n, plan.samples, seed=n)
        taken: dict[str, list[float]] = {peer.name: [] for peer in installed}
        for _ in range(1 + plan.python_passes):  # the first warms up
            for peer in installed:
                gc.collect()
                began = time.perf_counter_ns()
                peer.estimate(series, FACTOR if peer.forgets else 1.0, VARIANCE0)
                ns = time.perf_counter_ns() - began
                taken[peer.name].append(ns / (series.u.size - series.first))
        found += [
            Times(
                Name(peer.name, "double", PYTHON, peer.ours),
                "",
                n,
                np.array(taken[peer.name][1:]),
                np.array([]),
            )
            for peer in installed
        ]
    return found

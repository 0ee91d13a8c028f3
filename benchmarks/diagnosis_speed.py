# SPDX-License-Identifier: MIT
"""Cost of a diagnosis: python benchmarks/diagnosis_speed.py

Runs `ehsid gap` as a user does, on cases of the independent generator, and writes
docs/gap/speed.md. `--compare FOLDER` names a folder with the package `ehsid` of an earlier version;
it diagnoses the same records in turn with this one, so that both see the same machine. Needs Linux
and the extra `lab`.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from ehsid.harness.base.parallel import single_threaded_algebra, workers
from ehsid.harness.diagnosis.model.case import make_case as gap_case
from ehsid.harness.diagnosis.model.fit import fit
from ehsid.harness.diagnosis.search.search import candidate_effects
from ehsid.harness.records import read_record
from ehsid.harness.rigs import read_rig
from ehsid.lab.reality.batch import write_case
from ehsid.lab.reality.case import make_case
from ehsid.lab.scoring.baselines import INDEPENDENT_HZ

PAGE = Path(__file__).parents[1] / "docs" / "gap" / "speed.md"
SEED = 31  # Coulomb friction
SENSORS = {"pressures": "with pressures", "position": "position only"}
RUN = "import sys; from ehsid.harness.cli import main; main()"
SAMPLED_S = 0.2


@dataclass(frozen=True)
class Cost:
    """What one diagnosis took; memory is the largest sum over all its processes."""

    wall_s: float
    core_s: float
    memory_mb: float
    verdict: str


def processes(root: int) -> list[int]:
    """A process and all that descend from it."""
    found = [root]
    try:
        for task in Path(f"/proc/{root}/task").iterdir():
            for child in (task / "children").read_text().split():
                found += processes(int(child))
    except OSError:  # it has ended
        pass
    return found


def memory_mb(process: int) -> float:
    """Memory of a process, shared pages in equal parts among those that share them."""
    try:
        lines = Path(f"/proc/{process}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0.0
    return sum(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1024.0


def diagnose(case: Path, package: Path | None, options: list[str]) -> Cost:
    """Runs the command on a case in processes of its own."""
    environment = dict(os.environ)
    if package is not None:
        environment["PYTHONPATH"] = str(package)
    with tempfile.TemporaryDirectory() as out:
        command = [sys.executable, "-c", RUN, "gap", str(case / "train.csv")]
        command += ["--rig", str(case / "rig.toml"), "--validate", str(case / "validate.csv")]
        command += [*options, "--out", f"{out}/diagnosis"]
        began, most = time.monotonic(), 0.0
        child = subprocess.Popen(command, env=environment, cwd=out, stdout=subprocess.DEVNULL)
        while True:
            process, status, used = os.wait4(child.pid, os.WNOHANG)
            if process:
                break
            most = max(most, sum(map(memory_mb, processes(child.pid))))
            time.sleep(SAMPLED_S)
        if status:
            raise RuntimeError(f"{case.name}: the diagnosis ended with {status}")
        wall_s = time.monotonic() - began
        result = json.loads(Path(f"{out}/diagnosis/diagnosis.json").read_text())
    names = [effect["id"] for effect in result["which"]["effects"]]
    verdict = result["verdict"] + (f": {', '.join(names)}" if names else "")
    return Cost(wall_s, used.ru_utime + used.ru_stime, most, verdict)


def against_scipy(case: Path) -> tuple[float, float, float]:
    """Fits the calibration of a case by the diagnosis and by scipy on the same simulator.

    Returns the core-seconds of the fit of the diagnosis and of scipy's least_squares with
    difference quotients, and the cost at scipy's minimum less that at ours, nats.
    """
    problem = gap_case(read_rig(case / "rig.toml"), [read_record(case / "train.csv")]).problem()
    start, deviation = problem.centre(), problem.information() ** -0.5
    free = problem.low < problem.high
    with workers(1), single_threaded_algebra():
        began = time.process_time()
        found = fit(problem, start, iterations=30)
        ours_s = time.process_time() - began
        # Squares instead of the likelihood: each output is divided by its error at our minimum, and
        # counts as often as it has independent errors.
        independent = INDEPENDENT_HZ * sum(record.seconds for record in problem.records)
        scale = {
            name: np.sqrt(
                independent / error.size / (np.mean(error**2) + problem.floors[name] ** 2)
            )
            for name, error in problem.errors(found.x).items()
        }

        def placed(moved: np.ndarray) -> np.ndarray:
            x = start.copy()
            x[free] += moved * deviation[free]
            return np.clip(x, problem.low, problem.high)

        def residuals(moved: np.ndarray) -> np.ndarray:
            errors = problem.errors(placed(moved))
            return np.concatenate([moved, *(scale[name] * errors[name] for name in errors)])

        began = time.process_time()
        other = least_squares(
            residuals,
            np.zeros(int(free.sum())),
            bounds=(
                (problem.low - start)[free] / deviation[free] - 1e-9,
                (problem.high - start)[free] / deviation[free] + 1e-9,
            ),
            max_nfev=30,
        )
        scipy_s = time.process_time() - began
    return ours_s, scipy_s, problem.cost(placed(other.x)) - found.cost


def write_drawn(folder: Path, sensors: str, rate_hz: int, seconds: float) -> Path:
    """Writes a case with the sensors, the sampling rate and the length of its records."""
    case = make_case(
        SEED, "plain", "one", None, sensors=sensors, seconds=seconds, dt_s=1.0 / rate_hz
    )
    target = folder / f"{sensors}-{rate_hz}-{seconds:g}"
    write_case(case, target)
    return target


def row(name: str, cost: Cost, before: Cost | None, compared: bool) -> str:
    """A line of the table; `compared`: it has columns for an earlier version."""
    cells = [name, f"{cost.wall_s:.1f}", f"{cost.core_s:.1f}", f"{cost.memory_mb:.0f}"]
    if before is not None:
        ratio = before.core_s / cost.core_s
        cells += [f"{before.core_s:.1f}", f"{before.memory_mb:.0f}", f"{ratio:.1f}"]
        if before.verdict != cost.verdict:
            cells[0] += f" (before: {before.verdict})"
    elif compared:
        cells += ["", "", ""]
    return f"| {' | '.join([*cells, cost.verdict])} |"


def measured(folder: Path, package: Path | None) -> list[str]:
    """Diagnoses all cases; returns the lines of the page."""
    compared = package is not None
    earlier = " before: core-s | before: MB | gain |" if compared else ""
    lines = [
        f"| records | wall s | core-s | memory MB |{earlier} verdict |",
        f"|---|---|---|---|{'---|---|---|' if compared else ''}---|",
    ]
    found: dict[tuple[str, int, int], Cost] = {}
    few: dict[str, Cost] = {}
    cases = [(1000, 20), (2000, 20), (1000, 10), (1000, 40)]
    for sensors, words in SENSORS.items():
        for rate_hz, seconds in cases:
            case = write_drawn(folder, sensors, rate_hz, float(seconds))
            cost = diagnose(case, None, [])
            before = None if package is None else diagnose(case, package, [])
            found[sensors, rate_hz, seconds] = cost
            lines.append(
                row(f"{words}, {rate_hz / 1000:g} kHz, {seconds} s", cost, before, compared)
            )
            print(lines[-1], flush=True)
        case = folder / f"{sensors}-1000-20"
        ids = candidate_effects(read_rig(case / "rig.toml"))
        excluded = [effect for effect in ids if "friction" not in effect][:8]
        options = [word for effect in excluded for word in ("--exclude-effect", effect)]
        few[sensors] = diagnose(case, None, options)
        name = f"{words}, 1 kHz, 20 s, {len(excluded)} effects less"
        lines.append(row(name, few[sensors], None, compared))
        print(lines[-1], flush=True)
    lines += ["", "| ratio of core-seconds | with pressures | position only |", "|---|---|---|"]
    usual = {sensors: found[sensors, 1000, 20].core_s for sensors in SENSORS}
    each = {sensors: (usual[sensors] - few[sensors].core_s) / 8 for sensors in SENSORS}
    ratios = {
        "2 kHz to 1 kHz": {s: found[s, 2000, 20].core_s / usual[s] for s in SENSORS},
        "20 s to 10 s": {s: usual[s] / found[s, 1000, 10].core_s for s in SENSORS},
        "40 s to 20 s": {s: found[s, 1000, 40].core_s / usual[s] for s in SENSORS},
        "50 candidates to 17 (from the cost of eight)": {
            s: (usual[s] + 33 * each[s]) / usual[s] for s in SENSORS
        },
    }
    lines += [
        f"| {name} | {by['pressures']:.2f} | {by['position']:.2f} |" for name, by in ratios.items()
    ]
    lines += [
        "",
        "| one fit of the calibration | core-s | least_squares of scipy, core-s | ratio | its cost "
        "above ours, nats |",
        "|---|---|---|---|---|",
    ]
    for sensors, words in SENSORS.items():
        ours_s, scipy_s, behind = against_scipy(folder / f"{sensors}-1000-20")
        lines.append(
            f"| {words} | {ours_s:.2f} | {scipy_s:.2f} | {scipy_s / ours_s:.1f} | {behind:.2f} |"
        )
    return lines


def main() -> None:
    """Measures everything and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--compare", type=Path, help="folder with the package of another version")
    package = parser.parse_args().compare
    with tempfile.TemporaryDirectory() as folder:
        lines = measured(Path(folder), package)
    begin, end = "<!-- measured -->\n", "<!-- end -->\n"
    head, rest = PAGE.read_text().split(begin)
    tail = rest.split(end)[1]
    PAGE.write_text(head + begin + "\n".join(lines) + "\n" + end + tail)


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""How well the time to go of a diagnosis is told: python benchmarks/time_to_go.py [COUNT]

Diagnoses records of the independent generator, of different lengths, motions, sensors and causes,
each on one core, and compares the time to go that was shown with the time that it took, from 20 %
of the time on. Needs the extra `lab`.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from ehsid.harness.base.parallel import workers
from ehsid.harness.base.time_to_go import TimeToGo
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.records import make_record
from ehsid.harness.rigs import read_rig
from ehsid.lab.reality.case import make_case

FIRST_SEED, COUNT = 401, 8
GRADES = ("plain", "hard", "wide", "confusable")
KINDS = ("one", "none", "two", "params", "open")
SENSORS = ("position", "pressures", "pressures+supply")
SECONDS = (7.0, 10.0, 14.0, 20.0)
BEGIN = 0.2  # share of the time from which the time to go is judged
PLACES = 200  # at which it is judged, spread evenly over the time


def ratios(number: int, folder: Path) -> tuple[str, np.ndarray]:
    """Diagnoses a case; returns what it was, and the ratio of both times, at least 1, by place."""
    grade, kind = GRADES[number % len(GRADES)], KINDS[number % len(KINDS)]
    sensors, seconds = SENSORS[number % len(SENSORS)], SECONDS[number // 2 % len(SECONDS)]
    case = make_case(FIRST_SEED + number, grade, kind, sensors=sensors, seconds=seconds)
    path = folder / f"{number}.toml"
    path.write_text(case.rig_toml)
    held_out = [replace(make_record(case.validate), name="validate")] if number % 2 else []
    to_go = TimeToGo()
    told: list[tuple[float, float | None, float]] = []

    def progress(share: float) -> None:
        to_go.update(share)
        told.append((to_go.seconds, to_go.left_s, share))

    with workers(1):
        found = diagnose(
            [replace(make_record(case.train), name="train")],
            read_rig(path),
            validate=held_out,
            progress=progress,
        )
    total = to_go.seconds
    # The same reports once more, with a clock that stops at each place.
    now = [0.0]
    again, shown, waiting = TimeToGo(lambda: now[0]), [], list(told)
    for place in np.linspace(0.0, total, PLACES, endpoint=False):
        while waiting and waiting[0][0] <= place:
            now[0] = waiting[0][0]
            again.update(waiting.pop(0)[2])
        now[0] = float(place)
        shown.append(again.left_s or 1e-9)
    left = total - np.linspace(0.0, total, PLACES, endpoint=False)
    off = np.maximum(np.array(shown) / left, left / np.array(shown))[round(BEGIN * PLACES) :]
    what = f"{grade}, {kind}, {sensors}, {seconds:g} s{', validate' if held_out else ''}"
    return f"{what} | {found.verdict} | {total:.1f}", off


def main() -> None:
    """Prints a line for each case, and the shares over all of them."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    print("| record | verdict | s | within 1.5 | within 2 | median |\n|---|---|---|---|---|---|")
    every = []
    with tempfile.TemporaryDirectory() as folder:
        for number in range(count):
            what, off = ratios(number, Path(folder))
            every.append(off)
            print(f"| {what} | {_figures(off)} |", flush=True)
    print(f"| all | | | {_figures(np.concatenate(every))} |")


def _figures(off: np.ndarray) -> str:
    within = [f"{100.0 * np.mean(off <= limit):.0f} %" for limit in (1.5, 2.0)]
    return " | ".join([*within, f"{np.median(off):.2f}"])


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""False alarms of `ehsid watch` in simulated years without a change, and how soon it sees one.

    python benchmarks/watch_alarms.py table       # of the limits in `watch.changes`
    python benchmarks/watch_alarms.py check       # alarms a year with that table, other seeds
    python benchmarks/watch_alarms.py detection   # steps and growths: delay, date, found
    python benchmarks/watch_alarms.py detection --picture docs/watch/detection.png

Logs are taken at random days of a year. Each scatters by its own deviation s and by tau between
logs. For the table and its check s is nearly 0: nothing is known of the scatter but what the logs
show, the worst case. For the detection the share of both is drawn.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.show.plotting import styled, write_figure
from ehsid.harness.watch import changes as ch

# Of the detection: kinds, sizes in deviations of a log, and years of each.
KINDS, SIZES, COUNT = ("step", "growth"), (1.0, 2.0, 3.0, 5.0, 8.0), 400
YEARS = {12: 20_000, 26: 10_000, 52: 6_000, 120: 2_500, 365: 700}
DAYS = 365.25


def year(logs: int, rng: np.random.Generator, *, known: bool = False) -> ch.Course:
    """A year without a change; known: most of the scatter may be that within a log."""
    days = np.sort(rng.uniform(0.0, DAYS, logs))
    tau, level = (rng.uniform(0.0, 2.0), rng.uniform(0.5, 2.0)) if known else (1.0, 0.01)
    deviations = level * rng.uniform(0.7, 1.4, logs)
    values = rng.normal(size=logs) * np.hypot(deviations, tau)
    return ch.Course(days, values, deviations, np.empty((logs, 0)))


def most(course: ch.Course) -> float:
    """Largest D of a change that any of the logs asks for and bears out."""
    found = 0.0
    for end in range(ch.BASELINE + 1, course.days.size + 1):
        tau = ch.scatter(course.part(0, end))
        change = ch.largest_change(course, 0, end, tau, False, 0.0)
        if change.statistic > found and ch.is_borne_out(course, 0, end, tau, change):
            found = change.statistic
    return found


def table() -> Iterator[str]:
    """The D that a year without a change passes with the probability 1 - exp(-1 / q)."""
    yield "logs a year | " + " | ".join(f"q = {q}" for q in ch.QUANTITIES)
    for logs in ch.LOGS_A_YEAR:
        rng = np.random.default_rng([46, logs])
        largest = [most(year(logs, rng)) for _ in range(YEARS[logs])]
        limits = [float(np.quantile(largest, math.exp(-1.0 / q))) for q in ch.QUANTITIES]
        yield f"{logs} | " + " | ".join(f"{limit:.1f}" for limit in limits)


def alarms(course: ch.Course, limit: float) -> int:
    """Number of alarms while the logs come in one by one, with those that are withdrawn later."""
    given: set[float] = set()
    for end in range(ch.BASELINE + 1, course.days.size + 1):
        given |= {change.noticed for change in ch.changes(course.part(0, end), limit)}
    return len(given)


def check() -> Iterator[str]:
    """Alarms a year for all quantities together, with their standard error."""
    for logs in (12, 26, 52):
        rng = np.random.default_rng([47, logs])
        count = 1200
        for quantities in ch.QUANTITIES:
            limit = ch.threshold(logs, quantities)
            given = [alarms(year(logs, rng), limit) for _ in range(count)]
            rate, error = np.mean(given), np.std(given) / math.sqrt(count)
            yield (
                f"{logs} logs a year, {quantities} quantities: {quantities * rate:.2f} "
                f"± {quantities * error:.2f} alarms a year"
            )


@dataclass(frozen=True)
class Detected:
    """What was told of changes of one kind and size, in COUNT years."""

    kind: str
    size: float
    """In deviations of a log."""
    delays: list[float]
    """Days from the change to its alarm, of those that were noticed."""
    dates: float
    kinds: float
    """Shares of them whose interval holds the date, and whose kind is right."""

    def __str__(self) -> str:
        delay = np.median(self.delays) if self.delays else math.nan
        return (
            f"{self.kind} of {self.size:g} deviations of a log: noticed "
            f"{len(self.delays) / COUNT:.0%}, median delay {delay:.0f} days, date within its "
            f"interval {self.dates:.0%}, kind right {self.kinds:.0%}"
        )


def detection() -> Iterator[Detected]:
    """Changes in the middle of a year of 52 logs; sizes in deviations of one log."""
    logs, quantities = 52, 15
    limit = ch.threshold(logs, quantities)
    for kind in KINDS:
        for size in SIZES:
            rng = np.random.default_rng([48, round(10 * size), kind == "growth"])
            delays, held, right = [], [], []
            for _ in range(COUNT):
                quiet = year(logs, rng, known=True)
                day = float(rng.uniform(0.4, 0.6)) * DAYS
                one = float(np.hypot(np.median(quiet.deviations), ch.scatter(quiet)))
                late = np.maximum(quiet.days - day, 0.0)
                # A growth reaches the size after 90 days.
                shape = (late > 0.0) if kind == "step" else late / 90.0
                values = quiet.values + size * one * shape
                found = ch.changes(replace(quiet, values=values), limit)
                if found:
                    first = found[0]
                    delays.append(first.noticed - day)
                    held.append(first.days90[0] <= day <= first.days90[1])
                    right.append(first.kind == kind)
            shares = [float(np.mean(each)) if each else math.nan for each in (held, right)]
            yield Detected(kind, size, delays, *shares)


@styled
def curves(found: list[Detected]) -> Figure:
    """Share of the changes that are noticed within so many days, for each size."""
    figure = Figure(figsize=(8.0, 3.2))
    panels = figure.subplots(1, 2, sharey=True)
    for axes, kind in zip(panels, KINDS, strict=True):
        for one in found:
            if one.kind == kind:
                days = np.sort(one.delays)
                noticed = 100.0 * np.arange(1, days.size + 1) / COUNT
                axes.step(days, noticed, where="post", label=f"{one.size:g}")
        axes.set_title("step" if kind == "step" else "growth, by its size in 90 days")
        axes.set_xlabel("days after the change")
        axes.set_xlim(0.0, 200.0)
        axes.set_ylim(0.0, 101.0)
    panels[0].set_ylabel("noticed, %")
    panels[0].legend(title="deviations of a log", loc="center right")
    return figure


def main() -> None:
    """Prints one of the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("which", choices=("table", "check", "detection"))
    parser.add_argument("--picture", type=Path, help="of the detection, to be written")
    given = parser.parse_args()
    found = []
    for line in {"table": table, "check": check, "detection": detection}[given.which]():
        print(line, flush=True)
        found.append(line)
    if given.picture:
        write_figure(given.picture, curves(found))


if __name__ == "__main__":
    main()

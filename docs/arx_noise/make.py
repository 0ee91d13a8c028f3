# SPDX-License-Identifier: MIT
"""Makes the tables and pictures of docs/arx_noise.md: python docs/arx_noise/make.py

500 runs of 2,000 samples for each method, noise and command; about a minute on two cores.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.base.parallel import run_tasks, worker_count, workers
from ehsid.harness.show.plotting import BLUE, GREY, PALE, VERMILION, styled
from ehsid.lab.studies.noises import (
    METHODS,
    N_SAMPLES,
    NOISES,
    NORMAL_90,
    THETA,
    Noise,
    Runs,
    estimator,
    run,
    run_batch,
    signals,
)

HERE = Path(__file__).parent
PAGE = HERE.with_suffix(".md")
SEEDS = range(500)
NAMES = {
    "rls": "least squares (rls)",
    "riv": "instrumental variables (riv)",
    "batch": "whole record at once",
}
COLOURS = dict(zip(METHODS, (VERMILION, BLUE), strict=True))
SENSOR = [noise for noise in NOISES if noise.sensor_fit is not None]


@styled
def errors_over_time() -> Figure:
    """One run: errors of a1 and b1 with their 90 % intervals, each method in each kind of noise."""
    kinds = (NOISES[0], NOISES[1], SENSOR[1])
    figure = Figure(figsize=(8.0, 8.5))
    panels = figure.subplots(2 * len(kinds), len(METHODS), sharex=True, sharey="row")
    for row, noise in enumerate(kinds):
        record = signals(noise, 1)
        for column, method in enumerate(METHODS):
            path = estimator(method).run(record.u, record.y)
            for part, index in enumerate((0, 3)):
                axes = panels[2 * row + part, column]
                _draw_error(
                    axes,
                    path.theta[:, index] - THETA[index],
                    path.standard_deviation[:, index],
                    COLOURS[method],
                )
                axes.set_ylim(*((-0.3, 0.3) if part == 0 else (-0.06, 0.06)))
                if column == 0:
                    axes.set_ylabel(("a1", "b1")[part] + " error")
            if row == 0:
                panels[0, column].set_title(NAMES[method])
        panels[2 * row, 0].annotate(
            noise.name, (0.02, 0.97), xycoords="axes fraction", va="top", fontsize="small"
        )
    for axes in panels[-1]:
        axes.set_xlabel("sample")
    return figure


def _draw_error(axes: Axes, error: FloatArray, deviation: FloatArray, colour: str) -> None:
    """The error as a line, its own 90 % interval as a band, zero in grey."""
    samples = np.arange(error.size)
    width = NORMAL_90 * deviation
    axes.axhline(0.0, color=GREY, linewidth=1.0)
    axes.fill_between(samples, error - width, error + width, color=colour, alpha=0.25, linewidth=0)
    axes.plot(samples, error, color=colour, linewidth=1.0)


@styled
def coverage(results: dict[tuple[str, str], Runs]) -> Figure:
    """Bars: share of the 90 % intervals that hold."""
    figure = Figure(figsize=(9.0, 4.0))
    axes = figure.subplots()
    width = 0.3
    axes.axhspan(85.0, 95.0, color=PALE, zorder=0)
    for place, method in enumerate(METHODS):
        heights = [100.0 * results[method, noise.name].coverage for noise in NOISES]
        at = np.arange(len(NOISES)) + (place - 0.5) * width
        bars = axes.bar(at, heights, width, color=COLOURS[method], label=NAMES[method])
        axes.bar_label(bars, fmt="%.0f", fontsize="x-small")
    axes.set_xticks(range(len(NOISES)), [noise.name.replace(", ", ",\n") for noise in NOISES])
    axes.set_ylabel("90 % intervals that hold, %")
    axes.set_ylim(0.0, 125.0)
    axes.set_yticks(range(0, 101, 20))
    axes.grid(axis="x", visible=False)
    axes.legend(ncols=2, loc="upper center")
    return figure


@styled
def poles(results: dict[tuple[str, str], Runs]) -> Figure:
    """Poles of 200 runs of each method with sensor noise at fit 97 %."""
    figure = Figure(figsize=(8.0, 3.4))
    circle = np.exp(1j * np.linspace(-np.pi / 3, np.pi / 3, 200))
    true = np.roots([1.0, *THETA[:3]])
    panels = figure.subplots(1, len(METHODS), sharex=True, sharey=True)
    for axes, method in zip(panels, METHODS, strict=True):
        found = [np.roots([1.0, *row[:3]]) for row in results[method, SENSOR[1].name].theta[:200]]
        points = np.concatenate(found)
        axes.plot(circle.real, circle.imag, color=GREY, linewidth=1.0)
        axes.plot(points.real, points.imag, ".", color=COLOURS[method], markersize=2.0, alpha=0.5)
        axes.plot(true.real, true.imag, "+", color="black", markersize=9.0)
        axes.set_title(NAMES[method])
        axes.set_xlabel("real part")
        axes.set_xlim(-1.1, 1.1)
        axes.set_ylim(-0.7, 0.7)
    panels[0].set_ylabel("imaginary part")
    return figure


def table(results: dict[tuple[str, str], Runs]) -> str:
    """The matrix: each method with each noise."""
    lines = [
        "| noise | method | 90 % intervals hold | worst within 3 |"
        " K, omega_n, xi, median of the runs | median error of K, omega_n, xi |",
        "|---|---|---|---|---|---|",
    ]
    for noise in NOISES:
        for method in (*METHODS, "batch"):
            if (method, noise.name) in results:
                lines.append(_row(noise.name, method, results[method, noise.name]))
    return "\n".join(lines)


def other_commands(results: dict[tuple[str, str, str], Runs]) -> str:
    """The same for the other commands, sensor noise only."""
    lines = [
        "| command, noise | method | 90 % intervals hold | worst within 3 |"
        " K, omega_n, xi, median of the runs | median error of K, omega_n, xi |",
        "|---|---|---|---|---|---|",
    ]
    for (command, noise, method), found in results.items():
        lines.append(_row(f"{command}, {noise}", method, found))
    return "\n".join(lines)


def _row(name: str, method: str, found: Runs) -> str:
    if float(np.mean(np.isnan(found.reading))) > 0.1:
        shown = ["often no servo", "often no servo"]
    else:
        shown = [
            ", ".join(f"{100 * value:+.1f}" for value in found.reading_bias) + " %",
            ", ".join(f"{100 * value:.1f}" for value in found.reading_error) + " %",
        ]
    return (
        f"| {name} | {NAMES[method]} | {100 * found.coverage:.1f} % |"
        f" {100 * found.within_three:.1f} % | {shown[0]} | {shown[1]} |"
    )


def between_marks(page: str, name: str, text: str) -> str:
    """Replaces what stands between the two comments of this name."""
    start, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
    before, rest = page.split(start)
    _, after = rest.split(end)
    return f"{before}{start}\n{text}\n{end}{after}"


def all_runs(tasks: Sequence[Callable[[], Runs]]) -> list[Runs]:
    """Runs them on all cores."""
    with workers(worker_count()):
        return run_tasks(tasks)


def main() -> None:
    """Run the study; write pictures and tables."""
    keys = [(method, noise) for noise in NOISES for method in METHODS]
    tasks: list[Callable[[], Runs]] = [partial(run, method, noise, SEEDS) for method, noise in keys]
    batches: list[tuple[str, Noise]] = [("batch", noise) for noise in SENSOR]
    tasks += [partial(run_batch, noise, SEEDS) for _, noise in batches]
    others = [(command, noise, "riv") for command in ("gaussian", "prbs") for noise in SENSOR]
    tasks += [partial(run, method, noise, SEEDS, command) for command, noise, method in others]
    found = all_runs(tasks)
    n = len(keys) + len(batches)
    results = {
        (method, noise.name): runs
        for (method, noise), runs in zip(keys + batches, found[:n], strict=True)
    }
    rest = {
        (command, noise.name, method): runs
        for (command, noise, method), runs in zip(others, found[n:], strict=True)
    }
    errors_over_time().savefig(HERE / "errors.png", dpi=110)
    coverage(results).savefig(HERE / "coverage.png", dpi=110)
    poles(results).savefig(HERE / "poles.png", dpi=110)
    page = PAGE.read_text(encoding="utf-8")
    page = between_marks(page, "matrix", table(results))
    page = between_marks(page, "other commands", other_commands(rest))
    PAGE.write_text(page, encoding="utf-8")
    print(f"{len(SEEDS)} runs of {N_SAMPLES} samples each")


if __name__ == "__main__":
    main()

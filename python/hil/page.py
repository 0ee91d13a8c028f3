# SPDX-License-Identifier: MIT
"""Page and figures of runs with the hardware in the loop, and the files of `ehsid hil`."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.models.estimation.advice import servo_words
from ehsid.harness.models.estimation.servo import ServoPath
from ehsid.harness.show.model_blocks import servo_table
from ehsid.harness.show.model_figures import draw_servo_value
from ehsid.harness.show.page import Page, Picture, Section, Table
from ehsid.harness.show.plotting import GREEN, GREY, ORANGE, VERMILION, stacked, styled
from ehsid.harness.show.rendering import write_page
from ehsid.harness.show.units import percent

from .answers import Identity
from .comparison import Agreement, rmse
from .cycles import Cycles
from .recording import ESTIMATES, RECORD
from .result_file import HilFile, Provenance, Runs, hil_file
from .run import RunResult


def _time(run: RunResult) -> FloatArray:
    return run.plan.times_s[run.numbers]


def _limits(curves: npt.NDArray[np.floating[Any]]) -> tuple[float, float]:
    """Returns the limits of an axis, from quantiles of the curves after their first fifth.

    After a vague start or a reset, a few samples lie far outside the range of interest.
    """
    low, high = (float(x) for x in np.quantile(curves[len(curves) // 5 :], [0.01, 0.99]))
    margin = 0.2 * (high - low) + 1e-12
    return low - margin, high + margin


def _events(axes: Axes, run: RunResult) -> None:
    """Marks with vertical lines where target or estimator began anew, or the plant changed."""
    if run.plan.change_at is not None:
        axes.axvline(run.plan.change_at * run.plan.dt_s, color=GREY, linewidth=1.0)
    for sample in (*run.restarts, *run.begun, *run.machines):
        axes.axvline(run.plan.times_s[sample], color=VERMILION, linewidth=1.0, linestyle=":")


@styled
def estimates_figure(runs: Sequence[tuple[str, RunResult, Agreement]]) -> Figure:
    """Draws parameters and forgetting factor over time, one column for each run.

    The target is drawn in colour, the host dashed.
    """
    figure = Figure(figsize=(max(8.0, 3.1 * len(runs)), 7.5))
    grid = figure.subplots(
        3, len(runs), sharex=True, sharey="row", squeeze=False, height_ratios=[3, 3, 1.2]
    )
    orders = runs[0][1].plan.configuration.estimator.orders
    groups = (
        (range(orders.na), 1.0, "a"),
        (range(orders.na, orders.na + orders.nb), 1e3, "b in mm/V"),
    )
    for row, (members, scale, label) in enumerate(groups):
        where = list(members)
        limits = [_limits(scale * agreement.replay.theta[:, where]) for *_, agreement in runs]
        for column, (name, run, agreement) in enumerate(runs):
            axes, time = grid[row, column], _time(run)
            for i in where:
                axes.plot(time, scale * agreement.theta[:, i], linewidth=2.0, label=orders.names[i])
                axes.plot(time, scale * agreement.replay.theta[:, i], "k--", linewidth=0.6)
            _events(axes, run)
            axes.margins(x=0.0)
            if row == 0:
                axes.set_title(name)
        grid[row, 0].set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
        grid[row, 0].set_ylabel(label)
        grid[row, -1].legend(loc="upper right")
    for column, (_, run, _) in enumerate(runs):
        axes = grid[2, column]
        axes.plot(_time(run), [r.forgetting_factor for r in run.arx_results], color=GREEN)
        axes.set_xlabel("time in s")
    grid[2, 0].set_ylabel("lambda")
    return figure


@styled
def servo_figure(run: RunResult, servo: ServoPath, host: ServoPath) -> Figure:
    """Draws K, omega_n and xi over time with their bands, and those of the host dashed."""
    figure, rows = stacked(8.0, [1, 1, 1], xlabel="time in s")
    for axes, value, ours in zip(rows, servo, host, strict=True):
        draw_servo_value(axes, _time(run), value)
        axes.plot(_time(run), ours.path, "k--", linewidth=0.6)
        _events(axes, run)
    rows[0].set_xlim(0.0, _time(run)[-1] + run.plan.dt_s)
    return figure


@styled
def control_figure(run: RunResult) -> Figure:
    """Draws reference and position, their difference, the command, and the gain of the target."""
    figure, (path, error, command, gain) = stacked(8.0, [2, 1, 1, 1.5], xlabel="time in s")
    time, controller = _time(run), run.plan.configuration.controller
    reference = run.plan.reference_m[run.numbers]
    path.plot(time, 1e3 * reference, "k--", linewidth=1.0, label="reference")
    path.plot(time, 1e3 * run.position_m[: time.size], linewidth=1.2, label="position")
    path.set_ylabel("mm")
    path.legend(ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    error.plot(time, 1e3 * (reference - run.position_m[: time.size]), linewidth=0.8)
    error.set_ylabel("error in mm")
    command.plot(time, run.command_v, linewidth=0.8)
    command.set_ylabel("command in V")
    used = np.array([result.gain_v_m for result in run.results])
    retuned = np.array([result.gain_estimated for result in run.results])
    gain.plot(time, used, linewidth=1.2, label="gain used")
    fixed, bounds = controller.fixed_gain_v_m, (controller.gain_min_v_m, controller.gain_max_v_m)
    gain.axhline(fixed, color=GREY, linestyle="--", linewidth=1.0, label="fixed")
    gain.axhspan(*bounds, color=ORANGE, alpha=0.12, label="bounds")
    gain.fill_between(
        time,
        0.0,
        0.06,
        where=retuned.tolist(),
        transform=gain.get_xaxis_transform(),
        color=GREEN,
        alpha=0.6,
        linewidth=0.0,
        label="from the estimate",
    )
    gain.set_ylabel("gain in V/m")
    gain.legend(ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    for axes in (path, error, command, gain):
        _events(axes, run)
        axes.margins(x=0.0)
    return figure


@styled
def cycles_figure(cycles: Cycles) -> Figure:
    """Draws the time of each cycle, and marks those that were lost or whose command came late."""
    figure = Figure(figsize=(8.0, 2.8))
    axes = figure.subplots()
    start, lasted = cycles.times_s, 1e3 * cycles.durations_s
    axes.plot(start, lasted, ".", color=GREY, markersize=2.0, label="cycle")
    marks = ((cycles.lost, VERMILION, "x", "lost"), (cycles.overrun, ORANGE, "o", "late command"))
    for at, color, marker, label in marks:
        axes.plot(start[at], lasted[at], marker, color=color, markersize=4.0, label=label)
    axes.set(xlabel="time in s", ylabel="cycle time in ms", xlim=(0.0, start[-1]))
    axes.legend(ncols=3, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


# With a larger share of samples at the command limit, a servo no longer follows its reference.
MUCH_LIMITED = 0.1


def _version(identity: Identity) -> str:
    return ".".join(map(str, identity.firmware))


def lead(identity: Identity, runs: Runs) -> list[str]:
    """Returns the result of the runs in a few sentences."""
    unequal = [name for name, _, agreement in runs if not agreement.equal]
    samples = sum(len(run.results) for _, run, _ in runs)
    seconds = sum(run.seconds for _, run, _ in runs)
    sentences = [
        f"The estimator of ehsid {_version(identity)} on {identity.board} was led through "
        f"{samples} samples in lock step, {samples / max(seconds, 1e-9):.0f} a second."
    ]
    if not unequal:
        what = (
            "K, omega_n and xi with their intervals, every reason why they are not trusted, and "
            "every status"
            if runs[0][2].servo
            else "every parameter, innovation, forgetting factor, residual variance and status"
        )
        sentences.append(
            f"Its estimates are bit for bit those of the host's estimator on the same data: {what}."
        )
    for name, _, agreement in runs:
        if agreement.servo is not None:
            words = " ".join(servo_words(agreement.servo))
            sentences.append(f"{name}: {agreement.servo}. {words}".rstrip())
    for name, run, _ in runs:
        if run.plan.cycles is not None:
            sentences.append(f"{name}: {run.plan.cycles}.")
    for name, _, agreement in runs:
        if not agreement.equal:
            sentences.append(f"{name}: {agreement.sentence}.")
    for name, run, _ in runs:
        limited = float(np.mean([result.limited for result in run.results]))
        if limited > MUCH_LIMITED:
            sentences.append(
                f"{name}: the command is at its limit for {percent(limited)} of the time: the "
                "loop swings, or the reference is too fast; a lower --bandwidth may help."
            )
        if run.restarts:
            where = ", ".join(str(sample) for sample in run.restarts)
            sentences.append(f"{name}: the target was reset before sample {where} and went on.")
        if run.machines:
            first, last = min(run.machines), max(run.machines)
            values = [f"{key} = {size:.4g}" for key, size in run.machines[last].items()]
            sentences.append(
                f"{name}: the user changed the simulated machine, first before sample {first}, and "
                f"last before sample {last}: {', '.join(values) or 'the rig as its file says'}."
            )
        if run.begun:
            where = ", ".join(map(str, sorted(run.begun)))
            sentences.append(
                f"{name}: the user let the estimator begin anew before sample {where}."
            )
    return sentences


def _tables(runs: Runs) -> list[Table]:
    """Returns what was estimated in each run."""
    if runs[0][2].servo is None:
        return [parameter_table(runs)]
    tables = []
    for name, _, agreement in runs:
        assert agreement.servo is not None
        told = servo_table(agreement.servo)
        caption = (
            f"{name}: each value where it was trusted last, or else at the end, with its 90 % "
            f"interval, and for how long it was trusted. {told.caption.capitalize()}."
        )
        tables.append(Table(caption, told.columns, told.rows))
    return tables


def parameter_table(runs: Runs) -> Table:
    """Returns the table of the parameters at the end of each run, and of the RMSE in mm."""
    orders = runs[0][1].plan.configuration.estimator.orders
    rows = []
    for i, name in enumerate(orders.names):
        values = [float(agreement.theta[-1, i]) for *_, agreement in runs]
        deviations = [float(agreement.replay.deviation[-1, i]) for *_, agreement in runs]
        ours = [f"{v:.5g} ± {d:.2g}" for v, d in zip(values, deviations, strict=True)]
        rows.append((name, *ours))
    rows.append(("RMSE", *(f"{1e3 * rmse(run):.4g} mm" for _, run, _ in runs)))
    return Table(
        "Parameters at the end ± their standard deviation, and RMSE of the innovation.",
        ("", *(name for name, *_ in runs)),
        rows,
    )


def line_table(runs: Runs) -> Table:
    """Returns the table of the counts of events on the line between host and target."""
    rows = []
    for name, run, agreement in runs:
        last, counters = run.results[-1], run.counters
        cycles = np.median([result.step_cycles for result in run.results])
        rows.append(
            (
                name,
                str(len(run.results)),
                f"{len(run.results) / max(run.seconds, 1e-9):.0f}",
                str(counters.asked_again),
                str(counters.late),
                f"{counters.bad_frames} / {last.bad_frames}",
                str(counters.resumed),
                str(len(run.restarts)),
                f"{cycles:.0f}",
                "same" if agreement.equal else f"{agreement.different.size} other",
            )
        )
    return Table(
        "The line: samples, samples a second, requests sent again, answers that came late, frames "
        "with errors (host / target, the target's since power-up), stops of the watchdog, resets "
        "of the target, processor cycles of a step (median; an emulator's are no measure of time), "
        "and whether the estimates are the host's.",
        (
            "run",
            "samples",
            "1/s",
            "sent again",
            "late",
            "errors",
            "watchdog",
            "resets",
            "cycles",
            "bits",
        ),
        rows,
    )


def _picture(runs: Runs) -> Picture:
    _, run, agreement = runs[0]
    if agreement.servo is not None and agreement.replay.servo is not None:
        return Picture(
            servo_figure(run, agreement.servo, agreement.replay.servo),
            "K, omega_n and xi of the target with their 90 % bands, where they are trusted and "
            "where not, and those of the host on the same data (dashed).",
            "Curves of K, omega_n and xi with their bands over time, target and host on each other",
        )
    return Picture(
        estimates_figure(runs),
        "Estimates of the target (colour) and of the host on the same data (dashed), and the "
        "forgetting factor. After a vague start and a reset the first samples swing out of the "
        "picture.",
        "Curves of parameters and forgetting factor over time, target and host on each other",
    )


def hil_page(
    identity: Identity, runs: Runs, *, beside: Table | None = None, sources: Sequence[str] = ()
) -> Page:
    """Returns the page of all runs; `beside` is a table of other estimates, shown below these."""
    steady = [run for run in runs if not run[1].plan.change]
    changed = [run for run in runs if run[1].plan.change]
    tables = _tables(steady) if beside is None else [*_tables(steady), beside]
    sections = [Section("Estimates on the target", tables)]
    if changed:
        what = " and ".join(f"{n} times {x:g}" for n, x in changed[0][1].plan.change.items())
        words = f"The same, but the plant changes at half time (grey line): {what}."
        sections.append(
            Section("A change of the plant", [words, _picture(changed), *_tables(changed)])
        )
    for name, run, _ in runs:
        if run.plan.configuration.controller.position_control:
            sections.append(
                Section(
                    f"Control: {name}",
                    [
                        Picture(
                            control_figure(run),
                            "Position control on the target. The gain follows the estimate where "
                            "the bar below is green; elsewhere it is the fixed one.",
                            "Reference, position, error, command and gain over time",
                        )
                    ],
                )
            )
    for name, run, _ in runs:
        if run.plan.cycles is not None:
            picture = Picture(
                cycles_figure(run.plan.cycles),
                "Cycle times. A lost cycle has no sample; a late command acts one cycle later.",
                "Cycle times, with marks at lost cycles and late commands",
            )
            sections.append(Section(f"Cycles: {name}", [picture]))
    sections.append(Section("The line", [line_table(runs), _setup(identity, runs)]))
    return Page(
        title="Hardware in the loop",
        lead=lead(identity, runs),
        sections=sections,
        sources=sources,
        summary=[_picture(steady)],
    )


def _setup(identity: Identity, runs: Runs) -> str:
    plan = runs[0][1].plan
    controller, servo = plan.configuration.controller, plan.configuration.servo
    estimator = plan.configuration.estimator.orders if servo is None else servo
    return (
        f"Target: board {identity.board}, firmware {_version(identity)}. Rig: {plan.rig.name}, "
        f"sampled every {1e3 * plan.dt_s:g} ms. Controller: fixed gain "
        f"{controller.fixed_gain_v_m:.4g} V/m, bounds {controller.gain_min_v_m:.4g} to "
        f"{controller.gain_max_v_m:.4g} V/m, limit "
        f"{controller.command_limit_v:.4g} V. Estimator: {estimator}."
    )


REPORTS = ("hil.html", "hil.json")
# First part of the name of the folder that holds the samples of a run that is not finished.
UNFINISHED = "unfinished"


def file_names(folders: Iterable[str]) -> list[str]:
    """Returns the names of all files of a result whose runs have these folders; "" is its own."""
    samples = [str(Path(folder, name)) for folder in folders for name in (RECORD, ESTIMATES)]
    return [*samples, *REPORTS]


def copy_samples(samples: Path, folder: Path) -> None:
    """Copies the files of all runs, each in the folder of its run, into another folder."""
    for path in sorted(samples.rglob("*.csv")):
        copy = folder / path.relative_to(samples)
        copy.parent.mkdir(exist_ok=True)
        shutil.copyfile(path, copy)


def write_reports(
    out: Path,
    identity: Identity,
    runs: Runs,
    provenance: Provenance,
    *,
    beside: Table | None = None,
    sources: Sequence[str] = (),
) -> HilFile:
    """Writes hil.html and hil.json; returns the content of the latter. See `hil_page`."""
    write_page(out / REPORTS[0], hil_page(identity, runs, beside=beside, sources=sources))
    file = hil_file(identity, runs, provenance)
    write_text(out / REPORTS[1], json_text(file))
    return file

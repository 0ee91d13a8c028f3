# SPDX-License-Identifier: MIT
"""Renders the page of runs with the hardware in the loop."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ehsid.harness.models.estimation.words import servo_words
from ehsid.harness.show.model_blocks import servo_table
from ehsid.harness.show.page import Page, Picture, Section, Table
from ehsid.harness.show.shares import percent

from .answers import Identity
from .comparison import rmse
from .figures import control_figure, estimates_figure, servo_figure
from .result_file import Runs

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

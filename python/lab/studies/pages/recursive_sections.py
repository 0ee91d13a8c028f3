# SPDX-License-Identifier: MIT
"""Sections of the report on the recursive part of the experiment.

Figure of K, omega_n and xi while the estimator runs.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.show.model_blocks import loop_blocks
from ehsid.harness.show.page import Block, Picture, Section, Table
from ehsid.harness.show.plotting import PALE, draw_band, stacked, styled
from ehsid.harness.show.units import percent

from ..claims import Interval
from ..experiment import KnownPlantResults, RecordResults, RigResults, ServoReading
from ..linearisation import SampledServo
from ..reading import SIGMAS, Reading, RunSummary, summarise, summarise_change
from ..recursive import B_AFTER, QUIET_NOISE, Changed, Recursive
from ..rig_records import DT_S, MODEL_16, RECURSIVE
from .experiment_files import change_figure, error_figure

NAMES = ("K in m/(s V)", "omega_n in rad/s", "xi")


@styled
def reading_figure(reading: Reading) -> Figure:
    """Draws K, omega_n and xi over time with their 95 % bands; grey where theta is no servo."""
    figure, panels = stacked(6.0, [1, 1, 1], xlabel="time in s")
    known = np.isfinite(reading.value).all(axis=1) & np.isfinite(reading.deviation).all(axis=1)
    for i, (axes, name) in enumerate(zip(panels, NAMES, strict=True)):
        value, deviation = reading.value[:, i], reading.deviation[:, i]
        half = SIGMAS * deviation
        draw_band(axes, reading.time_s, (value - half, value, value + half), linewidth=1.2)
        if known.any():
            # The first readings vary by orders of magnitude. The axis limits follow the later ones.
            late = value[known][known.sum() // 5 :]
            middle, reach = float(np.median(late)), float(np.ptp(late))
            margin = 0.5 * reach + 3.0 * float(np.median(deviation[known])) + 1e-12
            axes.set_ylim(min(late.min(), middle) - margin, max(late.max(), middle) + margin)
        for time, status in zip(reading.time_s, reading.status, strict=True):
            if status != "ok":
                axes.axvspan(time - reading.time_s[0], time, color=PALE, linewidth=0)
        axes.set_ylabel(name)
    return figure


THETA_NAMES = ("a1", "a2", "a3", "b1", "b2", "b3")


def interval_text(interval: Interval) -> str:
    """Returns the median and its interval in brackets."""
    return f"{interval.median:.3g} [{interval.low:.3g}, {interval.high:.3g}]"


def speed_table(summaries: Mapping[str, RunSummary], caption: str, unit: str = "s") -> Table:
    """Returns the table of parameter errors, settling time, spread and RMSE for each contender."""
    rows = []
    for name, summary in summaries.items():
        settled = interval_text(summary.settled_s)
        if summary.never == 1.0:
            settled = "never"
        elif summary.never > 0.5:
            settled = f"not in {percent(summary.never)} of the runs"
        elif not np.isfinite(summary.settled_s.low):  # too few runs for an interval
            settled = f"{summary.settled_s.median:.3g}"
        rows.append(
            (
                name,
                *(f"{100.0 * at.median:.2f}" for at in summary.error_at.values()),
                settled,
                f"{100.0 * summary.spread.median:.3g}",
                f"{summary.rmse.median:.3g}",
            )
        )
    return Table(
        caption,
        (
            "lambda",
            *(f"{t:g} {unit}" for t in next(iter(summaries.values())).error_at),
            f"settled, {unit}",
            "spread, %",
            "RMSE",
        ),
        rows,
    )


SPEED_CAPTION = (
    "Parameter error |theta_hat - theta| / |theta| in %, median of the runs; time after which it "
    "stays below 5 %, with the 95 % interval of the median; spread of the estimate over the last "
    "quarter; RMSE of the innovation. The intervals of the others are in the JSON file."
)


def change_table(changed: Changed) -> Table:
    """Returns the table of the settling times after a change, and of the reset.

    For the reset, the table has the share of the runs in which it fired, its delay in samples, and
    the share of false alarms.
    """
    rows = []
    for name, summary in summarise_change(changed).items():

        def cell(interval: Interval, never: float) -> str:
            return "not in most runs" if never > 0.5 else interval_text(interval)

        rows.append(
            (
                name,
                cell(summary.without, summary.never_without),
                cell(summary.with_reset, summary.never_with),
                percent(summary.fired),
                "" if summary.delay is None else interval_text(summary.delay),
                percent(summary.false_alarms),
            )
        )
    return Table(
        "Samples after the change until the error stays below 5 %; runs in which the reset fired, "
        "its delay in samples, and runs with a reset before the change.",
        ("lambda", "without reset", "with reset", "fired", "delay", "false alarms"),
        rows,
    )


def _change_section(title: str, words: str, caption: str, changed: Changed) -> Section:
    """Returns the section on the runs with a change of the plant, from 2 s before to 15 s after."""
    window = slice(changed.at - round(2.0 / DT_S), changed.at + round(15.0 / DT_S))
    return Section(
        title,
        [
            words,
            Picture(
                change_figure(changed.outcomes, DT_S, changed.at, window),
                f"{caption} of the parameters around the change, median of the runs; dashed "
                "without, solid with reset.",
                "Curves of the parameter error from 2 s before to 15 s after the change",
            ),
            change_table(changed),
        ],
    )


def _run_blocks(
    run: Recursive,
    summaries: Mapping[str, RunSummary],
    caption: str,
    *,
    start: str = "",
    step: float = DT_S,
    unit: str = "s",
    table_caption: str = SPEED_CAPTION,
) -> list[Block]:
    """Returns the picture and the table of the runs from one start."""
    return [
        f"P(0) = {run.p0:.2g} I{start}:",
        Picture(
            error_figure(run.outcomes, step),
            caption,
            f"Parameter error over time on a logarithmic axis, P0 = {run.p0:.2g}",
        ),
        speed_table(summaries, table_caption, unit),
    ]


def parameter_table(run: Recursive, summaries: Mapping[str, RunSummary]) -> Table:
    """Returns the table of the true parameters, our final estimates and those of the paper."""
    rows = []
    for i, parameter in enumerate(THETA_NAMES):
        ours = [f"{summary.theta[i]:.4f}" for summary in summaries.values()]
        published = [f"{column.theta[i]:.4f}" for column in RECURSIVE.values()]
        rows.append((parameter, f"{MODEL_16[i]:.4f}", *ours, *published))
    ours = [f"{summary.rmse.median:.4f}" for summary in summaries.values()]
    rows.append(("RMSE", "", *ours, *(f"{column.rmse:.4f}" for column in RECURSIVE.values())))
    return Table(
        f"Table 3 for P(0) = {run.p0:.2g} I: parameters after 100 s and RMSE of the innovation, "
        "median of the runs. The paper's columns are of its own rig, whose data were not "
        "published, and no target.",
        ("", "truth", *summaries, *(f"paper, {name}" for name in RECURSIVE)),
        rows,
    )


def published_table() -> Table:
    """Returns the table of the paper's recursive estimates: final parameters and RMSE."""
    columns = RECURSIVE.values()
    rows = [
        (name, *(f"{column.theta[i]:.4f}" for column in columns))
        for i, name in enumerate(THETA_NAMES)
    ]
    rows.append(("RMSE", *(f"{column.rmse:.4f}" for column in columns)))
    return Table(
        "The paper's Table 3, of its own rig, whose data were not published, in units that it does "
        "not tell: no target.",
        ("", *RECURSIVE),
        rows,
    )


def known_plant_sections(results: KnownPlantResults, runs: int) -> list[Section]:
    """Returns the sections on part (a), the runs on model (16)."""
    blocks: list[Block] = [
        (
            f"Third-order ARX at 50 ms for 100 s, {runs} runs (seeds 0 to {runs - 1}), float32, "
            "multisine of 0.05 to 5 Hz and rms 1.5. White equation error of deviation "
            f"{results.noise:.4f}: with it the offline model's simulation fits as the paper's. "
            "The three of the paper are Eqs. (12)-(14) and nothing else; the default policy runs "
            "with its guards. All start from theta = 0."
        )
    ]
    for run in results.runs:
        start = (
            ", a vague start"
            if run is results.runs[0]
            else ", a start that leaves lambda = 1 an error as large as that of the paper's column"
        )
        summaries = {name: summarise(o, DT_S) for name, o in run.outcomes.items()}
        caption = (
            "Figs. 9 and 10: error of the parameters, median and 5 to 95 % of the runs; below, the "
            "forgetting factor of the first run."
        )
        blocks += [
            *_run_blocks(run, summaries, caption, start=start),
            parameter_table(run, summaries),
        ]
    change = _change_section(
        "A change of model (16), without and with the reset of Fig. 4",
        f"At 50 s all b grow by {percent(B_AFTER - 1.0)}; equation error "
        f"{QUIET_NOISE:g}; vague start.",
        "Fig. 11: error",
        results.changed,
    )
    plant = Section("Model (16) as a plant", loop_blocks(results.loop, DT_S))
    return [plant, Section("Recursive, on model (16) as the known truth", blocks), change]


def rig_sections(results: RigResults, runs: int, name: str) -> list[Section]:
    """Returns the sections on part (b), the runs on the nonlinear rig."""
    blocks: list[Block] = [
        (
            f"{runs} records of 100 s of {name}, each with a multisine and noise of its own. The "
            "reference is the offline model of the first part; errors are of the scaled "
            "parameters, signals divided by their standard deviations."
        )
    ]
    caption = (
        "Error against the offline model, median and 5 to 95 % of the runs; below, the forgetting "
        "factor of the first run."
    )
    for run in results.runs:
        summaries = {contender: summarise(o, DT_S) for contender, o in run.outcomes.items()}
        blocks += _run_blocks(run, summaries, caption)
    change = ", ".join(f"{key} = {value:g}" for key, value in results.change.items())
    return [
        Section("Recursive, on the nonlinear rig", blocks),
        _change_section(
            "A change of the rig, without and with the reset",
            f"From 50 s on {change}; the reference is then the offline model of that rig.",
            "Error",
            results.changed,
        ),
        reading_section(results.servo),
    ]


def record_sections(results: RecordResults, dt_s: float | None, name: str) -> list[Section]:
    """Returns the sections on the recursive estimates from a user's own record."""
    blocks: list[Block] = [
        f"All contenders on {name}, once; the reference is the offline model above, so that what "
        "they reach is agreement with it, not truth."
    ]
    step = dt_s or 1.0
    for run in results.runs:
        length = next(iter(run.outcomes.values())).error.shape[1] * step
        times = tuple(round(share * length, 3) for share in (0.05, 0.2, 0.5, 1.0))
        summaries = {n: summarise(o, step, times) for n, o in run.outcomes.items()}
        blocks += _run_blocks(
            run,
            summaries,
            "Distance of the parameters from the offline model; below, the forgetting factor.",
            step=step,
            unit="samples" if dt_s is None else "s",
            table_caption=SPEED_CAPTION.replace(", median of the runs", ""),
        )
    sections = [Section("Recursive, on the record", blocks)]
    return sections if results.servo is None else [*sections, reading_section(results.servo)]


def reading_section(servo: ServoReading) -> Section:
    """Returns the section on K, omega_n and xi over time, and the rig values computed from them."""
    reading, rig = servo.reading, servo.rig
    refused = {status for status in reading.status if status != "ok"}
    share = sum(status == "ok" for status in reading.status) / len(reading.status)
    blocks: list[Block] = [
        (
            "Varying factor on the record of the offline part; theta is a servo (5) in "
            f"{percent(share)} of the readings"
            + (f"; else: {', '.join(sorted(refused))}." if refused else ".")
        ),
        Picture(
            reading_figure(reading),
            "K, omega_n and xi with their 95 % bands; grey where theta is no servo.",
            "Three curves over time with bands that narrow",
        ),
    ]
    if rig is None:
        blocks.append(
            "The estimates give no values of oil and load: there is no reading, or no rig."
        )
    else:
        blocks.append(
            Table(
                "What the last reading says of the rig, with the 95 % interval that the estimate's "
                "covariance gives. All other values of the rig file count as known.",
                ("", "estimate", "low", "high"),
                [
                    (name, *(f"{scale * value:.4g}" for value in triple))
                    for name, triple, scale in (
                        ("velocity gain K in m/(s V)", rig.velocity_gain, 1.0),
                        (
                            "bulk modulus in MPa, from omega_n and mass",
                            rig.bulk_modulus_pa,
                            1e-6,
                        ),
                        ("mass in kg, from omega_n and the bulk modulus", rig.mass_kg, 1.0),
                    )
                ],
            )
        )
    if servo.sampled is not None:
        blocks.append(_sampled_table(servo.sampled))
    return Section("Physical reading", blocks)


def _sampled_table(sampled: SampledServo) -> Table:
    """Returns the table that compares the estimate with the sampled servo read from it."""
    columns = (sampled.estimate, sampled.ours, sampled.by_control)
    difference = float(np.max(np.abs(sampled.ours - sampled.by_control)))
    return Table(
        f"The servo (5) of the last reading, K = {sampled.gain:.4g} m/(s V), omega_n = "
        f"{sampled.omega_n:.4g} rad/s, xi = {sampled.xi:.3g}, sampled with a zero-order hold: by "
        "ehsid.discretise and by python-control, which differ by "
        f"{difference:.1g} at most. The a of the estimate differ by its integrator, which is not "
        "exactly at z = 1; its b differ where the plant is not a sampled servo, or where they are "
        "uncertain.",
        ("", "estimate", "ehsid.discretise", "python-control"),
        [
            (name, *(f"{value:.6g}" for value in row))
            for name, row in zip(THETA_NAMES, np.column_stack(columns), strict=True)
        ],
    )

# SPDX-License-Identifier: MIT
"""Draws what a record shows over what the rig says, and measured beside expected speeds.

The table of a check of a rig against records, and its files.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, NullLocator

from ..base.encoding import json_text
from ..base.error_words import printable
from ..base.files import write_text
from ..fitness import Finding, RecordCheck, Status, rig_check_file
from ..rigs import Rig
from .page import Table, Tagged
from .plotting import BLUE, CONFIGURED, GREY, INK, MEASURED, PALE, VERMILION, kept_samples, styled

COLOURS = {Status.fits: BLUE, Status.does_not_fit: VERMILION, Status.cannot_be_told: GREY}
TICKS = (0.25, 0.33, 0.5, 0.67, 0.8, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0)
# Factors beyond this are drawn at the edge, with their number.
WIDEST = 4.0
MOST_SAMPLES = 4000


@styled
def rig_check_figure(check: RecordCheck) -> Figure:
    """Draws a row for each finding on one record, and below it the speeds over time."""
    rows = len(check.findings)
    figure = Figure(figsize=(9.0, 3.4 + 0.34 * rows))
    top, bottom = figure.subplots(2, 1, height_ratios=[0.34 * rows + 0.4, 2.4])
    _factors(top, check)
    _speeds(bottom, check)
    top.set_title(printable(check.record), parse_math=False)
    return figure


def _factors(axes: Axes, check: RecordCheck) -> None:
    for row, finding in enumerate(check.findings):
        colour = COLOURS[finding.status]
        if finding.factor is None:
            axes.text(1.0, row, str(finding.status), color=colour, ha="center", va="center")
            continue
        low, high = finding.fitting or (None, None)
        if high is not None:
            left = 1.0 / WIDEST if low is None else max(low, 1.0 / WIDEST)
            axes.barh(row, min(high, WIDEST) - left, left=left, height=0.5, color=PALE)
        factor = min(max(finding.factor, 1.0 / WIDEST), WIDEST)
        axes.plot(factor, row, "o", color=colour)
        axes.annotate(
            f"{finding.factor:.3g}",
            (factor, row),
            xytext=(8, 0),
            textcoords="offset points",
            va="center",
            color=colour,
        )
    axes.axvline(1.0, color=INK, linewidth=0.8)
    axes.set_xscale("log")
    axes.set_xlim(0.9 / WIDEST, 1.3 * WIDEST)
    axes.xaxis.set_major_locator(FixedLocator(TICKS))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_yticks(range(len(check.findings)), [finding.check for finding in check.findings])
    axes.set_ylim(len(check.findings) - 0.5, -0.5)
    axes.grid(False, axis="y")
    axes.set_xlabel("what the record shows over what the rig says; grey: fits")


def _speeds(axes: Axes, check: RecordCheck) -> None:
    measured = 1e3 * check.speed_m_s
    signals = [measured]
    if check.expected_m_s is not None:
        signals.append(1e3 * check.expected_m_s)
    # Ten seconds show what there is to see; more are a band of ink.
    shown = check.time_s - check.time_s[0] <= 10.0
    signals = [signal[shown] for signal in signals]
    at = kept_samples(signals, MOST_SAMPLES)
    time = check.time_s[shown][at]
    axes.plot(time, signals[0][at], color=MEASURED, label="measured")
    if len(signals) > 1:
        axes.plot(
            time,
            signals[1][at],
            color=CONFIGURED,
            linewidth=0.9,
            label="by the rig's values",
        )
        axes.legend(ncols=2, loc="upper right")
    axes.margins(x=0.0)
    reach = 1.35 * float(np.max([np.abs(signal).max() for signal in signals]))
    axes.set_ylim(-reach, reach)
    axes.set_xlabel("time in s")
    axes.set_ylabel("speed in mm/s")


KINDS = {"fits": "good", "does not fit": "bad", "cannot be told": "soft"}


def check_table(findings: Sequence[Finding]) -> Table:
    """Returns the outcome of each check, and the reason."""
    rows = [
        (one.check, Tagged(str(one.status), kind=KINDS[one.status]), one.text) for one in findings
    ]
    return Table("", ("check", "outcome", "why"), rows)


def pictures_of(records: int) -> list[str]:
    """Returns the names of the pictures for a number of records."""
    return [f"rig_check_{i + 1}.png" for i in range(records)]


def files_of(records: int) -> list[str]:
    """Returns the names of all files for a number of records."""
    return ["rig_check.json", *pictures_of(records)]


def write_rig_check(folder: Path, rig: Rig, checks: Sequence[RecordCheck]) -> None:
    """Writes rig_check.json and a picture of each record into a folder that exists."""
    # matplotlib takes a second to import, and the names of the files are needed without pictures.

    write_text(folder / "rig_check.json", json_text(rig_check_file(rig.name, checks)))
    for name, check in zip(pictures_of(len(checks)), checks, strict=True):
        rig_check_figure(check).savefig(folder / name, dpi=120, format="png")

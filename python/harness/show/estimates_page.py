# SPDX-License-Identifier: MIT
"""The files of the estimates of a folder: page with its figure, table and data."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.encoding import json_text
from ..base.error_words import printable
from ..base.files import write_text
from ..base.numbers import plain_number
from ..models.estimation import Coefficient, Estimates
from ..models.estimation.servo import KEYS
from . import rendering
from .page import Block, Page, Picture, Section, Table
from .plotting import BLUE, GREY, SKY, VERMILION, stacked, styled

FILES = ("estimates.html", "estimates.json", "estimates.csv")
# Outliers that the first sentences name; the table has all.
MOST_NAMED = 5
# An axis ends this many times the range between the quantiles beyond them; what lies farther away
# is drawn as a triangle at its end.
MARGIN = 1.5
# Outliers with a name in the figure, in each panel; the tables name all.
MOST_LABELLED = 4
# More records cannot be told apart in the width of a page.
MOST_DRAWN = 400


def write_estimates(found: Estimates, folder: Path) -> None:
    """Writes the files `FILES` into a folder that exists."""
    write_text(folder / "estimates.json", json_text(found))
    write_text(folder / "estimates.csv", estimates_table(found))
    rendering.write_page(folder / "estimates.html", estimates_page(found))


def estimates_table(found: Estimates) -> str:
    """Returns one line for each record, and for each file with a message, as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    figures = ("one_step_fit_percent", "simulation_fit_percent", "rmse", "resets")
    states = ("converged", "residuals_white")
    names = _names(found)
    intervals = []
    for name in names:
        level = 90 if name in KEYS else 95
        intervals += [name, f"{name}_low{level}", f"{name}_high{level}"]
    writer.writerow(
        ["file", "samples", "dt_s", *intervals, *figures, *states, "warnings", "message"]
    )
    for one in found.records:
        numbers = [number for name in names for number in one.interval(name)]
        cells = ["" if math.isnan(number) else number for number in numbers]
        cells += [one.estimate[figure] for figure in figures]
        cells += [str(one.estimate[state]).lower() for state in states]
        writer.writerow([one.file, one.samples, one.dt_s, *cells, "; ".join(one.warnings), ""])
    for file, message in found.failed.items():
        blank = [""] * (2 + len(intervals) + len(figures) + len(states) + 1)
        writer.writerow([file, *blank, message])
    return text.getvalue()


def coefficient_table(found: Estimates, caption: str = "") -> Table:
    """Returns the range of each coefficient over the records, and what each states for itself."""
    rows = [
        [
            one.name,
            f"{one.median:.5g}",
            plain_number(one.spread, 2),
            plain_number(one.standard_deviation, 2),
            f"{one.low:.5g}",
            f"{one.high:.5g}",
        ]
        for one in found.coefficients
    ]
    headings = ("coefficient", "median", "spread", "own deviation", "5 %", "95 %")
    return Table(caption, headings, rows)


def estimates_lead(found: Estimates) -> list[str]:
    """Returns the result in a few sentences."""
    count = len(found.records)
    sentences = [
        f"{_number(count, 'record')} estimated: na = {found.na}, nb = {found.nb}, "
        f"nk = {found.nk}, {found.method}, {found.forgetting}."
    ]
    files = list(dict.fromkeys(one.file for one in found.outliers))
    if files:
        more = f" and {len(files) - MOST_NAMED} more" if len(files) > MOST_NAMED else ""
        sentences.append(
            f"Far from the others: {', '.join(files[:MOST_NAMED])}{more}. Compare these machines, "
            "or the conditions of these records, with the others."
        )
    elif found.limit is not None:
        sentences.append("No record is far from the others.")
    else:
        sentences.append("With fewer than five records there is no telling which is unusual.")
    if found.compared < count:
        sentences.append(
            f"{_number(count - found.compared, 'record')} with another sampling time left out of "
            "the comparison."
        )
    warned = sum(bool(one.warnings) for one in found.records)
    if warned:
        sentences.append(f"{_number(warned, 'record')} with warnings; see the table.")
    if found.failed:
        sentences.append(f"{_number(len(found.failed), 'file')} could not be used; see the list.")
    return sentences


def _number(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def estimates_page(found: Estimates) -> Page:
    """Returns the whole page."""
    sections = [_coefficients(found), _records(found)]
    if found.failed:
        rows = [[file, message] for file, message in found.failed.items()]
        sections.append(
            Section("Files that could not be used", [Table("", ["file", "message"], rows)])
        )
    return Page(
        "A folder of records: coefficients side by side",
        estimates_lead(found),
        sections,
        summary=[
            Picture(
                estimates_figure(found),
                "Each point is a record with its interval of 95 % (K, omega_n and xi: 90 %), "
                "numbered as in the table. Shaded: the range of 90 % of the records; line: their "
                "median. Red: far from the others. A triangle lies outside of the axis.",
                "Coefficients of all records with their intervals",
            )
        ],
    )


def _names(found: Estimates) -> list[str]:
    """Returns K, omega_n and xi where a record was read as a servo, and the coefficients."""
    records = found.records
    servo = [name for name in KEYS if any(one.estimate["servo"] for one in records)]
    return [*servo, *records[0].estimate["parameters"]]


def _coefficients(found: Estimates) -> Section:
    blocks: list[Block] = [
        coefficient_table(
            found,
            "Coefficients over the compared records. The spread is a standard deviation, from the "
            "median absolute deviation; the own deviation is the one that a record states for "
            "itself (median). Where the spread is much larger, the machines or their working "
            "points differ.",
        ),
    ]
    if found.outliers:
        assert found.limit is not None  # without a limit no record is far from the others
        blocks.append(
            Table(
                f"Far from the others: more than {plain_number(found.limit, 3)} times the spread "
                "of the records, or the deviation of the record itself if that is larger; where "
                "all records state more than they show together, less of it counts. In a folder "
                "without outliers, this limit is exceeded with a probability of about 1 %.",
                ["record", "coefficient", "value", "distance"],
                [
                    [
                        one.file,
                        one.coefficient,
                        f"{one.value:.5g}",
                        plain_number(one.distance, 3),
                    ]
                    for one in found.outliers
                ],
            )
        )
    return Section("Coefficients", blocks)


def _records(found: Estimates) -> Section:
    names = _names(found)
    rows = [
        [
            f"{number}. {one.file}",
            str(one.samples),
            "–" if one.dt_s is None else plain_number(one.dt_s, 6),
            *(_interval(*one.interval(name)) for name in names),
            f"{one.estimate['one_step_fit_percent']:.2f}",
            _fit(one.estimate["simulation_fit_percent"]),
            "; ".join(one.warnings) or "–",
        ]
        for number, one in enumerate(found.records, 1)
    ]
    headings = ["record", "samples", "sampling time, s", *names]
    headings += ["one-step fit, %", "simulation fit, %", "warnings"]
    caption = (
        "Coefficients with half the width of their intervals of 95 %, K, omega_n and xi of 90 %."
    )
    return Section("Records", [Table(caption, headings, rows)])


def _interval(value: float, low: float, high: float) -> str:
    half = max(high - value, value - low)  # an interval that ends at 0 is cut on one side
    return "–" if math.isnan(value) else f"{value:.5g} ± {plain_number(half, 2)}"


def _fit(percent: float | None) -> str:
    return "–" if percent is None else f"{percent:.2f}"


@styled
def estimates_figure(found: Estimates) -> Figure:
    """Draws a panel for each coefficient, over the numbers of the records in the table."""
    count = len(found.coefficients)
    figure, panels = stacked(1.0 + 1.5 * count, [1.0] * count, xlabel="number of the record")
    far = {(one.file, one.coefficient) for one in found.outliers}
    drawn = _drawn(found)
    for axes, coefficient in zip(panels, found.coefficients, strict=True):
        _panel(axes, found, coefficient, drawn, far)
    panels[0].set_xlim(0.0, len(found.records) + 1.0)
    return figure


def _drawn(found: Estimates) -> list[int]:
    """Places of the records to draw: all outliers, and of the others every so many."""
    files = {one.file for one in found.outliers}
    step = -(-len(found.records) // MOST_DRAWN)
    return [i for i, one in enumerate(found.records) if i % step == 0 or one.file in files]


def _panel(
    axes: Axes,
    found: Estimates,
    coefficient: Coefficient,
    drawn: Sequence[int],
    far: set[tuple[str, str]],
) -> None:
    name = coefficient.name
    value, low, high = np.array([found.records[i].interval(name) for i in drawn]).T
    margin = MARGIN * (coefficient.high - coefficient.low) or coefficient.standard_deviation
    bottom, top = coefficient.low - margin, coefficient.high + margin
    outlier = np.array([(found.records[i].file, name) in far for i in drawn])
    number = np.array(drawn) + 1
    axes.axhspan(coefficient.low, coefficient.high, color=SKY, alpha=0.25, linewidth=0)
    axes.axhline(coefficient.median, color=GREY, linewidth=0.8)
    edge = 0.06 * (top - bottom)  # half the height of a triangle
    shown = np.clip(value, bottom + edge, top - edge)
    inside = (value >= bottom) & (value <= top)
    for which, colour in ((~outlier, BLUE), (outlier, VERMILION)):
        for mark, chosen in (
            (".", which & inside),
            ("^", which & (value > top)),
            ("v", which & (value < bottom)),
        ):
            ends = np.clip((low[chosen], high[chosen]), bottom, top)
            axes.vlines(number[chosen], *ends, color=colour, linewidth=0.8)
            axes.plot(number[chosen], shown[chosen], mark, color=colour, markersize=5)
    for i in np.flatnonzero(outlier)[:MOST_LABELLED]:
        right = number[i] > len(found.records) / 2
        text = axes.annotate(
            printable(found.records[drawn[i]].file),
            (number[i], shown[i]),
            xytext=(-6 if right else 6, 0),
            textcoords="offset points",
            horizontalalignment="right" if right else "left",
            verticalalignment="center",
            color=VERMILION,
            fontsize="small",
            parse_math=False,
        )
        text.set_in_layout(False)  # a long name does not squeeze the axes
    if top > bottom:
        axes.set_ylim(bottom, top)
    axes.set_ylabel(name)

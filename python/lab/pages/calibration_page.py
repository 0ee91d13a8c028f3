# SPDX-License-Identifier: MIT
"""Renders the page of a calibration: can probabilities, sets and intervals be believed.

Draws the reliability of the probabilities (`ehsid gap-calibrate`).

Makes the tables of the page of a calibration (`ehsid gap-calibrate`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from pathlib import Path

from matplotlib.figure import Figure as PlotFigure

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.base.numbers import plain_number
from ehsid.harness.show import rendering
from ehsid.harness.show.page import Page, Picture, Section, Table
from ehsid.harness.show.plotting import BLUE, GREY, VERMILION, styled

from ..calibration.checking import LEAST_MACHINES, Calibration, Constant, LeftOut, Probabilities
from ..calibration.fitting import FEATURES, write_features
from ..calibration.intervals import ClassOfSensors, Intervals
from ..calibration.machines import Machine
from ..calibration.reliability import Reliability
from ..scoring.figures import Figure
from .check_words import HOW_TO_READ, KINDS, MARKS, figure_text, number, plural, target_text


@styled
def reliability_drawing(each: Sequence[Probabilities]) -> PlotFigure:
    """Draws the share true over the stated probability; a panel for each kind of claim.

    Each of two sets of constants has its colour. Bars are intervals of 90 %.
    """
    drawing = PlotFigure(figsize=(9, 4.4))
    panels = drawing.subplots(1, len(each[0].reliability), squeeze=False)[0]
    for place, axes in enumerate(panels):
        axes.plot([0, 100], [0, 100], color=GREY, linewidth=1.0, linestyle="--")
        for probabilities, colour in zip(each, (VERMILION, BLUE), strict=True):
            bins = probabilities.reliability[place].bins
            at = [100.0 * group.probability for group in bins]
            axes.vlines(
                at,
                [100.0 * group.true.low for group in bins],
                [100.0 * group.true.high for group in bins],
                color=colour,
                linewidth=1.5,
                alpha=0.6,
            )
            shares = [100.0 * group.true.value for group in bins]
            axes.plot(at, shares, "o-", color=colour, markersize=5, label=probabilities.words)
        axes.set_title(each[0].reliability[place].words)
        axes.set_xlim(-2.0, 102.0)
        axes.set_ylim(-2.0, 102.0)
        axes.set_xlabel("stated probability, %")
        axes.set_ylabel("true, %")
        axes.legend(loc="upper left")
    return drawing


# A fitted constant that is farther from the one in use is marked: chance does so in one of twenty.
FAR = 2.0


def constants_table(constants: Sequence[Constant]) -> Table:
    """Returns the table of the constants; those far from the fitted ones are marked."""
    return Table(
        "Constants of the probabilities. Marked: the fitted one is more than two standard errors "
        "from the one in use.",
        ("constant", "in use", "fitted", "standard error", "fitted less in use, standard errors"),
        [
            (
                constant.name.upper(),
                plain_number(constant.in_use, 3),
                plain_number(constant.fitted, 3),
                plain_number(constant.error, 2),
                f"{constant.deviation:+.1f}",
            )
            for constant in constants
        ],
        [place for place, constant in enumerate(constants) if abs(constant.deviation) > FAR],
    )


def probabilities_table(each: Sequence[Probabilities]) -> Table:
    """Returns the table of the quality of the probabilities with both sets of constants."""
    rows = []
    for probabilities in each:
        words = probabilities.words
        rows += [
            (words, "log loss, nats", figure_text(probabilities.log_loss), "", ""),
            (words, "first answer true", figure_text(probabilities.right), "", ""),
        ]
        rows += [
            (words, f"calibration error: {one.words}", *error_cells(one))
            for one in probabilities.reliability
        ]
    return Table(
        "Quality of the probabilities. The last column: what probabilities that are meant would "
        "show with as many machines, mean and 95th percentile.",
        ("constants", "figure", "value", "target", "if meant"),
        rows,
    )


def error_cells(reliability: Reliability) -> tuple[str, str, str]:
    """Returns the expected calibration error, its target, and the error of meant probabilities."""
    if not reliability.error.n:
        return "-", "", ""
    meant = number(reliability.meant, "share"), number(reliability.meant_most, "share")
    return figure_text(reliability.error), _target(reliability.error), f"{meant[0]}; {meant[1]}"


def sets_table(each: Sequence[ClassOfSensors]) -> Table:
    """Returns the table of the coverage of sets by class of sensors."""
    return Table(
        "Sets by class of sensors, with fitted constants. Threshold: an answer is in the set if "
        "all that are more probable have at most this probability together.",
        ("sensors", "promised", "truth in the set", "", "answers in a set", "", "threshold"),
        [
            (
                one.measured,
                number(one.level, "share"),
                figure_text(one.coverage),
                MARKS[one.coverage.met],
                figure_text(one.size),
                _target(one.size),
                plain_number(one.threshold, 3)
                if math.isfinite(one.threshold)
                else "too few machines",
            )
            for one in each
        ],
        [place for place, one in enumerate(each) if one.coverage.met == "missed"],
    )


def intervals_table(each: Sequence[Intervals]) -> Table:
    """Returns the table of the shares of intervals that hold what they promise."""
    kinds = [(one.measured, kind) for one in each for kind in one.each]
    rows = [
        (
            measured,
            kind.words,
            figure_text(kind.in_use),
            _target(kind.in_use),
            *(plain_number(end, 3) if math.isfinite(end) else "-" for end in (kind.low, kind.high)),
            figure_text(kind.corrected),
        )
        for measured, kind in kinds
    ]
    return Table(
        "Intervals of 90 % that hold the true size, or the shrinkage on a third record. Ends that "
        "move outwards by these distances, shares of the size or shrinkage, would hold; the last "
        "column tests them on other machines than they come from.",
        ("sensors", "interval of", "hold", "target", "low end", "high end", "hold then"),
        rows,
        [place for place, (_, kind) in enumerate(kinds) if kind.in_use.met == "missed"],
    )


def families_table(each: Sequence[LeftOut]) -> Table:
    """Returns the table of the families that were left out, in their order."""
    return Table(
        "Families that neither the constants nor the thresholds have seen, the worst first.",
        (
            "family",
            "truth in the set",
            "promised",
            "answers in a set",
            "first answer true",
            "calibration error",
            "if meant",
        ),
        [
            (
                f"{one.trait}: {one.family}",
                figure_text(one.coverage),
                _target(one.coverage),
                figure_text(one.size),
                figure_text(one.right),
                *error_cells(one.reliability)[::2],
            )
            for one in each
        ],
        [place for place, one in enumerate(each) if one.coverage.met == "missed"],
    )


def machines_table(calibration: Calibration) -> Table:
    """Returns the table of the machines that count, and of those that were left out."""
    rows = [
        *(("kind", KINDS[kind], str(count)) for kind, count in calibration.kinds.items()),
        *(("sensors", sensors, str(count)) for sensors, count in calibration.sensors.items()),
        *(
            ("left out", reason.replace("_", " "), str(count))
            for reason, count in calibration.left_out.items()
        ),
    ]
    return Table("Machines.", ("by", "", "number"), rows)


def _target(figure: Figure) -> str:
    return ": ".join(filter(None, (target_text(figure.target, figure.unit), MARKS[figure.met])))


TITLE = "How far the probabilities of a diagnosis are meant"
PAGE, JSON = "calibration.html", "calibration.json"
FILES = (PAGE, JSON, FEATURES)
EXCHANGEABLE = (
    "All promises hold for machines that could have come from the same generator, and for no "
    "others: a real machine is none of them. The worst family that was left out tells how much "
    "that may matter."
)


def write_calibration(calibration: Calibration, machines: Iterable[Machine], folder: Path) -> None:
    """Writes the files `FILES` of a calibration into a folder that exists."""
    write_text(folder / JSON, json_text(calibration, indent=1))
    write_features(folder / FEATURES, machines)
    rendering.write_page(folder / PAGE, calibration_page(calibration))


def calibration_lead(calibration: Calibration) -> list[str]:
    """Returns the result in a few sentences, the worst family first."""
    sentences = [_worst(calibration)]
    for probabilities in calibration.probabilities:
        first = probabilities.reliability[0]
        sentences.append(
            f"{probabilities.words[0].upper()}{probabilities.words[1:]}: the first of the answers "
            f"is true in {figure_text(probabilities.right)}, with an expected calibration error "
            f"of {figure_text(first.error)}; probabilities that are meant would show "
            f"{number(first.meant, 'share')}, and less than {number(first.meant_most, 'share')} in "
            "95 of 100 cases."
        )
    sentences += [
        f"{one.measured.capitalize()}: the set holds the truth in {figure_text(one.coverage)}, "
        f"promised {number(one.level, 'share')}, with {figure_text(one.size)} answers."
        for one in calibration.sets
        if one.coverage.n
    ]
    far = [one.name.upper() for one in calibration.constants if abs(one.deviation) > FAR]
    if far:
        sentences.append(
            "More than two standard errors from their fitted values are the constants in use: "
            f"{', '.join(far)}."
        )
    if calibration.never_weighed:
        sentences.append(
            f"In {plural(calibration.never_weighed, 'machine')} with known effects the truth was "
            "not among the weighed sets; there the right answer is outside of the catalogue."
        )
    return [*sentences, EXCHANGEABLE]


def _worst(calibration: Calibration) -> str:
    if not calibration.families:
        return (
            f"No family of structure could be left out of the {calibration.machines} machines: one "
            f"needs {LEAST_MACHINES} of them, and as many others."
        )
    worst = calibration.families[0]
    return (
        f"The worst of {len(calibration.families)} families of structure that were left out is "
        f"{worst.trait}: {worst.family}. There the set holds the truth in "
        f"{figure_text(worst.coverage)}, promised {number(worst.promised, 'share')}, and the "
        f"calibration error is {figure_text(worst.reliability.error)}."
    )


def calibration_page(calibration: Calibration) -> Page:
    """Returns the page, with the worst family on top."""
    return Page(
        TITLE,
        calibration_lead(calibration),
        [
            *_families(calibration),
            Section(
                "Are the probabilities calibrated?",
                [probabilities_table(calibration.probabilities)],
            ),
            Section("Constants", [constants_table(calibration.constants)]),
            Section("Sets", [sets_table(calibration.sets)]),
            Section("Intervals", [intervals_table(calibration.intervals)]),
            Section("How this was made", [HOW_TO_READ, machines_table(calibration)]),
        ],
        sources=(
            "D. McFadden: Conditional logit analysis of qualitative choice behavior. Frontiers in "
            "Econometrics, 1974.",
            "Y. Romano, M. Sesia, E. Candès: Classification with valid and adaptive coverage. "
            "NeurIPS, 2020.",
            "V. Vovk: Conditional validity of inductive conformal predictors. ACML, 2012.",
            "J. Bröcker, L. A. Smith: Increasing the reliability of reliability diagrams. Weather "
            "and Forecasting 22(3), 2007.",
        ),
        summary=[
            Picture(
                reliability_drawing(calibration.probabilities),
                "Share that is true over the stated probability, in groups of equal numbers; bars: "
                "intervals of 90 %. On the dashed line it is meant.",
                "Reliability of the probabilities",
            )
        ],
    )


def _families(calibration: Calibration) -> list[Section]:
    if not calibration.families:
        return []
    words = (
        "Each family is left out of the fit and of the thresholds, and then tested. The worst is "
        "the one whose interval of the coverage ends lowest."
    )
    return [Section("Families that were left out", [words, families_table(calibration.families)])]

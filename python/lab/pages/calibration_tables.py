# SPDX-License-Identifier: MIT
"""Makes the tables of the page of a calibration (`ehsid gap-calibrate`)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ehsid.harness.base.plain_number import plain_number
from ehsid.harness.show.page import Table

from ..calibration.checking import Calibration, Constant, Probabilities
from ..calibration.conformal import ClassOfSensors
from ..calibration.intervals import Intervals
from ..calibration.left_out import LeftOut
from ..calibration.reliability import Reliability
from ..scoring.figures import Figure
from .check_words import KINDS, MARKS, figure_text, number, target_text

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

# SPDX-License-Identifier: MIT
"""Renders the page of a calibration: can probabilities, sets and intervals be believed."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.show import rendering
from ehsid.harness.show.page import Page, Picture, Section

from ..calibration.checking import Calibration
from ..calibration.features import FEATURES, write_features
from ..calibration.left_out import LEAST_MACHINES
from ..calibration.machines import Machine
from .calibration_plots import reliability_drawing
from .calibration_tables import (
    FAR,
    constants_table,
    families_table,
    intervals_table,
    machines_table,
    probabilities_table,
    sets_table,
)
from .check_words import HOW_TO_READ, figure_text, number, plural

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

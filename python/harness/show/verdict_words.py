# SPDX-License-Identifier: MIT
"""All that is said of a verdict as such: its title, what it means, and what to do next."""

from __future__ import annotations

from types import MappingProxyType
from typing import NamedTuple

from ..diagnosis.schema import Verdict


class VerdictWords(NamedTuple):
    """The words on one verdict."""

    title: str
    meaning: str
    """What it says about simulator and machine, in one or two sentences."""
    what_now: str
    """What to do after it, in sentences; the first one ends at a colon or a full stop."""
    where: str = "not known"
    """Answer to the question where, if no part of the machine has a share in the gap."""
    which: str = "not known"
    """Answer to the question which, if neither an effect nor a law nor a value is named."""


VERDICTS: MappingProxyType[Verdict, VerdictWords] = MappingProxyType(
    {
        "no_gap": VerdictWords(
            title="No gap",
            meaning=(
                "The simulator as configured is near the noise of the sensors, or no fit makes it "
                "clearly better. No effect is named."
            ),
            what_now=(
                "Nothing has to be changed: use the simulation as it is, for motions like those in "
                "the records. To trust it elsewhere, record the motions and loads that occur there,"
                " and diagnose again."
            ),
            where="nowhere",
            which="no effect is named",
        ),
        "parameters": VerdictWords(
            title="Values of the rig",
            meaning=(
                "Fitted values bring the simulator closer to the machine, without an effect: "
                "numbers in the rig file, or what no data sheet states."
            ),
            what_now=(
                "Take over the fitted values, which rig.augmented.toml has. Then confirm them with "
                "a record that was not used here."
            ),
            where="in the values of the rig",
            which="values within their uncertainty, and what no data sheet states",
        ),
        "effects": VerdictWords(
            title="Missing effect",
            meaning=(
                "Other values of the rig alone do not explain the records. How much of the gap the "
                "effects named here remove, on data that were not used for the fit, is told below."
            ),
            what_now=(
                "Add the effects that were found to the simulation: the file rig.augmented.toml has"
                " them. Then look at the machine for their causes, and confirm this file with a "
                "record that was not used here."
            ),
        ),
        "ambiguous": VerdictWords(
            title="Several explanations",
            meaning=(
                "More than one set of effects explains these records equally well. To name one "
                "would be a guess; another experiment can decide."
            ),
            what_now=(
                "Do not choose one of the explanations yet. Only another experiment can decide "
                "between them."
            ),
        ),
        "outside_catalogue": VerdictWords(
            title="Outside the catalogue",
            meaning=(
                "A structural gap remains that no effect of the catalogue explains. The page below "
                "shows where it lies, and the missing term as a curve where the records can tell "
                "it."
            ),
            what_now=(
                "Look at the part of the machine that the report names. No effect of the catalogue "
                "explains the gap; rig.augmented.toml has the missing term as a table where the "
                "records could tell it."
            ),
            which="no effect of the catalogue",
        ),
        "insufficient_data": VerdictWords(
            title="These records cannot be judged",
            meaning=(
                "The records lack something, or the rig and the columns describe them wrongly. The "
                "reason and what mends it stand below."
            ),
            what_now=(
                "Mend the records or their description first. The report says what is wrong."
            ),
        ),
    }
)


def what_now(verdict: Verdict, *, experiment: bool) -> str:
    """Returns what to do after a diagnosis.

    Parameters
    ----------
    verdict
        of the diagnosis.
    experiment
        whether the diagnosis has designed an experiment.
    """
    words = VERDICTS[verdict].what_now
    if experiment:
        return f"{words} The experiment below was designed for it."
    if verdict == "ambiguous":
        return (
            f"{words} None could be designed within the limits of the rig file: a "
            "record with one more sensor, such as both chamber pressures, helps most."
        )
    return words

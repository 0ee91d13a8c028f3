# SPDX-License-Identifier: MIT
"""What to do after a diagnosis, in words: by its verdict, and for the next experiment."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from types import MappingProxyType

from ..catalogue.channels import shown_channel
from ..diagnosis.schema import Verdict
from .gap_words import effect_set, first_upper
from .shares import percent

WHAT_NOW: MappingProxyType[Verdict, str] = MappingProxyType(
    {
        "no_gap": "Nothing has to be changed: use the simulation as it is, for motions like those "
        "in the records. To trust it elsewhere, record the motions and loads that occur there, and "
        "diagnose again.",
        "parameters": "Take over the fitted values, which rig.augmented.toml has. Then confirm "
        "them with a record that was not used here.",
        "effects": "Add the effects that were found to the simulation: the file "
        "rig.augmented.toml has them. Then look at the machine for their causes, and confirm this "
        "file with a record that was not used here.",
        "ambiguous": "Do not choose one of the explanations yet. Only another experiment can "
        "decide between them.",
        "outside_catalogue": "Look at the part of the machine that the report names. No effect of "
        "the catalogue explains the gap; rig.augmented.toml has the missing term as a table "
        "where the records could tell it.",
        "insufficient_data": "Mend the records or their description first. The report "
        "says what is wrong.",
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
    if experiment:
        return f"{WHAT_NOW[verdict]} The experiment below was designed for it."
    if verdict == "ambiguous":
        return (
            f"{WHAT_NOW[verdict]} None could be designed within the limits of the rig file: a "
            "record with one more sensor, such as both chamber pressures, helps most."
        )
    return WHAT_NOW[verdict]


def experiment_words(description: str, separates: Sequence[str], power: float | None) -> str:
    """Returns in two sentences what an experiment is, and what it separates how surely.

    Parameters
    ----------
    description, separates, power
        as in `gap.schema.NextExperiment`.
    """
    rivals = " from ".join(effect_set(tuple(names.split("+"))) for names in separates)
    return (
        f"{first_upper(description)}. It is made to separate {rivals}, and will do so with a "
        f"predicted probability of {percent(power)}."
    )


def experiment_steps(sensors: Sequence[str]) -> list[str]:
    """Returns how to run an experiment safely, and which columns to log; one step an item."""
    return [
        "Put the rod where the predicted position begins, and send the column command_v of "
        "next_experiment.csv to the valve amplifier as it stands, sample by sample. It keeps "
        "inside the stroke and the limits that the rig file states; keep the emergency stop at "
        "hand all the same.",
        f"Log {', '.join(shown_channel(name)[0] for name in sensors)} with the command, as in the "
        "records so far.",
    ]


def again_command(fitted: Sequence[str], judged: Sequence[str], rig_file: str) -> str:
    """Returns the command that diagnoses again with the record of the experiment, new.csv."""
    held_out = [part for file in judged for part in ("--validate", file)]
    words = ["ehsid", "gap", *fitted, "new.csv", "--rig", rig_file, *held_out, "--out", "again"]
    return shlex.join(words)

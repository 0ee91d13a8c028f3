# SPDX-License-Identifier: MIT
"""Options that choose a forgetting policy and its settings, the same in every command."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated

import typer

import ehsid

from ..catalogue.parameters import POLICIES

# The setting that --lambda0 stands for, by the name of the policy.
LAMBDA0 = {"constant": "lambda_", "exponential": "lambda0"}

if TYPE_CHECKING:
    PolicyName = str
else:  # Typer takes the words that an option allows from an enumeration.
    PolicyName = StrEnum("PolicyName", {info.id: name for name, info in POLICIES.items()})

Lambda0 = Annotated[
    float | None, typer.Option(help="factor (constant) or rate (exponential)", show_default=False)
]
PolicySettings = Annotated[
    list[str] | None,
    typer.Option(
        "--setting",
        metavar="NAME=NUMBER",
        help="setting of the forgetting policy, e.g. eta=1.5; again for more",
    ),
]


def policy_words(
    name: str, lambda0: float | None = None, settings: Sequence[str] | None = None
) -> list[str]:
    """Returns the options that choose this policy, as another command takes them."""
    words = ["--forgetting", str(name)]
    if lambda0 is not None:
        words += ["--lambda0", f"{lambda0:.12g}"]
    for one in settings or ():
        words += ["--setting", one]
    return words


def make_policy(
    name: str, lambda0: float | None = None, settings: Sequence[str] | None = None
) -> ehsid.Forgetting:
    """Returns the policy with the given settings, and the defaults of the others.

    Raises
    ------
    ValueError
        a setting does not belong to the policy, is given twice or is outside its range.
    """
    info = POLICIES[name]
    # In Python the name of a setting has an underscore behind it where it would be a keyword.
    names = {setting.member: setting.name for setting in info.settings}
    values: dict[str, float] = {}
    if lambda0 is not None:
        if name not in LAMBDA0:
            raise ValueError(
                f"--lambda0 goes with {' and '.join(LAMBDA0)} forgetting, not {name}: use --setting"
            )
        values[LAMBDA0[name]] = lambda0
    return info.policy(**read_settings(settings, names, f"{name} forgetting", values))


def servo_settings(settings: Sequence[str] | None, given: Mapping[str, bool]) -> dict[str, float]:
    """Returns the settings of a ServoEstimator that --setting gives beside --servo.

    Parameters
    ----------
    given
        options of an ARX model, and whether they are given.

    Raises
    ------
    ValueError
        an option of an ARX model is given, or a setting is none of a ServoEstimator.
    """
    wrong = [option for option, is_given in given.items() if is_given]
    if wrong:
        raise ValueError(
            f"{wrong[0]} is of an ARX model, which --servo does not use; leave one of them out"
        )
    names = {one: one for one in ("delay", "drift", "tolerance")}
    return read_settings(settings, names, "ServoEstimator", {})


def growth_settings(settings: Sequence[str] | None, given: Mapping[str, bool]) -> dict[str, float]:
    """Returns the settings of a GrowthMonitor that --setting gives beside --growth.

    given: options of estimators, and whether they are given; ValueError where one is.
    """
    wrong = [option for option, is_given in given.items() if is_given]
    if wrong:
        raise ValueError(f"{wrong[0]} is of an estimator; leave it out, or --growth")
    return read_settings(settings, {"hours": "hours"}, "GrowthMonitor", {})


def read_settings(
    settings: Sequence[str] | None, names: Mapping[str, str], of: str, given: dict[str, float]
) -> dict[str, float]:
    """Returns the numbers of --setting by their names in Python, behind those that are given.

    Parameters
    ----------
    names
        settings that there are, and what they are called in Python.
    of
        what has these settings, as an error says it.

    Raises
    ------
    ValueError
        a setting is not among the names, is given twice or is no number.
    """
    values = dict(given)
    for text in settings or ():
        member, equals, number = text.partition("=")
        setting = names.get(member.strip().removesuffix("_"), "")
        if not setting or not equals:
            raise ValueError(
                f"--setting {text}: expected NAME=NUMBER with a setting of {of}, "
                f"which has {', '.join(names)}"
            )
        if setting in values:
            raise ValueError(
                f"--setting {text}: {member} is given twice; expected each setting once"
            )
        try:
            values[setting] = float(number)
        except ValueError:
            raise ValueError(
                f"--setting {text}: expected NAME=NUMBER; '{number}' is not a number"
            ) from None
    return values

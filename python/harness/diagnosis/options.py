# SPDX-License-Identifier: MIT
"""What a user may choose of a diagnosis: one value, which every way to a diagnosis hands on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypedDict, get_args

from ..catalogue.parameters import effects
from ..rigs.checks import unknown
from .limits import Limits

Effort = Literal["list", "screened", "full"]


@dataclass(frozen=True)
class DiagnosisOptions:
    """The options of a diagnosis.

    The command line makes them in `cli/gap.py`, the Python interface of the keyword
    arguments in `DiagnosisChoices`. Workbench, fleets and the lab hand the value on as it is.

    Raises
    ------
    ValueError
        an id is not in the catalogue; the message has the nearest known id. Or the effort is none.
    """

    exclude: Sequence[str] = ()
    """Ids of effects that are not searched for, each once."""
    effort: Effort | None = None
    """How many fits the search makes: "full", each effect; "screened", those that one or two runs
    of each effect choose; "list", the same without sets of several effects. By default "full" with
    our simulator and "screened" with one of the user."""
    limits: Limits | None = None
    """What the next experiment may not pass; by default what the rig file tells."""

    def __post_init__(self) -> None:
        """Checks the ids and the effort."""
        if self.effort not in (None, *get_args(Effort)):
            raise ValueError(
                f"--effort {self.effort}: expected one of {', '.join(get_args(Effort))}"
            )
        object.__setattr__(self, "exclude", tuple(dict.fromkeys(self.exclude)))
        for effect in self.exclude:
            if effect not in effects():
                problem = unknown(effect, effects())
                end = " There are" if problem.endswith("?") else "; there are"
                raise ValueError(f"--exclude-effect {problem}{end}: {', '.join(effects())}")


class DiagnosisChoices(TypedDict, total=False):
    """The same as keyword arguments, as `ehsid.diagnose` takes them."""

    exclude: Sequence[str]
    effort: Effort | None
    limits: Limits | None


DEFAULTS = DiagnosisOptions()

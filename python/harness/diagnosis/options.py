# SPDX-License-Identifier: MIT
"""What a user may choose of a diagnosis: one value, which every way to a diagnosis hands on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypedDict

from ..catalogue.parameters import effects
from ..rigs.checks import unknown


@dataclass(frozen=True)
class DiagnosisOptions:
    """The options of a diagnosis.

    The command line makes them in `cli/gap.py`, the Python interface of the keyword
    arguments in `DiagnosisChoices`. Workbench, fleets and the lab hand the value on as it is.

    Raises
    ------
    ValueError
        an id is not in the catalogue; the message has the nearest known id.
    """

    exclude: Sequence[str] = ()
    """Ids of effects that are not searched for, each once."""

    def __post_init__(self) -> None:
        """Checks the ids."""
        object.__setattr__(self, "exclude", tuple(dict.fromkeys(self.exclude)))
        for effect in self.exclude:
            if effect not in effects():
                problem = unknown(effect, effects())
                end = " There are" if problem.endswith("?") else "; there are"
                raise ValueError(f"--exclude-effect {problem}{end}: {', '.join(effects())}")


class DiagnosisChoices(TypedDict, total=False):
    """The same as keyword arguments, as `ehsid.diagnose` takes them."""

    exclude: Sequence[str]


DEFAULTS = DiagnosisOptions()

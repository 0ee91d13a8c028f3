# SPDX-License-Identifier: MIT
"""Settings of a check: how many cases it has, of which grades, with which sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

SENSORS = ("position", "pressures", "pressures+supply", "pressures+supply+spool")
GRADES = ("plain", "hard", "confusable", "slow", "wide")
# Sets of excitations of the grade `wide`. Constants that are fitted on one set can be judged on the
# other.
EXCITATIONS = ("all", "training", "validation")

# Number of case seeds that belong to one check; no case seed belongs to two checks.
SEEDS = 100_000
LEAST_SECONDS, MOST_SECONDS = 2.0, 120.0


@dataclass(frozen=True)
class Settings:
    """Settings that determine the cases, together with the version of ehsid.

    Attributes
    ----------
    seed
        1 or more; checks with different seeds have no case in common.
    count
        number of cases, 1 to `SEEDS`.
    grades
        taken by the cases in turn, so each grade has an equal share. The score reports each grade
        separately; equal shares make the widest confidence interval as narrow as possible.
    sensors
        sensors of all cases; None: a mix.
    seconds
        length of each record, s; None: drawn for each case, 8 to 20 s (slow ones: 30 to 60 s).
    exclude_truth
        whether each case has one effect of the catalogue that the diagnosis must leave out.
    excitations
        set of which the excitations are drawn; other sets than "all" need grade `wide` alone.
    """

    seed: int = 1
    count: int = 40
    grades: tuple[str, ...] = GRADES
    sensors: str | None = None
    seconds: float | None = None
    exclude_truth: bool = False
    excitations: str = "all"

    def __post_init__(self) -> None:
        problem = self._problem()
        if problem:
            raise ValueError(problem)

    def _problem(self) -> str | None:
        if self.seed < 1:
            return f"--seed {self.seed}: expected 1 or more"
        if not 1 <= self.count <= SEEDS:
            return f"--count {self.count}: expected 1 to {SEEDS}"
        for grade in self.grades:
            if grade not in GRADES:
                return f"--grade '{grade}': expected one of {', '.join(GRADES)}"
        if not self.grades or len(set(self.grades)) < len(self.grades):
            return "--grade: name each grade once"
        if self.sensors is not None and self.sensors not in SENSORS:
            return f"--sensors '{self.sensors}': expected one of {', '.join(SENSORS)}"
        if self.seconds is not None and not LEAST_SECONDS <= self.seconds <= MOST_SECONDS:
            return (
                f"--seconds {self.seconds:g}: expected {LEAST_SECONDS:g} to {MOST_SECONDS:g}; "
                "without it lengths of 8 to 20 s are drawn"
            )
        if self.excitations not in EXCITATIONS:
            return f"--excitations '{self.excitations}': expected one of {', '.join(EXCITATIONS)}"
        if self.excitations != "all" and self.grades != ("wide",):
            return f"--excitations {self.excitations}: only grade 'wide' has sets; add --grade wide"
        return None

    def with_given(self, given: Mapping[str, Any]) -> Settings:
        """Returns these settings, with those of the given values that are not None."""
        return replace(self, **{name: value for name, value in given.items() if value is not None})

    def plain(self) -> dict[str, Any]:
        """Returns the settings as plain data for a JSON file."""
        return asdict(self) | {"grades": list(self.grades)}

    def differences(self, other: Settings) -> list[str]:
        """Describes each setting that differs from the other's, such as "count 40, not 20"."""
        mine, others = self.plain(), other.plain()
        return [
            f"{name} {_word(mine[name])}, not {_word(others[name])}"
            for name in mine
            if mine[name] != others[name]
        ]


def _word(value: Any) -> str:
    if isinstance(value, list):
        return "+".join(value)
    return "drawn" if value is None else str(value).lower()

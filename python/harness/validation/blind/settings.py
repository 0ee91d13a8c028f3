# SPDX-License-Identifier: MIT
"""What a check is made of: how many cases, of which grades, with which sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any

SENSORS = ("position", "pressures", "pressures+supply", "pressures+supply+spool")
GRADES = ("plain", "hard", "confusable")

# Seeds of the cases of one check: none is in the check of another seed.
SEEDS = 100_000
LEAST_SECONDS, MOST_SECONDS = 2.0, 120.0


@dataclass(frozen=True)
class Settings:
    """What decides the cases; with the same version of ehsid the same settings make the same ones.

    Attributes
    ----------
    seed
        1 or more; the cases of different seeds are all different.
    count
        number of cases, 1 to `SEEDS`.
    grades
        dealt out in turn, so each has an equal share: they are reported apart, and equal shares
        make the widest of their intervals as narrow as it can be.
    sensors
        of all cases; None: a mix.
    seconds
        length of each record; None: drawn for each case, 8 to 20 s.
    exclude_truth
        each case has one effect of the catalogue, and the diagnosis must do without that effect.
    """

    seed: int = 1
    count: int = 40
    grades: tuple[str, ...] = GRADES
    sensors: str | None = None
    seconds: float | None = None
    exclude_truth: bool = False

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
        return None

    def with_given(self, given: Mapping[str, Any]) -> Settings:
        """The same with those of the given ones that are not None."""
        return replace(self, **{name: value for name, value in given.items() if value is not None})

    def plain(self) -> dict[str, Any]:
        """For a file."""
        return asdict(self) | {"grades": list(self.grades)}

    @staticmethod
    def of_plain(plain: Mapping[str, Any]) -> Settings:
        """From a file.

        Raises
        ------
        ValueError
            something is missing or out of range.
        """
        missing = [one.name for one in fields(Settings) if one.name not in plain]
        if missing:
            raise ValueError(f"settings without '{missing[0]}'")
        values = {one.name: plain[one.name] for one in fields(Settings)}
        return Settings(**values | {"grades": tuple(values["grades"])})

    def differences(self, other: Settings) -> list[str]:
        """In words, each setting that is not the same: "count 40, not 20"."""
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

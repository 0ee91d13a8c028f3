# SPDX-License-Identifier: MIT
"""A machine as the calibration sees it: its weighed sets of effects, and which of them is true."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

from ehsid.harness.catalogue.parameters import effects as catalogue
from ehsid.harness.diagnosis.schema import Estimate

from ..blind.answers import Kind
from ..scoring.judging import HEALTHY, KNOWN, is_exactly
from ..scoring.reading import SENSORS

# Measures of the shrinkage of the gap: of the explainable gap, and from the rig as configured.
Measure = Literal["of_explainable", "from_nominal"]
MEASURES: tuple[Measure, ...] = get_args(Measure)


@dataclass(frozen=True)
class WeighedSet:
    """A set of effects that the decision weighed; `left`, `small`: as `posterior.Hypothesis`."""

    effects: tuple[str, ...]
    left: float
    small: float


@dataclass(frozen=True)
class Size:
    """A parameter of a rightly named effect: its estimate with a 90 % interval, and its truth."""

    effect: str
    parameter: str
    estimate: Estimate
    true: float


@dataclass(frozen=True)
class Promised:
    """Shrinkage by one measure: as promised, with its 90 % interval, and as realised."""

    measure: Measure
    predicted: Estimate
    realised: float


@dataclass(frozen=True)
class Machine:
    """A diagnosed machine whose truth is known; one line of `features.jsonl`.

    Attributes
    ----------
    name
        name of its case.
    kind, grade
        as the generator names them.
    measured
        class of its sensors, one of `scoring.reading.SENSORS`.
    truth
        ids of its effects without those that the record itself decides; the set that is wanted.
    sets
        weighed sets of effects; the empty set is one of them.
    families
        kinds of physics, measurement and excitation by trait.
    sizes, promises
        what became of the intervals of sizes and of the promised shrinkage.
    """

    name: str
    kind: Kind
    grade: str
    measured: str
    truth: tuple[str, ...]
    sets: tuple[WeighedSet, ...]
    families: Mapping[str, str] = field(default_factory=dict)
    sizes: tuple[Size, ...] = ()
    promises: tuple[Promised, ...] = ()

    def __post_init__(self) -> None:
        problem = self._problem()
        if problem:
            raise ValueError(problem)

    def _problem(self) -> str | None:
        if self.measured not in SENSORS:
            return f"measured: '{self.measured}', expected one of {', '.join(SENSORS)}"
        if not any(not each.effects for each in self.sets):
            return "sets: the set without effects is missing; expected the one of the fitted rig"
        for each in self.sets:
            unknown = [effect for effect in each.effects if effect not in catalogue()]
            if unknown:
                return f"sets: '{unknown[0]}' is no effect of the catalogue of this version"
            if not (0.0 <= each.left < math.inf and 0.0 <= each.small < math.inf):
                return f"sets: left {each.left:g}, small {each.small:g}: expected finite, >= 0"
        return None

    @property
    def pressures(self) -> bool:
        """Whether chamber pressures are measured."""
        return self.measured == SENSORS[0]

    @property
    def traits(self) -> dict[str, str]:
        """The families, and the grade as one more."""
        return {"grade": self.grade, **self.families}

    @property
    def left_by_none(self) -> float:
        """Errors that the calibrated rig leaves without any effect."""
        return next(each.left for each in self.sets if not each.effects)

    @property
    def true_sets(self) -> tuple[bool, ...]:
        """Whether each of the sets is the truth, by the rules of `scoring.judging`."""
        if self.kind in KNOWN or self.kind in HEALTHY:
            return tuple(is_exactly(each.effects, self.truth) for each in self.sets)
        return (False,) * len(self.sets)

    @property
    def outside(self) -> bool:
        """Whether "outside of the catalogue" is the right answer, as none of the sets is true."""
        return not any(self.true_sets)

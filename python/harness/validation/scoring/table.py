# SPDX-License-Identifier: MIT
"""Figures by which a check is judged, with their targets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.validation.scoring.figures import Figure, Range, mean, quantile, share
from ehsid.harness.validation.scoring.figures_sizes import SizeError, effect_errors, rig_errors
from ehsid.harness.validation.scoring.judged_case import Scored
from ehsid.harness.validation.scoring.reading import SENSORS
from ehsid.harness.validation.scoring.right import KNOWN


def _least(pressures: float, position: float) -> dict[str, Range]:
    return dict(zip(SENSORS, (Range(least=pressures), Range(least=position)), strict=True))


def _most(pressures: float, position: float) -> dict[str, Range]:
    return dict(zip(SENSORS, (Range(most=pressures), Range(most=position)), strict=True))


# Targets of a diagnosis, first with measured chamber pressures, then with the position only.
TARGETS = {
    "subsystem": _least(0.97, 0.92),
    "effect": _least(0.95, 0.90),
    "in_set": _least(0.97, 0.95),
    "set_size": _most(1.3, 2.0),
    "wrong_name": _most(0.02, 0.03),
    "false_effect": _most(0.01, 0.02),
    "recognised": _least(0.95, 0.80),
    "rejected": _most(0.03, 0.03),
    "two": _least(0.85, 0.70),
    "size": _most(0.01, 0.02),
    "size_90": _most(0.10, 0.20),
    "coverage": dict.fromkeys(SENSORS, Range(0.85, 0.95)),
    "shrinkage": _least(0.97, 0.95),
    "shrinkage_friction": _least(0.8, 0.8),
    "seconds": _most(20.0, 10.0),
}


@dataclass(frozen=True)
class FigureTable:
    """Figures of some cases, separated by what was measured; all columns have the same rows.

    Attributes
    ----------
    title
        which cases these are.
    columns
        figures for each of `SENSORS`.
    """

    title: str
    columns: dict[str, tuple[Figure, ...]]


def figure_table(title: str, cases: Sequence[Scored]) -> FigureTable:
    """Returns the figures of the cases with pressures and, separately, with the position only."""
    return FigureTable(
        title,
        {
            measured: figures_of(
                [case for case in cases if case.answer.measured == measured], measured
            )
            for measured in SENSORS
        },
    )


def figures_of(cases: Sequence[Scored], measured: str) -> tuple[Figure, ...]:
    """Returns all figures of the cases, with the targets that apply to what was measured."""

    def target(name: str) -> Range:
        return TARGETS[name][measured]

    j = [case.judged for case in cases]
    known = [case for case in cases if case.answer.kind in KNOWN]
    one = [case for case in known if case.answer.kind == "one"]
    two = [case for case in known if case.answer.kind == "two"]
    large = [case for case in known if case.demanded]
    sizes = effect_errors(cases)
    primary = [error.relative for error in sizes if error.primary]
    every = [error.relative for error in sizes]
    sets = [float(case.judged.set_size or math.nan) for case in known]
    seconds = [case.said.seconds for case in cases]
    return (
        share("subsystem first", (c.judged.subsystem_first for c in known), target("subsystem")),
        share("subsystem of an unknown effect", _of(cases, "open")),
        share(
            "effect first, gap \N{GREATER-THAN OR EQUAL TO} 3 x floor",
            (c.judged.effect_first for c in large),
            target("effect"),
        ),
        share("effect first, all", (c.judged.effect_first for c in known)),
        share("truth inside the set", (one.in_set for one in j), target("in_set")),
        mean("sets returned, mean", sets, target=target("set_size")),
        share("a confident wrong name", (one.wrong_name for one in j), target("wrong_name")),
        share(
            "effect blamed, none there",
            (one.false_effect for one in j),
            target("false_effect"),
        ),
        share("structure blamed, none there", (one.false_alarm for one in j)),
        share(
            "unknown effect recognised",
            (one.recognised for one in j),
            target("recognised"),
        ),
        share("known effect rejected", (one.rejected for one in j), target("rejected")),
        share("listed as not to be judged", (one.abstained for one in j)),
        share("one effect: exactly it", (c.judged.exact for c in one)),
        share("two effects: exactly both", (c.judged.exact for c in two), target("two")),
        quantile("error of size, median", primary, target=target("size")),
        quantile("error of size, 90th percentile", primary, 0.9, target=target("size_90")),
        quantile("error of all parameters, median", every),
        quantile("of all parameters, 90th percentile", every, 0.9),
        _coverage("sizes inside their intervals", sizes, target("coverage")),
        _coverage("rig values inside their intervals", rig_errors(cases)),
        quantile(
            "explainable gap closed, median",
            [_shrinkage(c) for c in large if not c.friction],
            target=target("shrinkage"),
        ),
        quantile(
            "the same of friction, median",
            [_shrinkage(c) for c in large if c.friction],
            target=target("shrinkage_friction"),
        ),
        quantile("time, median", seconds, unit="seconds", target=target("seconds")),
        quantile("time, 90th percentile", seconds, 0.9, unit="seconds"),
    )


def _of(cases: Sequence[Scored], kind: str) -> list[bool | None]:
    return [case.judged.subsystem_first for case in cases if case.answer.kind == kind]


def _coverage(words: str, errors: Sequence[SizeError], target: Range | None = None) -> Figure:
    return share(words, (error.inside for error in errors), target)


def _shrinkage(case: Scored) -> float:
    found = case.said.of_explainable
    return math.nan if found is None else found.value

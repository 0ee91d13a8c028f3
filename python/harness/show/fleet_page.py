# SPDX-License-Identifier: MIT
"""Renders the page of a fleet: machines ordered by their gap, and the effects that they share."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from pathlib import Path
from urllib.parse import quote

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..base.encoding import json_text
from ..base.error_words import printable
from ..base.files import write_text
from ..catalogue.parameters import plain_name, size_name
from ..catalogue.spellings import ParameterKey
from ..fleet import Fleet, Machine
from . import rendering
from .gap_words import effect_set, interval, named_effect, unit_of
from .page import Block, Cell, Link, Page, Picture, Section, Table, Tagged
from .plotting import BLUE, GREY, ORANGE, styled
from .units import percent
from .verdict_words import VERDICTS

FILES = ("fleet.html", "fleet.json")
# The figure shows this many machines, those with the largest gaps; the tables show all.
MOST_DRAWN = 60
# Page of a machine, in the folder of its name beside the page of the fleet.
REPORT = "report.html"


def verdict_text(machine: Machine) -> str:
    """Returns the finding of a machine in words: the named effects, otherwise the verdict."""
    titles: dict[str, str] = {name: words.title for name, words in VERDICTS.items()}
    title = titles.get(machine.verdict, machine.verdict).lower()
    named = effect_set(tuple(effect.id for effect in machine.effects)) if machine.effects else title
    if machine.verdict == "ambiguous" and machine.ambiguity_set:
        return " or ".join(effect_set(effects) for effects in machine.ambiguity_set)
    if machine.verdict == "outside_catalogue" and machine.effects:
        return f"{named}, and more {title}"
    return named


def verdict_ids(machine: Machine) -> str:
    """Returns the ids of the finding of a machine, as its files have them."""
    sets = machine.ambiguity_set if machine.verdict == "ambiguous" else ()
    named = " + ".join(effect.id for effect in machine.effects)
    return " or ".join(" + ".join(effects) for effects in sets) or named or machine.verdict


def write_fleet(fleet: Fleet, folder: Path, results: Path) -> None:
    """Writes the files `FILES` of a fleet into a folder that exists.

    `results` has the folders of the machines. The page leads to those reports that are there.
    """
    write_text(folder / "fleet.json", json_text(fleet))
    names = [machine.name for machine in (*fleet.ranked, *fleet.not_judged)]
    written = {name for name in names if (results / name / REPORT).is_file()}
    rendering.write_page(folder / "fleet.html", fleet_page(fleet, written))


def fleet_lead(fleet: Fleet) -> list[str]:
    """Returns the result of a fleet in a few sentences."""
    count = len(fleet.ranked)
    sentences = [f"{_machines(count)} judged, by the gap that values of the rig cannot close."]
    if fleet.ranked:
        first = fleet.ranked[0]
        sentences.append(
            f"The largest is that of {first.name}: {percent(first.structural)} of its motion above "
            f"the noise. {first.sentence}"
        )
    common = [effect for effect in fleet.shared if len(effect.named) > 1]
    if common:
        shared = "; ".join(
            f"{plain_name(effect.id)} in {len(effect.named)} of {count}" for effect in common[:5]
        )
        sentences.append(f"Shared by several: {shared}.")
    elif count > 1:
        sentences.append("No effect was named in more than one of them.")
    if fleet.not_judged or fleet.failed:
        sentences.append(
            f"Not judged: {len(fleet.not_judged)} for want of data, {len(fleet.failed)} for an "
            "error; the reasons stand below."
        )
    return sentences


def _machines(count: int) -> str:
    return f"{count} machine{'' if count == 1 else 's'}"


def fleet_page(fleet: Fleet, reports: Collection[str] = ()) -> Page:
    """Returns the whole page of a fleet; `reports` are the machines that have a report."""
    sections = []
    if fleet.ranked:
        sections += [_ranking(fleet.ranked, reports), _effects(fleet)]
    sections += _left_out(fleet, reports)
    title = "A fleet: where its simulators are wrong"
    return Page(title, fleet_lead(fleet), sections, summary=_picture(fleet))


def _machine(name: str, reports: Collection[str]) -> str | Link:
    """The name of a machine, which leads to its report where there is one."""
    return Link(name, f"{quote(name)}/{REPORT}") if name in reports else name


def _picture(fleet: Fleet) -> list[Block]:
    if not fleet.ranked:
        return []
    drawn = fleet.ranked[:MOST_DRAWN]
    which = "All machines" if len(drawn) == len(fleet.ranked) else f"The {len(drawn)} largest gaps"
    shared = "" if fleet.shared else " No effect was named in any of them."
    return [
        Picture(
            fleet_figure(drawn, [effect.id for effect in fleet.shared]),
            f"{which}. Left: structural gap, and in grey what the named effects leave of it. "
            "Right: the larger the disc, the larger the effect's part of the motion; a ring: it "
            "explains the records as well as what was named; a cross: the records cannot show it."
            + shared,
            "Structural gap of each machine, and a matrix of machines and effects",
        )
    ]


def _ranking(machines: Sequence[Machine], reports: Collection[str]) -> Section:
    rows = [
        [
            _machine(machine.name, reports),
            percent(machine.structural),
            percent(machine.nominal),
            percent(machine.calibrated),
            percent(machine.augmented),
            percent(machine.noise_floor[1]),
            Tagged(verdict_text(machine), hint=verdict_ids(machine)),
        ]
        for machine in machines
    ]
    columns = ["machine", "structural gap", "as configured", "rig values fitted", "with effects"]
    return Section(
        "Machines by their gap",
        [
            (
                "Gaps are errors of the simulation on held-out data, as a share of the motion "
                "(nrmse over the outputs). Structural is what stays above the highest noise floor "
                "after the values of the rig were fitted. The name of a machine leads to its own "
                "report."
            ),
            Table("Largest first.", [*columns, "floor", "verdict"], rows),
        ],
    )


def _effects(fleet: Fleet) -> Section:
    if not fleet.shared:
        return Section("Which gaps are shared", ["No effect was named in any of them."])
    common = Table(
        "Effects, the most common first.",
        ["effect", "named in", "one of several in", "machines"],
        [
            [
                named_effect(effect.id),
                str(len(effect.named)),
                str(len(effect.rival)),
                ", ".join(effect.named) or "–",
            ]
            for effect in fleet.shared
        ],
    )
    ids = [effect.id for effect in fleet.shared]
    sizes = Table(
        "What is known of these effects in each machine: sizes with their intervals of 90 %.",
        ["machine", "effect", "what is known"],
        [
            [machine.name, named_effect(effect), cell]
            for machine in fleet.ranked
            for effect in ids
            if (cell := _cell(machine, effect))
        ],
    )
    return Section("Which gaps are shared", [common, sizes])


def _cell(machine: Machine, effect: str) -> str:
    for named in machine.effects:
        if named.id == effect:
            sizes = []
            for name, size in named.parameters.items():
                key = ParameterKey.of_effect(effect, name)
                value, ends = interval(size, unit_of(key))
                sizes.append(f"{size_name(key)} {value} ({ends})")
            return "; ".join(sizes) or "named"
    return "explains the records as well as what was named" if effect in machine.rivals else ""


def _left_out(fleet: Fleet, reports: Collection[str]) -> list[Section]:
    sections = []
    rows: list[list[Cell]]
    unsure = [machine for machine in fleet.ranked if machine.cannot_judge]
    if fleet.not_judged:
        rows = [
            [_machine(machine.name, reports), " ".join([machine.sentence, *machine.why])]
            for machine in fleet.not_judged
        ]
        table = Table("Records that do not allow a judgement.", ["machine", "why"], rows)
        sections.append(Section("Not judged", [table]))
    if fleet.failed:
        rows = [[name, message] for name, message in fleet.failed.items()]
        table = Table("Folders that could not be diagnosed.", ["folder", "message"], rows)
        sections.append(Section("Errors", [table]))
    if unsure:
        rows = [
            [machine.name, named_effect(effect), why]
            for machine in unsure
            for effect, why in machine.cannot_judge.items()
        ]
        table = Table(
            "Effects that the records cannot show, whether the machine has them or not.",
            ["machine", "effect", "why"],
            rows,
        )
        sections.append(Section("What could not be judged", [table]))
    return sections


NAMED, RIVAL, LEFT = BLUE, ORANGE, GREY


@styled
def fleet_figure(machines: Sequence[Machine], effects: Sequence[str]) -> Figure:
    """Draws bars of the structural gaps beside a matrix of machines and effects, if there are any.

    The names of the effects stand above their columns.
    """
    height = 1.9 + 0.3 * len(machines)
    figure = Figure(figsize=(9.0, height))
    if effects:
        ratios = [1.0, 1.0 + 0.22 * len(effects)]
        left, right = figure.subplots(1, 2, sharey=True, width_ratios=ratios)
        _matrix(right, machines, effects)
    else:
        left = figure.subplots()
    rows = range(len(machines))
    left.barh(rows, [100.0 * machine.structural for machine in machines], color=NAMED, height=0.6)
    rests = [100.0 * min(machine.structural, _rest(machine)) for machine in machines]
    left.barh(rows, rests, color=LEFT, height=0.6)
    left.set_yticks(rows, [printable(machine.name) for machine in machines], parse_math=False)
    left.set_ylim(len(machines) - 0.5, -0.5)
    left.set_xlabel("structural gap, % of the motion")
    left.grid(False, axis="y")
    return figure


def _rest(machine: Machine) -> float:
    """Gap that remains above the highest noise floor with the named effects, as an nrmse.

    It is the structural gap where the gap with effects is not known.
    """
    left = machine.augmented - machine.noise_floor[1]
    return max(0.0, left) if math.isfinite(left) else machine.structural


def _matrix(axes: Axes, machines: Sequence[Machine], effects: Sequence[str]) -> None:
    place = {effect: column for column, effect in enumerate(effects)}
    largest = max((machine.structural for machine in machines), default=0.0) or 1.0
    for row, machine in enumerate(machines):
        for effect in machine.effects:
            # The area grows with the effect's part of the gap; the smallest disc stays visible.
            size = 25.0 + 200.0 * effect.share_of_gap * machine.structural / largest
            axes.scatter(place[effect.id], row, s=size, color=NAMED, linewidths=0)
        rivals = [place[effect] for effect in machine.rivals]
        axes.scatter(rivals, [row] * len(rivals), s=60, facecolors="none", edgecolors=RIVAL)
        unseen = [place[effect] for effect in machine.cannot_judge if effect in place]
        axes.scatter(unseen, [row] * len(unseen), s=18, marker="x", color=LEFT, linewidths=1.0)
    axes.set_xticks(range(len(effects)), [plain_name(effect) for effect in effects], rotation=40)
    for label in axes.get_xticklabels():
        label.set_horizontalalignment("left")
    axes.xaxis.tick_top()
    axes.set_xlim(-0.6, len(effects) - 0.4)
    axes.tick_params(left=False)

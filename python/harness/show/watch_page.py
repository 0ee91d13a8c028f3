# SPDX-License-Identifier: MIT
"""The page of a machine's life: courses over time, changes with their dates, what could be seen."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter, date2num
from matplotlib.figure import Figure

from ..base.encoding import json_text
from ..base.files import write_text
from ..catalogue.parameters import value_name
from ..diagnosis.schema import Estimate
from ..watch.tracking import GAP, SERVO
from ..watch.watching import Watch, WatchedChange, WatchedMachine, WatchedQuantity
from . import rendering
from .gap_words import first_upper, in_shown_unit, interval, quantity, unit_of
from .page import Block, Cell, Heading, Items, Page, Picture, Section, Table, Tagged
from .plotting import BLUE, GREY, VERMILION, styled

FILES = ("watch.html", "watch.json")
# Head of the table of `change_rows`.
CHANGES = ("machine", "what", "change", "date, 90 %")
# Panels of the picture of a machine: those with changes first.
MOST_PANELS = 8
WORDS = {GAP: "gap that stays", **{name: key for key, name in SERVO.items()}}


def quantity_name(name: str) -> str:
    """Returns a watched quantity in words."""
    return WORDS[name] if name in WORDS else value_name(name)


def shown_as(one: WatchedQuantity) -> tuple[float, str]:
    """Returns the factor from the unit of a quantity, and the unit in which it is shown."""
    if one.name == GAP:
        return 100.0, "%"
    if one.name in SERVO.values():
        return 1.0, "" if one.unit == "1" else one.unit
    return in_shown_unit(max(map(abs, one.values)), unit_of(one.name))


def told(value: float, low: float, high: float, one: WatchedQuantity) -> tuple[str, str]:
    """Returns a value of a quantity with its unit, and its interval."""
    factor, unit = shown_as(one)
    estimate = Estimate(factor * value, *sorted((factor * low, factor * high)))
    text, ends = interval(estimate, "1")
    return f"{text}\u00a0{unit}".strip(), ends


def day(text: str) -> str:
    """Returns the day of a date of ISO 8601."""
    return datetime.fromisoformat(text).strftime("%d %b %Y").lstrip("0")


def change_words(change: WatchedChange, one: WatchedQuantity) -> str:
    """Returns a change in a few words, such as "rose by 3.1 (2.8 to 3.4) N"."""
    sign = 1.0 if change.size > 0.0 else -1.0
    low, high = change.size90
    size, ends = told(sign * change.size, sign * low, sign * high, one)
    way = "rose" if change.size > 0.0 else "fell"
    if change.kind == "growth":
        way = "grows" if change.size > 0.0 else "falls"
        return f"{way} by {size} a month ({ends})"
    return f"{way} by {size} ({ends})"


def between(change: WatchedChange) -> str:
    """Returns the interval of the date."""
    first, last = map(day, change.date90)
    return first if first == last else f"{first} to {last}"


def change_rows(watch: Watch) -> list[tuple[str, str, str, str]]:
    """Returns machine, quantity, change and dates of each change, the latest last."""
    rows = [
        (change.date, machine.name, quantity_name(one.name), change_words(change, one), change)
        for machine in watch.machines
        for one in machine.changed
        for change in one.changes
    ]
    return [(name, what, words, between(c)) for _, name, what, words, c in sorted(rows, key=_first)]


def _first(row: tuple[str, str, str, str, WatchedChange]) -> str:
    return row[0]


def watch_lead(watch: Watch) -> list[str]:
    """Returns the result in a few sentences."""
    logs = sum(machine.logs for machine in watch.machines)
    changed = [machine for machine in watch.machines if machine.changed]
    many = "" if len(watch.machines) == 1 else f" of {len(watch.machines)} machines"
    counted = f"{logs} log{'' if logs == 1 else 's'}"
    sentences = [f"{counted}{many} fitted with the same effects."]
    if changed:
        names = ", ".join(machine.name for machine in changed[:5])
        sentences.append(f"Something changed in {names}.")
    elif logs:
        sentences.append("No change can be told.")
    sentences.append(
        f"Where nothing changes, {watch.false_alarms_a_year:g} false alarm a year and machine is "
        "expected."
    )
    refused = [one for machine in watch.machines for one in machine.refused.items()]
    if refused:
        name, why = refused[0]
        many = "1 log" if len(refused) == 1 else f"{len(refused)} logs"
        such = ": " if len(refused) == 1 else ", such as "
        sentences.append(f"{many} could not be used{such}{name} ({why.rstrip('.')}).")
    return sentences


def write_watch(watch: Watch, folder: Path) -> None:
    """Writes the files `FILES` into a folder that exists."""
    write_text(folder / "watch.json", json_text(watch))
    rendering.write_page(folder / "watch.html", watch_page(watch))


def watch_page(watch: Watch) -> Page:
    """Returns the whole page."""
    summary: list[Block] = [
        _picture(machine) for machine in watch.machines[:1] if machine.quantities
    ]
    sections = []
    rows = change_rows(watch)
    if rows:
        table = Table("Oldest first.", CHANGES, rows)
        sections.append(Section("What changed, and when", [table]))
    sections += [
        _machine(machine, is_first=place == 0) for place, machine in enumerate(watch.machines)
    ]
    return Page(
        "The life of a machine" if len(watch.machines) == 1 else "The lives of machines",
        watch_lead(watch),
        sections,
        summary=summary,
    )


def _machine(machine: WatchedMachine, *, is_first: bool) -> Section:
    blocks: list[Block] = []
    if not is_first and machine.quantities:
        blocks.append(_picture(machine))
    if machine.quantities:
        blocks.append(
            Table(
                f"{machine.logs} logs from {day(machine.first)} to {day(machine.last)}. Of each "
                "quantity: what it is now, as all logs since its last change tell it, and the "
                "smallest step that two more logs like the last one would show.",
                ("quantity", "now", "90 % interval", "a step would show from", "changes"),
                [_row(one) for one in machine.quantities],
            )
        )
    elif machine.logs:
        blocks.append(f"{machine.logs} logs: too few to tell a level. More than 10 are needed.")
    if machine.oil_temperature:
        blocks.append("The influence of the logged temperature of the oil is taken out.")
    if machine.refused:
        blocks.append(Heading("Logs that could not be used"))
        blocks.append(Items([f"{name}: {why}" for name, why in machine.refused.items()]))
    return Section(machine.name, blocks)


def _row(one: WatchedQuantity) -> list[Cell]:
    value, ends = told(*one.now, one)
    factor, unit = shown_as(one)
    step = quantity(factor * one.could_be_seen[-1], "1", 2)
    return [
        Tagged(first_upper(quantity_name(one.name)), hint=one.name),
        value,
        ends,
        f"{step}\u00a0{unit}".strip(),
        "; ".join(f"{change_words(c, one)}, {between(c)}" for c in one.changes) or "none",
    ]


def _picture(machine: WatchedMachine) -> Picture:
    drawn = machine.quantities[:MOST_PANELS]
    return Picture(
        life_figure(drawn, machine.oil_temperature),
        f"{machine.name}: grey points are single logs with their intervals of 90 %, the blue line "
        "is what they tell together. A red line is the most probable date of a change, the red "
        "band its interval of 90 %. Between the dotted lines no step would have shown.",
        f"Courses of {', '.join(quantity_name(one.name) for one in drawn)} over time",
    )


@styled
def life_figure(
    quantities: Sequence[WatchedQuantity], oil: Sequence[tuple[str, float]] = ()
) -> Figure:
    """Returns a figure with a panel for each quantity, and for the temperature of the oil.

    `oil` has the date of each log and the temperature in °C.
    """
    count = len(quantities) + bool(oil)
    figure = Figure(figsize=(9.0, 0.4 + 1.45 * count))
    panels = figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    for axes, one in zip(panels, quantities, strict=False):
        _draw(axes, one)
    if oil:
        dates, values = zip(*oil, strict=True)
        panels[-1].plot([_number(date) for date in dates], values, ".", color=GREY)
        panels[-1].set_title("Temperature of the oil, °C", loc="left")
    locator = AutoDateLocator()  # type: ignore[no-untyped-call]
    panels[-1].xaxis.set_major_locator(locator)
    words = ConciseDateFormatter(locator)  # type: ignore[no-untyped-call]
    panels[-1].xaxis.set_major_formatter(words)
    return figure


def _draw(axes: Axes, one: WatchedQuantity) -> None:
    factor, unit = shown_as(one)
    dates = np.array([_number(date) for date in one.dates])
    values, reach = factor * np.array(one.values), 1.645 * factor * np.array(one.deviations)
    axes.errorbar(
        dates, values, np.abs(reach), fmt=".", color=GREY, ecolor=GREY, elinewidth=0.6, alpha=0.7
    )
    low, high = (factor * np.array(end) for end in zip(*one.pooled90, strict=True))
    seen = factor * np.array(one.could_be_seen)
    cuts = [0, *(_place(one, change) for change in one.changes), dates.size]
    for begin, end in itertools.pairwise(cuts):
        here = slice(begin, end)
        axes.plot(dates[here], factor * np.array(one.pooled[here]), color=BLUE)
        axes.fill_between(dates[here], low[here], high[here], color=BLUE, alpha=0.25, linewidth=0.0)
        for sign in (-1.0, 1.0):
            edge = factor * np.array(one.pooled) + sign * seen
            axes.plot(dates[here], edge[here], ":", color=BLUE, linewidth=0.8)
    for change in one.changes:
        axes.axvspan(*map(_number, change.date90), color=VERMILION, alpha=0.2)
        axes.axvline(_number(change.date), color=VERMILION, linewidth=1.0)
    name = quantity_name(one.name)
    axes.set_title(f"{first_upper(name)}{f', {unit}' if unit else ''}", loc="left")


def _number(date: str) -> float:
    """The date as a number of the axis."""
    return float(date2num(datetime.fromisoformat(date)))  # type: ignore[no-untyped-call]


def _place(one: WatchedQuantity, change: WatchedChange) -> int:
    """Index of the first log behind a change."""
    return int(np.searchsorted(np.array(one.dates), change.date))

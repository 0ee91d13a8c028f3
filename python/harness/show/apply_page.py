# SPDX-License-Identifier: MIT
"""Page of what a controller takes of a machine: valve and inverse, friction, margins, numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..commissioning import SOURCES, Commissioning, Design, write_commissioning
from ..commissioning.loop import Gains, Servo, response
from ..commissioning.valve import Valve
from .page import Block, Fact, Facts, Items, Note, Page, Picture, Section, Table
from .plotting import BLUE, GREY, INK, VERMILION, draw_band, styled
from .rendering import write_page


@styled
def valve_figure(valve: Valve) -> Figure:
    """Draws the opening over the command, the inverse, and the nulls of both."""
    figure = Figure(figsize=(9.0, 3.8))
    characteristic, inverse = figure.subplots(1, 2)
    for one, colour in ((valve.extending, BLUE), (valve.retracting, VERMILION)):
        way = "extending" if one.side > 0 else "retracting"
        bands = np.array([one.opening_low, one.opening, one.opening_high])
        draw_band(characteristic, 100.0 * one.command, 100.0 * bands, color=colour, label=way)
        bands = np.array([one.inverse_low, one.inverse_command, one.inverse_high])
        draw_band(inverse, 100.0 * one.inverse_opening, 100.0 * bands, color=colour, label=way)
    edges = [100.0 * one.edge.value for one in (valve.retracting, valve.extending)]
    characteristic.plot(edges, [0.0, 0.0], color=INK)
    inverse.plot([0.0, 0.0], edges, color=INK)
    for axes, x, y in (
        (characteristic, "command in % of rated", "opening in %"),
        (inverse, "opening in %", "command in % of rated"),
    ):
        axes.plot([-100.0, 100.0], [-100.0, 100.0], ":", color=GREY, label="ideal valve")
        axes.set_xlabel(x)
        axes.set_ylabel(y)
        axes.legend(loc="upper left")
    characteristic.set_title("characteristic, with band of 90 %")
    inverse.set_title("its inverse")
    return figure


@styled
def loop_figure(servo: Servo, gains: Gains, cycle_s: float) -> Figure:
    """Draws gain and phase of the loop over all cases of the interval, and of its middle."""
    figure = Figure(figsize=(9.0, 4.4))
    upper, lower = figure.subplots(2, 1, sharex=True)
    omega = np.geomspace(0.1 * gains.pole, 4.0 * servo.omega_n.high, 800)
    s = 1j * omega
    back = gains.position + gains.velocity * s + gains.acceleration * s**2
    for one, alpha, colour in ((servo, 0.25, GREY), (servo.middle, 1.0, BLUE)):
        loops = back * response(one, 1.5 * cycle_s, omega)[1]
        for axes, values in (
            (upper, 20.0 * np.log10(np.abs(loops))),
            (lower, np.degrees(np.unwrap(np.angle(loops), axis=1))),
        ):
            axes.fill_between(
                omega / (2.0 * math.pi),
                values.min(axis=0),
                values.max(axis=0),
                color=colour,
                alpha=alpha,
                linewidth=1.2 if one is not servo else 0.0,
            )
    upper.axhline(0.0, color=INK, linewidth=0.8)
    lower.axhline(-180.0, color=INK, linewidth=0.8)
    upper.set_ylabel("gain in dB")
    lower.set_ylabel("phase in degrees")
    lower.set_xlabel("frequency in Hz")
    lower.set_xscale("log")
    return figure


def apply_table(result: Commissioning, *, sources: bool) -> Table:
    """Returns all constants with unit and interval, and with sources where there is room."""
    rows = [
        (
            one.name,
            f"{one.value:.4g}" + ("" if one.unit == "1" else f" {one.unit}"),
            "" if one.low is None else f"{one.low:.4g} .. {one.high:.4g}",
            one.meaning,
            one.source,
        )[: 5 if sources else 4]
        for one in result.constants
    ]
    columns = ("constant", "value", "90 % interval", "what it is", "source")
    return Table("", columns[: 5 if sources else 4], rows)


def told(result: Commissioning) -> list[str]:
    """Returns what is not given with its reason, and the notes, as sentences."""
    return [f"{what}: not given: {why}." for what, why in result.refused.items()] + result.notes


def apply_page(design: Design) -> Page:
    """Returns the page of a design."""
    result, valve, gains = design.result, design.valve, design.gains
    facts = []
    if valve is not None:
        facts.append(
            Fact(
                "Valve",
                f"opens at {100.0 * valve.extending.edge.value:+.2f} % and "
                f"{100.0 * valve.retracting.edge.value:+.2f} %",
                "of the rated command; the inverse jumps from one to the other",
            )
        )
    if gains is not None:
        facts.append(
            Fact(
                "Loop",
                f"{gains.pole:.3g} 1/s",
                f"gain margin {gains.worst.gain_db:.1f} dB, phase margin "
                f"{gains.worst.phase_deg:.0f} degrees in the worst case; fastest "
                f"{gains.fastest:.3g} 1/s",
            )
        )
    lead: list[Block] = [Facts(facts)] if facts else []
    if told(result):
        lead.append(Items(told(result)))
    sections = []
    if valve is not None:
        picture = Picture(
            valve_figure(valve),
            "Left, what the valve does; right, what a controller sends for an opening. The tables "
            "for a controller stay at the end of the band that is nearer to null.",
            "Opening over command with a band, and command over opening, in both directions.",
        )
        sections.append(Section("Valve", [picture]))
    for one, title in ((design.gains, "Loop: P"), (design.placed, "Loop: pole placement")):
        if one is not None and design.servo is not None:
            picture = Picture(
                loop_figure(design.servo, one, result.cycle_s),
                "The open loop: the line with the values in the middle, the band over all cases of "
                "the interval.",
                "Gain and phase of the open loop over the frequency, with a band.",
            )
            sections.append(Section(title, [picture]))
    # What is asked for first stands above the list of the sections.
    summary: Sequence[Block] = sections.pop(0).blocks if sections else []
    numbers: Sequence[Block] = [
        apply_table(result, sources=True),
        Note("Shares, without a unit, are of the rated command and of full opening."),
    ]
    sections.append(Section("Numbers", numbers))
    return Page(
        f"{result.name}: for the controller",
        lead,
        sections,
        SOURCES,
        overline=f"What a controller takes from {result.origin}",
        summary=summary,
    )


def write_apply(folder: Path, design: Design, *, name: str) -> None:
    """Writes the files for controllers and the page into a folder that exists."""
    write_commissioning(folder, design.result, name=name)
    write_page(folder / "apply.html", apply_page(design))

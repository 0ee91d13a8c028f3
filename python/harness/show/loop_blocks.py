# SPDX-License-Identifier: MIT
"""Texts and tables about a model under proportional control, for pages and figures."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.numbers import plain_number
from ..models.identification.loop import LoopAnalysis, Mode, ProportionalLoop
from .page import Block, Table
from .plotting import frequency_unit


def loop_blocks(
    loop: LoopAnalysis, dt_s: float | None, input_band: tuple[float, float] | None = None
) -> list[Block]:
    """Returns the limit of stability in words, and the loops and natural frequencies as tables."""
    unit = frequency_unit(dt_s)
    return [
        (
            f"{limit_words(loop, dt_s, input_band)} k is in units of the input over units of the "
            "output."
        ),
        Table(
            "Loops with unity gain and with half the limit. Usual demands are a gain margin of "
            "6 dB or more and a phase margin of 45 degrees or more. The figures are those of the "
            "model, by python-control.",
            (
                "k",
                "stable",
                "gain margin, dB",
                "phase margin, degrees",
                f"gain crossover, {unit}",
                "least damping ratio",
            ),
            [_row(closed) for closed in loop.loops],
        ),
        Table(
            "Natural frequencies and damping ratios of the model's poles, as those of "
            "s = ln(z) / dt.",
            ("pole z", f"natural frequency, {unit}", "damping ratio"),
            [
                (place(mode.pole), plain_number(mode.frequency_hz, 4), f"{mode.damping:.3f}")
                for mode in loop.modes
            ],
        ),
    ]


def limit_words(
    loop: LoopAnalysis, dt_s: float | None, input_band: tuple[float, float] | None
) -> str:
    """Says up to which gain the loop is stable, and whether `input_band` supports this limit."""
    control = "Under proportional control, u = k (r - y),"
    if loop.limit_gain is None or loop.phase_crossover_hz is None or loop.half is None:
        return (
            f"{control} no gain makes the model oscillate: its phase does not reach -180 degrees."
        )
    limit = f"k = {plain_number(loop.limit_gain, 4)}"
    if not loop.half.stable:
        return f"{control} the model is unstable with half of {limit} already."
    text = (
        f"{control} the model is stable up to {limit}, where it oscillates at "
        f"{plain_number(loop.phase_crossover_hz, 4)} {frequency_unit(dt_s)}."
    )
    if input_band is not None and not input_band[0] <= loop.phase_crossover_hz <= input_band[1]:
        text += (
            " The input has next to no power there: this limit is extrapolated, do not rely on it."
        )
    return text


def place(z: complex) -> str:
    """Returns a real pole, or both poles of a complex pair, as text."""
    return f"{z.real:.5f}" + (f" ± {z.imag:.5f}j" if z.imag else "")


def _row(loop: ProportionalLoop) -> Sequence[str]:
    return (
        plain_number(loop.gain, 4),
        "yes" if loop.stable else "no",
        "no limit" if np.isinf(loop.gain_margin) else f"{20.0 * np.log10(loop.gain_margin):.1f}",
        "no crossover" if loop.phase_margin_deg is None else f"{loop.phase_margin_deg:.1f}",
        "none" if loop.gain_crossover_hz is None else plain_number(loop.gain_crossover_hz, 4),
        _least_damping(loop.modes),
    )


def _least_damping(modes: Sequence[Mode]) -> str:
    return f"{min(mode.damping for mode in modes):.3f}" if modes else "no poles but delays"

# SPDX-License-Identifier: MIT
"""What the page says of an identified model, as HTML."""

from __future__ import annotations

import math

from ehsid.harness.show.page import Heading, Table

from .look import plain, told
from .model_look import Identified, Root, Row
from .shown_units import coefficient, speed_gain

REAL = 1e-9  # largest imaginary part of a real pole


def verdict(found: Identified) -> str:
    """Says which model was chosen, and how well it fits."""
    chosen = found.chosen
    simulated = "diverges" if chosen.simulated is None else f"fits {chosen.simulated:.1f} %"
    return (
        f'<p class="verdict">Order {chosen.na} with a delay of {chosen.nk} '
        f"sample{'s' * (chosen.nk != 1)} ({1e3 * chosen.nk * found.dt_s:.4g} ms). On the half of "
        f"{plain(found.record)} that was not fitted, its prediction by one step fits "
        f"{chosen.one_step:.2f} %, and its simulation {simulated}.</p>"
    )


def reasons(found: Identified) -> str:
    """Says why this model was chosen, and what to be careful with."""
    why = "".join(f"<li>{plain(one)}</li>" for one in found.reasons)
    careful = "".join(f"<li>{plain(one)}</li>" for one in found.advice)
    careful = f"<h2>Be careful</h2><ul>{careful}</ul>" if careful else ""
    return f"<h2>Why this one</h2><ul>{why}</ul>{careful}"


def figures(found: Identified) -> str:
    """Returns K, natural frequencies and damping, the coefficients and the poles."""
    names = (found.input_name, found.output_name)
    rows = []
    for name, value, deviation in zip(found.names, found.theta, found.deviations, strict=True):
        shown = coefficient(name, *names)
        spread = "" if deviation is None else f"± {shown.factor * deviation:.2g}"
        rows.append([name, f"{shown.factor * value:.5g}", spread, shown.unit])
    poles = [_pole(one) for one in found.poles if one.imag >= 0.0]
    return (
        _servo(found)
        + told(
            Heading("Coefficients"),
            Table("", ("", "value", "1-sigma", "unit"), rows),
            Heading("Poles"),
            Table("", ("pole z", "|z|", "1-sigma", "f in Hz", "ξ"), poles),
        )
        + _zeros(found.zeros)
    )


def residual_tests(found: Identified) -> str:
    """Says what the residual tests found and what it means."""
    white, independent = found.whiteness, found.independence
    noise = (
        "The residual is white: the model leaves nothing in the output that could be predicted."
        if white.passed
        else "The residual is not white: a part of it can be predicted from its past. The noise is "
        "coloured, or the model lacks something, such as friction or a higher order. The "
        "deviations of the coefficients are then too small."
    )
    cause = (
        "The residual is independent of the input: the model has all that the command does."
        if independent.passed
        else "The residual depends on the input: the model lacks a part of what the command does, "
        "such as an effect that is not linear, a higher order or another delay."
    )
    return "<h2>What the model leaves</h2>" + "".join(
        f'<p><span class="{"good" if test.passed else "bad"}">{"✓" if test.passed else "✗"}</span> '
        f'{words} <span class="soft">{plain(test.verdict)}.</span></p>'
        for words, test in ((noise, white), (cause, independent))
    )


def _servo(found: Identified) -> str:
    """Says K, omega_n and xi, as far as they exist."""
    pairs = [one for one in found.poles if one.imag > REAL and one.frequency_hz is not None]
    lines = []
    if any(not one.integrates and math.hypot(one.real, one.imag) > 1.0 for one in found.poles):
        lines.append(
            "The model is unstable: a pole lies outside of the unit circle. There is no velocity "
            "gain K."
        )
    elif found.velocity_gain is None:
        lines.append(
            "The model does not integrate: a constant input gives no constant speed. There is no "
            "velocity gain K."
        )
    else:
        gain = speed_gain(found.input_name, found.output_name)
        lines.append(f"Velocity gain <b>K = {plain(gain.text(found.velocity_gain))}</b>.")
    lines += [
        f"Natural frequency <b>ω<sub>n</sub> = {2.0 * math.pi * one.frequency_hz:.4g} rad/s</b> "
        f"({one.frequency_hz:.4g} Hz), damping ratio <b>ξ = {one.damping:.3g}</b>."
        for one in pairs
        if one.frequency_hz is not None and one.damping is not None
    ]
    if not pairs:
        lines.append(
            "The model has no pair of complex poles, thus no natural frequency ω<sub>n</sub> and "
            "no damping ratio ξ."
        )
    return "<h2>The servo</h2>" + "".join(f"<p>{line}</p>" for line in lines)


def _pole(root: Root) -> list[str]:
    place = f"{root.real:.5g}"
    if root.imag > REAL:
        place += f" ± {root.imag:.5g} j"
    return [
        place,
        f"{math.hypot(root.real, root.imag):.5g}",
        "" if root.deviation is None else f"± {root.deviation:.2g}",
        "integrator"
        if root.integrates
        else ""
        if root.frequency_hz is None
        else f"{root.frequency_hz:.3g}",
        "" if root.damping is None else f"{root.damping:.3g}",
    ]


def _zeros(zeros: list[Root]) -> str:
    if not zeros:
        return ""
    places = ", ".join(
        f"{one.real:.4g}" + (f" ± {one.imag:.4g} j" if one.imag > REAL else "")
        for one in zeros
        if one.imag >= 0.0
    )
    return f'<p class="soft">Zeros: z = {places}.</p>'


def candidates(found: Identified) -> str:
    """Returns the best model of each order as a table."""
    headings = ("order", "delay", "one step", "simulated", "FPE")
    chosen = found.rows.index(found.chosen)
    orders = Table("", headings, list(map(_candidate, found.rows)), [chosen])
    return told(Heading("Orders tried"), orders)


def _candidate(row: Row) -> list[str]:
    return [
        f"{row.na}",
        f"{row.nk}",
        f"{row.one_step:.2f} %",
        "diverges" if row.simulated is None else f"{row.simulated:.1f} %",
        f"{row.fpe:.3g}",
    ]

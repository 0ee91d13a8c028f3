# SPDX-License-Identifier: MIT
"""The chosen model in tables and sentences: coefficients, poles, zeros, gain, servo."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..base.plain_number import plain_number
from ..catalogue.channels import CHANNELS
from ..models.identification.dynamics import Dynamics, Figure, Root, dynamics
from .page import Table

if TYPE_CHECKING:
    from ..models.identification import IdentificationResult


def model_table(result: IdentificationResult) -> Table:
    """Returns the coefficients of the chosen model with their standard deviations."""
    model = result.chosen.model
    rows = tuple(
        (name, plain_number(value, 6), plain_number(deviation, 2))
        for name, value, deviation in zip(
            model.orders.names, model.theta.tolist(), model.standard_deviations, strict=True
        )
    )
    orders = model.orders
    title = f"model: na = {orders.na}, nb = {orders.nb}, nk = {orders.nk}"
    return Table(title, ("coefficient", "value", "1-sigma"), rows)


def root_table(result: IdentificationResult) -> Table:
    """Returns the poles and zeros of the chosen model, with frequency and damping of the poles."""
    told = dynamics(result.chosen.model, result.dt_s)
    rows = [_root_row("pole", one) for one in told.poles]
    rows += [_root_row("zero", one) for one in told.zeros]
    headings = ("", "z", "|z|", "1-sigma of |z|", "f in Hz", "damping")
    shown = len(headings) if result.dt_s is not None else 4
    return Table("", headings[:shown], [row[:shown] for row in rows])


def servo_lines(result: IdentificationResult, input_name: str, output_name: str) -> list[str]:
    """Returns K, omega_n and xi of the chosen model as far as they exist, and why not, else."""
    told = dynamics(result.chosen.model, result.dt_s)
    lines = [_gain_line(told, input_name, output_name)]
    if told.servo is None:
        lines.append(f"Not read as a servo: {told.why_no_servo}.")
    else:
        lines.append(
            f"Natural frequency omega_n = {_figure(told.servo.omega_n)} rad/s, damping ratio "
            f"xi = {_figure(told.servo.xi)}."
        )
    return lines


def _root_row(kind: str, root: Root) -> tuple[str, ...]:
    place = f"{root.real:.5g}" + (f" +- {root.imag:.5g} j" if root.imag > 0.0 else "")
    return (
        kind,
        place,
        f"{abs(complex(root.real, root.imag)):.5g}",
        "" if root.deviation is None else plain_number(root.deviation, 2),
        "integrator" if root.integrates else _number(root.frequency_hz),
        _number(root.damping),
    )


def _number(value: float | None) -> str:
    return "" if value is None else plain_number(value, 3)


def _gain_line(told: Dynamics, input_name: str, output_name: str) -> str:
    u, y = _unit(input_name), _unit(output_name)
    if told.velocity_gain is not None:
        return f"Velocity gain K = {_figure(told.velocity_gain)} {y}/s per {u}."
    if told.static_gain is not None:
        return (
            f"The model does not integrate: static gain {_figure(told.static_gain)} {y} per {u}, "
            "and no velocity gain K."
        )
    if not told.stable:
        return (
            "The model is unstable: a pole lies outside of the unit circle, so that it has neither "
            "a static gain nor a velocity gain K."
        )
    return "The model integrates. Its velocity gain K needs the sampling time, which is not known."


def _figure(figure: Figure) -> str:
    if figure.deviation is None:
        return plain_number(figure.value, 4)
    return f"{plain_number(figure.value, 4)} +- {plain_number(figure.deviation, 2)}"


def _unit(name: str) -> str:
    """Returns the unit of a channel; a column that is no channel counts in units of its own."""
    channel = CHANNELS.get(name)
    return f"unit of {name}" if channel is None or channel.unit == "1" else channel.unit

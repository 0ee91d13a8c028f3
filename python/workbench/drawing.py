# SPDX-License-Identifier: MIT
"""A drawing of the machine with the values of the form: cylinder, valve, supply and load."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

from ehsid.harness.base.text import printable

WIDTH, HEIGHT = 560, 330


def machine_svg(answers: Mapping[str, str], sizes: Mapping[str, float], *, double: bool) -> str:
    """Returns the drawing of a servo as SVG.

    Parameters
    ----------
    answers
        what is written at the parts, by the names of the questions; "" is shown as "?".
    sizes
        bore, rod and stroke in metres, as far as they are known; the cylinder has their
        proportions.
    double
        whether the rod is on both sides.
    """
    bore = sizes.get("bore", 0.063)
    height = 64.0
    rod = height * min(max(sizes.get("rod", 0.5 * bore) / bore, 0.0), 0.95)
    length = min(max(height * sizes.get("stroke", 5.0 * bore) / bore, 110.0), 250.0)
    left, top = 70.0, 60.0
    piston, middle = left + 0.45 * length, top + 0.5 * height
    load = left + length + 60.0
    parts = [
        _box(left, top, length + 14, height, "var(--tint)"),
        _box(piston, top, 14, height, "var(--soft)"),
        _box(piston + 14, middle - 0.5 * rod, load - piston - 14, rod, "var(--line)"),
        _box(load, middle - 35, 70, 70, "var(--line)"),
        *([_box(left - 45, middle - 0.5 * rod, piston - left + 45, rod, "var(--line)")] * double),
        _line(left, top - 14, left + length, top - 14),
        _text(left + 0.5 * length, top - 20, f"stroke {_of(answers, 'stroke')}", "middle"),
        _text(left + 6, middle + 4, f"⌀ {_of(answers, 'bore')}"),
        _text(piston + 22, middle - 0.5 * rod - 5, f"⌀ {_of(answers, 'rod')}"),
        _text(load + 35, middle + 52, _of(answers, "mass"), "middle"),
        _text(load + 35, middle - 42, "load", "middle"),
    ]
    valve = left + 0.5 * length - 50
    bottom = top + height
    for x in (left + 12, left + length):
        end = valve + (20 if x == left + 12 else 80)
        parts.append(_path(f"M{x} {bottom} V{bottom + 22} H{end} V{bottom + 45}"))
    parts += [
        _box(valve, bottom + 45, 100, 36, "var(--tint)"),
        _text(valve + 50, bottom + 68, "valve", "middle"),
        _text(valve + 110, bottom + 59, f"{_of(answers, 'rated-flow')}"),
        _text(valve + 110, bottom + 77, f"at {_of(answers, 'rated-drop')}"),
        _text(valve - 8, bottom + 68, _of(answers, "rated-command"), "end"),
        _path(f"M{valve + 30} {bottom + 81} V{bottom + 110}"),
        _path(f"M{valve + 70} {bottom + 81} V{bottom + 110}"),
        _text(valve + 28, bottom + 128, f"P {_of(answers, 'supply')}", "end"),
        _text(valve + 72, bottom + 128, f"T {_of(answers, 'tank')}"),
    ]
    return (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="Drawing of the machine" '
        f'style="width:100%;max-width:{WIDTH}px">{"".join(parts)}</svg>'
    )


def _of(answers: Mapping[str, str], name: str) -> str:
    return answers.get(name, "").strip()[:18] or "?"


def _box(x: float, y: float, width: float, height: float, fill: str) -> str:
    return (
        f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" fill="{fill}" '
        'stroke="var(--ink)"/>'
    )


def _line(x: float, y: float, to_x: float, to_y: float) -> str:
    return f'<line x1="{x:.1f}" y1="{y:.1f}" x2="{to_x:.1f}" y2="{to_y:.1f}" stroke="var(--soft)"/>'


def _path(path: str) -> str:
    return f'<path d="{path}" fill="none" stroke="var(--ink)" stroke-width="1.5"/>'


def _text(x: float, y: float, text: str, anchor: str = "start") -> str:
    return (
        f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="var(--ink)">'
        f"{escape(printable(text))}</text>"
    )

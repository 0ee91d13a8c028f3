# SPDX-License-Identifier: MIT
"""Computes bars, dots and intervals of the diagnosis page, in per cent of the width of an axis."""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..catalogue.keys import ParameterKey
from ..catalogue.parameters import plant_parameters
from ..diagnosis.result import Diagnosis
from ..diagnosis.schema import Calibrated, Estimate, HowFar, Span
from .gap_words import SIMULATIONS, interval, plain_name, quantity, unit_of, value_name
from .page import Bar, Column, Mark, Scale, Table, Tagged, Timeline
from .shares import percent, percent_ends

# The axis for fitted values extends this many standard deviations of the prior to either side.
AXIS_SIGMAS = 3.0


def _inside(place: float) -> float:
    return min(100.0, max(0.0, place))


def share_bar(label: str, share: Estimate | float, kind: str = "", note: str = "") -> Bar:
    """Returns the bar of a share in [0, 1], with its interval if the share is an `Estimate`."""
    low: float | None = None
    high: float | None = None
    if isinstance(share, Estimate):
        low, high = _inside(100.0 * share.low), _inside(100.0 * share.high)
        shown, value = percent(share.value), share.value
        note = f"{percent_ends(share)}{', ' if note else ''}{note}"
    else:
        shown, value = percent(share), share
    return Bar(label, shown, _inside(100.0 * value), kind, low, high, note)


def gap_bars(gap: HowFar, kinds: Sequence[str]) -> list[Bar]:
    """Returns bars of the gap of each kind of simulation and of the noise floor.

    The largest of these values fills the axis.
    """
    steps = [(SIMULATIONS[kind], kind, float(getattr(gap, kind))) for kind in kinds]
    largest = max(*(value for _, _, value in steps), gap.noise_floor[1], 1e-12)
    bars = [
        Bar(words, percent(value), _inside(100.0 * value / largest), kind)
        for words, kind, value in steps
    ]
    low, high = (_inside(100.0 * end / largest) for end in gap.noise_floor)
    shown = f"{percent(gap.noise_floor[0])} to {percent(gap.noise_floor[1])}"
    return [*bars, Bar("noise floor", shown, high, "floor", low, high)]


def value_table(diagnosis: Diagnosis, *, nuisances: bool) -> Table:
    """Returns the fitted nuisances or the fitted rig values; values that moved come first."""
    values = [
        (name, value)
        for name, value in diagnosis.calibration.items()
        if ParameterKey(name).is_nuisance == nuisances
    ]
    values.sort(key=lambda item: not item[1].moved)
    known = "typical" if nuisances else "rig file"
    ends = Scale(f"−{AXIS_SIGMAS:g} σ", known, f"+{AXIS_SIGMAS:g} σ")
    return Table(
        "",
        ("value", known, "estimate", "90 % interval", ends),
        [(*_value_row(name, value), mark(diagnosis.in_sigmas[name])) for name, value in values],
        [i for i, (_, value) in enumerate(values) if value.moved],
    )


def _value_row(name: str, value: Calibrated) -> tuple[Tagged, str, str, str]:
    unit = unit_of(name)
    meaning = plant_parameters()[name].meaning if name in plant_parameters() else ""
    hint = f"{name}: {meaning}" if meaning else name
    return (
        Tagged(value_name(name), "moved" if value.moved else "", hint),
        quantity(value.rig, unit),
        *interval(value.found, unit),
    )


def mark(sigmas: Estimate | None) -> Mark:
    """Returns the place of an estimate that is given in standard deviations of its prior."""
    if sigmas is None:
        return Mark(None, None, None)
    return Mark(*(_on_axis(end) for end in (sigmas.value, sigmas.low, sigmas.high)))


def _on_axis(sigmas: float) -> float | None:
    if not math.isfinite(sigmas):
        return None
    return _inside(50.0 + 50.0 * sigmas / AXIS_SIGMAS)


def timelines(spans: Sequence[Span]) -> list[Timeline]:
    """Returns the shares of the gap over time, with one time axis for each record.

    The largest share of all records has the full height.
    """
    if not spans:
        return []
    largest = max(max(span.share_of_gap for span in spans), 1e-12)
    made = []
    for record in dict.fromkeys(span.record for span in spans):
        own = [span for span in spans if span.record == record]
        start, end = own[0].span_s[0], max(span.span_s[1] for span in own)
        length = max(end - start, 1e-12)
        columns = [
            Column(
                100.0 * (span.span_s[0] - start) / length,
                100.0 * (span.span_s[1] - span.span_s[0]) / length,
                _inside(100.0 * span.share_of_gap / largest),
                f"{span.span_s[0]:.2f} to {span.span_s[1]:.2f} s: {percent(span.share_of_gap)}",
            )
            for span in own
        ]
        label = f"Share of the gap over time in {record}"
        made.append(Timeline(record, label, f"{start:.1f} s", f"{end:.1f} s", columns))
    return made


def subsystem_bars(diagnosis: Diagnosis) -> list[Bar]:
    """Returns bars of the shares of the subsystems, the largest share first."""
    shares = sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1])
    return [share_bar(plain_name(name), share) for name, share in shares]

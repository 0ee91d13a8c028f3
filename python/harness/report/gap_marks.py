# SPDX-License-Identifier: MIT
"""Computes bars, dots and intervals of the diagnosis page, in per cent of the width of an axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.catalogue.parameters import plant_parameters
from ehsid.harness.gap.schema import CalibratedValue, Diagnosis, Estimate, HowFar, SpanShare
from ehsid.harness.report.gap_words import (
    SIMULATIONS,
    interval,
    percent,
    percent_ends,
    plain_name,
    quantity,
    unit_of,
    value_name,
)

# The axis for fitted values extends this many standard deviations of the prior to either side.
AXIS_SIGMAS = 3.0


@dataclass(frozen=True)
class Bar:
    """A bar with its texts; `width`, and the ends `low` and `high` of its interval, in per cent."""

    label: str
    shown: str
    width: float
    kind: str = ""
    low: float | None = None
    high: float | None = None
    note: str = ""


@dataclass(frozen=True)
class Dot:
    """A fitted value beside the value in the rig file (`told`).

    `at`, `low` and `high` are the places of the estimate and of the ends of its interval, in per
    cent of the axis. They are None where the prior has no bounded deviation.
    """

    name: str
    words: str
    meaning: str
    told: str
    found: str
    ends: str
    moved: bool
    at: float | None
    low: float | None
    high: float | None


@dataclass(frozen=True)
class Column:
    """A stretch of time as an upright bar; places and sizes in per cent of the axes."""

    left: float
    width: float
    height: float
    words: str


@dataclass(frozen=True)
class Stretch:
    """The upright bars of one record, and the start and the end of its time axis."""

    record: str
    start: str
    end: str
    columns: Sequence[Column]


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


def gap_bars(far: HowFar, kinds: Sequence[str]) -> list[Bar]:
    """Returns bars of the gap of each kind of simulation and of the noise floor.

    The largest of these values fills the axis.
    """
    steps = [(SIMULATIONS[kind], kind, float(getattr(far, kind))) for kind in kinds]
    largest = max(*(value for _, _, value in steps), far.noise_floor[1], 1e-12)
    bars = [
        Bar(words, percent(value), _inside(100.0 * value / largest), kind)
        for words, kind, value in steps
    ]
    low, high = (_inside(100.0 * end / largest) for end in far.noise_floor)
    shown = f"{percent(far.noise_floor[0])} to {percent(far.noise_floor[1])}"
    return [*bars, Bar("noise floor", shown, high, "floor", low, high)]


def parameter_dots(diagnosis: Diagnosis, *, nuisances: bool) -> list[Dot]:
    """Returns the fitted nuisances or the fitted rig values; values that moved come first."""
    dots = [
        _dot(name, value)
        for name, value in diagnosis.calibration.items()
        if ParameterKey(name).is_nuisance == nuisances
    ]
    return sorted(dots, key=lambda dot: not dot.moved)


def _dot(name: str, value: CalibratedValue) -> Dot:
    unit = unit_of(name)
    found, ends = interval(value.found, unit)
    places: tuple[float | None, ...] = (None, None, None)
    if value.in_sigmas is not None:
        places = tuple(
            _on_axis(end)
            for end in (value.in_sigmas.value, value.in_sigmas.low, value.in_sigmas.high)
        )
    words = value_name(name)
    meaning = plant_parameters()[name].meaning if name in plant_parameters() else ""
    return Dot(name, words, meaning, quantity(value.rig, unit), found, ends, value.moved, *places)


def _on_axis(sigmas: float) -> float | None:
    if not math.isfinite(sigmas):
        return None
    return _inside(50.0 + 50.0 * sigmas / AXIS_SIGMAS)


def time_stretches(spans: Sequence[SpanShare]) -> list[Stretch]:
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
        made.append(Stretch(record, f"{start:.1f} s", f"{end:.1f} s", columns))
    return made


def subsystem_bars(diagnosis: Diagnosis) -> list[Bar]:
    """Returns bars of the shares of the subsystems, the largest share first."""
    shares = sorted(diagnosis.where.subsystem.items(), key=lambda item: -item[1])
    return [share_bar(plain_name(name), share) for name, share in shares]

# SPDX-License-Identifier: MIT
"""What the check of a rig against a record comes to, as data.

Compares ranges: of the position, the command, and the measured supply pressure.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ..base.numbers import FloatArray
from ..catalogue.channels import CHAMBER_PRESSURES, COMMAND, POSITION, SPOOL, SUPPLY_PRESSURE
from ..diagnosis.data.gate_ranges import OTHER_UNIT, beyond_rated, beyond_stroke, check_pressures
from ..diagnosis.data.gate_signs import check_directions, check_ports
from ..diagnosis.schema import CouldBeSeen
from ..records import Record
from ..rigs import Rig
from .motion import Motion, has_pressures


class Status(StrEnum):
    """Outcome of one check."""

    fits = "fits"
    does_not_fit = "does not fit"
    cannot_be_told = "cannot be told"


@dataclass(frozen=True)
class Finding:
    """Outcome of one check of a rig against a record."""

    check: str
    """What was compared, in a few words."""
    status: Status
    """Its outcome."""
    text: str
    """One or more sentences with the numbers; where it does not fit, with the value to change."""
    value: str | None
    """Full name of the value of the rig, or None where it is none."""
    factor: float | None
    """What the record shows over what the rig says; None if that is no ratio."""
    fitting: tuple[float | None, float | None] | None
    """The range of factors that fit, low and high; None without a range, or at an end without a
    bound."""


@dataclass(frozen=True, eq=False)
class RecordCheck:
    """All findings on one record."""

    record: str
    """Name of the record."""
    findings: Sequence[Finding]
    """In the order in which they should be read: a wrong sign makes the others worthless."""
    notes: Sequence[str]
    """What else is to be known about the record, one sentence each."""
    time_s: FloatArray
    speed_m_s: FloatArray
    """Times and measured speeds, smoothed, shape (N,)."""
    expected_m_s: FloatArray | None
    """Speed by the values of the rig, shape (N,); None for a plant without a valve's flow."""
    could_be_seen: tuple[CouldBeSeen, ...] = ()
    """From which size on the record can show each effect, at best; empty where the rig does not
    fit."""


@dataclass(frozen=True)
class CanShow:
    """An effect as `could_be_seen` of diagnosis.json has it: `size` is of `parameter`, in SI."""

    id: str
    parameter: str
    size: float | None
    limit: str


@dataclass(frozen=True)
class WrittenCheck:
    """The check of a record in rig_check.json: its name, findings, and notes as sentences.

    `could_be_seen` has the size from which on it can show each effect, as in diagnosis.json, if the
    simulator is as good as is tolerated; empty where the rig does not fit.
    """

    record: str
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]
    could_be_seen: tuple[CanShow, ...] = ()


@dataclass(frozen=True)
class RigCheckFile:
    """Content of rig_check.json: the name of the rig, and a check for each record in its order."""

    rig: str
    records: tuple[WrittenCheck, ...]


def rig_check_file(rig: str, checks: Sequence[RecordCheck]) -> RigCheckFile:
    """Returns the content of rig_check.json; the signals are not in it."""
    return RigCheckFile(
        rig,
        tuple(
            WrittenCheck(
                check.record,
                tuple(check.findings),
                tuple(check.notes),
                tuple(
                    CanShow(
                        one.id, one.parameter, None if math.isnan(one.size) else one.size, one.limit
                    )
                    for one in check.could_be_seen
                ),
            )
            for check in checks
        ),
    )


def finding(
    check: str,
    status: Status,
    text: str,
    value: str | None = None,
    factor: float | None = None,
    fitting: tuple[float | None, float | None] | None = None,
) -> Finding:
    """Returns a finding; what is not given it does not have."""
    return Finding(check, status, text, value, factor, fitting)


def judged(
    check: str,
    value: str | None,
    factor: float,
    tolerance: float,
    texts: tuple[str, str],
) -> Finding:
    """Returns the finding on a ratio: it fits between 1 / (1 + tolerance) and 1 + tolerance.

    `texts` has the one for what fits and the one for what does not.
    """
    low, high = 1.0 / (1.0 + tolerance), 1.0 + tolerance
    fits = low <= factor <= high
    status = Status.fits if fits else Status.does_not_fit
    return Finding(check, status, texts[not fits], value, factor, (low, high))


def untold(check: str, text: str, value: str | None = None) -> Finding:
    """Returns the finding that a record cannot tell."""
    return finding(check, Status.cannot_be_told, text, value)


# An end is reached where the rod comes nearer than this share of the stroke.
NEAR_END = 0.02
# A rod that stays at its extreme for this share of the record, whatever the command, is at a stop.
AT_STOP = 0.02
PRESSED = 0.05
# Accuracy of a manometer beside that of the rig's value, relative.
MANOMETER = 0.02
# How far a spool sensor and the opening may differ, relative.
SPOOL_TOLERANCE = 0.15


def sign_findings(record: Record, rig: Rig) -> list[Finding]:
    """Compares the directions of command and motion, and the names of the chamber pressures."""
    against = next(check_directions(record, rig), None)
    found = [
        finding("direction", Status.does_not_fit, against.what)
        if against
        else finding("direction", Status.fits, "a positive command extends the rod")
    ]
    if rig.plant != "ehs" or not has_pressures(record):
        return found
    remark = next(check_ports(record, rig), None)
    if remark is None:
        text = "the chamber pressures push the way the rod moves"
        return [*found, finding("ports", Status.fits, text)]
    # Only a serious remark is certain; the other one may come of wrong areas.
    if remark.serious:
        return [*found, finding("ports", Status.does_not_fit, remark.what)]
    return [*found, untold("ports", remark.what)]


def stroke_finding(record: Record, rig: Rig, moved: Motion) -> list[Finding]:
    """Compares the range of the position with the stroke."""
    stroke = rig.values.get("cylinder.stroke_m")
    if stroke is None:
        return []
    key, check = "cylinder.stroke_m", "stroke"
    position = record.column(POSITION)
    low, high = float(position.min()), float(position.max())
    shown = f"the rod moves between {1e3 * low:.4g} and {1e3 * high:.4g} mm"
    beyond = beyond_stroke(record, rig)
    if beyond is not None:
        why = beyond.what
        if low >= -NEAR_END * stroke and OTHER_UNIT not in why:
            why = (
                f"the stroke of the rig file is too short, or the unit is wrong; if the unit is "
                f"right, set {key} to the one of the data sheet, {high:.4g} at least"
            )
        text = f"{shown}, the rig's stroke is {1e3 * stroke:g} mm: {why}"
        longest = max(high, high - low)
        return [finding(check, Status.does_not_fit, text, key, longest / stroke, (None, 1.0))]
    top = position > high - 1e-3 * stroke
    pressed = top & (moved.opening > PRESSED)
    if high < (1.0 - NEAR_END) * stroke and float(np.mean(pressed)) > AT_STOP:
        text = (
            f"the rod stands at {1e3 * high:.4g} mm for {100.0 * np.mean(pressed):.2g} % of the "
            f"time although the command extends it: a stop. The rig's stroke is "
            f"{1e3 * stroke:g} mm; if this is the end of the cylinder, set {key} to {high:.4g}"
        )
        return [finding(check, Status.does_not_fit, text, key, high / stroke, (None, 1.0))]
    if low < NEAR_END * stroke and high > (1.0 - NEAR_END) * stroke:
        text = f"{shown}, the whole stroke of {1e3 * stroke:g} mm"
        return [finding(check, Status.fits, text, key, high / stroke, (None, 1.0))]
    text = (
        f"{shown}, inside the stroke of {1e3 * stroke:g} mm; the ends are not reached, so a "
        "longer or slightly shorter stroke would do, too"
    )
    return [untold(check, text, key)]


def command_findings(record: Record, rig: Rig, moved: Motion) -> list[Finding]:
    """Compares the command with the rated one, and with a measured spool."""
    key, check = "valve.rated_command_v", "rated command"
    rated = rig.values.get(key)
    if rated is None:
        return []
    command = record.column(COMMAND)
    largest = float(np.abs(command).max())
    shown = f"commands reach {largest:.4g}, {100.0 * largest / rated:.3g} % of the rated {rated:g}"
    if beyond_rated(record, rig) is not None:
        text = f"{shown}: the full opening needs at least this command; set {key} to the data "
        text += "sheet's full command, in the unit of the column"
        return [finding(check, Status.does_not_fit, text, key, largest / rated, (None, 1.0))]
    if SPOOL in record.columns and np.ptp(record.column(SPOOL)) > 0.0:
        assert record.dt_s is not None
        smooth = moved.kernel.smooth
        opening, spool = smooth(moved.opening), smooth(record.column(SPOOL))
        opening, spool = opening - opening.mean(), spool - spool.mean()
        gain = float(opening @ spool / max(opening @ opening, 1e-300))
        if gain > 0.0 and np.ptp(opening) > 0.05:
            right = rated / gain
            good = f"{shown}; the spool opens as with a rated command of {right:.4g}"
            bad = f"{good}: change {key} by the factor {1.0 / gain:.3g}, or check the spool's scale"
            return [judged(check, key, 1.0 / gain, SPOOL_TOLERANCE, (good, bad))]
    return [finding(check, Status.fits, shown, key)]


def doubted_units(findings: Sequence[Finding]) -> list[str]:
    """Returns the channels that are perhaps in another unit."""
    texts = [one.text for one in findings if OTHER_UNIT in one.text]
    channels = (POSITION, *CHAMBER_PRESSURES, SUPPLY_PRESSURE)
    return [name for name in channels if any(name in text for text in texts)]


def measured_supply(record: Record, rig: Rig) -> list[Finding]:
    """Compares a measured supply pressure with that of the rig, and pressures with their limits."""
    supply = rig.values.get("supply.pressure_pa")
    if supply is None:
        return []
    key, check = "supply.pressure_pa", "supply"
    found = [
        finding("pressures", Status.does_not_fit, remark.what)
        for remark in check_pressures(record, rig)
    ]
    if SUPPLY_PRESSURE not in record.columns:
        return found
    if SUPPLY_PRESSURE in doubted_units(found):
        return [*found, untold(check, f"the unit of {SUPPLY_PRESSURE} must be right first", key)]
    # The pump gives its pressure at no flow; under flow it may be lower.
    column = record.column(SUPPLY_PRESSURE)
    measured, top = float(np.median(column)), float(np.quantile(column, 0.98))
    shown = f"measured at {1e-5 * measured:.4g} bar (median), the rig says {1e-5 * supply:.4g} bar"
    if measured <= supply <= top:
        return [*found, finding(check, Status.fits, shown, key, measured / supply)]
    bad = f"{shown}: set {key} to {measured:.4g} (factor {measured / supply:.3g})"
    tolerance = 2.0 * float(np.hypot(rig.sigma(key), MANOMETER))
    return [*found, judged(check, key, measured / supply, tolerance, (shown, bad))]

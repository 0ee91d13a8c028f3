# SPDX-License-Identifier: MIT
"""What the check of a rig against a record comes to, as data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from ..base.arrays import FloatArray


class Status(StrEnum):
    """Outcome of one check."""

    fits = "fits"
    does_not_fit = "does not fit"
    cannot_be_told = "cannot be told"


@dataclass(frozen=True)
class Finding:
    """Outcome of one check of a rig against a record.

    Attributes
    ----------
    check
        what was compared, in a few words.
    status
        its outcome.
    text
        one or more sentences with the numbers; where it does not fit, with the value to change.
    value
        full name of the value of the rig, or None where it is none.
    factor
        what the record shows over what the rig says; None if that is no ratio.
    fitting
        the range of factors that fit, low and high; None without a range, or at an end without a
        bound.
    """

    check: str
    status: Status
    text: str
    value: str | None
    factor: float | None
    fitting: tuple[float | None, float | None] | None


@dataclass(frozen=True, eq=False)
class RecordCheck:
    """All findings on one record.

    Attributes
    ----------
    record
        name of the record.
    findings
        in the order in which they should be read: a wrong sign makes the others worthless.
    notes
        what else is to be known about the record, one sentence each.
    time_s, speed_m_s
        times and measured speeds, smoothed, shape (N,).
    expected_m_s
        speed by the values of the rig, shape (N,); None for a plant without a valve's flow.
    """

    record: str
    findings: Sequence[Finding]
    notes: Sequence[str]
    time_s: FloatArray
    speed_m_s: FloatArray
    expected_m_s: FloatArray | None


@dataclass(frozen=True)
class WrittenCheck:
    """The check of a record in rig_check.json: its name, findings, and notes as sentences."""

    record: str
    findings: tuple[Finding, ...]
    notes: tuple[str, ...]


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
            WrittenCheck(check.record, tuple(check.findings), tuple(check.notes))
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

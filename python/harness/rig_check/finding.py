# SPDX-License-Identifier: MIT
"""What the check of a rig against a record comes to, as data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from ehsid.harness.arrays import FloatArray


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
    low, high
        the range of factors that fit; None without a factor.
    """

    check: str
    status: Status
    text: str
    value: str | None = None
    factor: float | None = None
    low: float | None = None
    high: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Returns the finding as JSON has it."""
        return {
            "check": self.check,
            "status": str(self.status),
            "text": self.text,
            "value": self.value,
            "factor": self.factor,
            "fitting": None if self.low is None else [self.low, self.high],
        }


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

    def to_dict(self) -> dict[str, Any]:
        """Returns names, findings and notes as JSON has them, without the signals."""
        return {
            "record": self.record,
            "findings": [finding.to_dict() for finding in self.findings],
            "notes": list(self.notes),
        }


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
    return Finding(check, status, texts[not fits], value, factor, low, high)


def untold(check: str, text: str, value: str | None = None) -> Finding:
    """Returns the finding that a record cannot tell."""
    return Finding(check, Status.cannot_be_told, text, value)

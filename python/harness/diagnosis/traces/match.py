# SPDX-License-Identifier: MIT
"""Brings a simulated trace to the samples of the record on whose command it was made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.channels import COMMAND
from ...records import Record
from ...rigs import Rig
from ..data.gate import stretch, usable_part
from ..model.comparison import OUTPUTS
from ..schema import Remark

# Of the record, in time, which a trace must cover.
LEAST_COVERED = 0.5
# Rms of the difference of the two commands, as a share of that of the command. Half a sample of
# delay between two logs of one command makes a few hundredths.
SAME_COMMAND = 0.2
# A trace with fewer samples than this share of the record's shows less.
COARSE = 0.34


@dataclass(frozen=True, eq=False)
class Matched:
    """The part of a record that a trace covers, and the trace at its samples."""

    record: Record
    trace: Mapping[str, FloatArray]
    """Simulated outputs by name, shape (N,) each."""
    remarks: tuple[Remark, ...] = ()


def matched(record: Record, simulated: Record, rig: Rig) -> Matched:
    """Returns the trace at the samples of the record.

    Both count time from the same moment; where they do not overlap, but are of about one length,
    both begin at once. Between its samples the trace is taken as straight.

    Raises
    ------
    ValueError
        the trace has no time, was made on another command, or covers too little of the record.
    """
    place = simulated.source or simulated.name
    part, _ = usable_part(record, rig)
    if simulated.time_s is None or part.time_s is None:
        raise ValueError(f"{place}: a trace is compared by its time: expected a column time_s")
    at, given, remarks = part.time_s, simulated.time_s, []
    if _covered(at, given) < LEAST_COVERED:
        given = given - given[0] + at[0]
        if _covered(at, given) < LEAST_COVERED:
            raise ValueError(
                f"{place}: it covers {100.0 * _covered(at, given):.0f} % of the record "
                f"{record.name}: expected a simulation of the command of this record, over at "
                f"least {100.0 * LEAST_COVERED:.0f} % of its time"
            )
        remarks.append(
            Remark(
                record.name,
                f"the times of the trace {simulated.name} and of the record do not overlap; both "
                "were taken to begin at once",
            )
        )
    inside = np.flatnonzero((at >= given[0]) & (at <= given[-1]))
    covered = slice(int(inside[0]), int(inside[-1]) + 1)
    if covered != slice(0, at.size):
        part = stretch(part, covered)
        at = at[covered]
    trace = {
        name: np.interp(at, given, simulated.column(name))
        for name in OUTPUTS
        if name in part.columns and name in simulated.columns
    }
    if COMMAND in simulated.columns:
        _check_command(part, np.interp(at, given, simulated.column(COMMAND)), str(place))
    if np.count_nonzero((given >= at[0]) & (given <= at[-1])) < COARSE * at.size:
        remarks.append(
            Remark(
                record.name,
                f"the trace {simulated.name} has less than a third of the record's samples; what "
                "is faster than its sampling shows as an error",
            )
        )
    return Matched(part, trace, tuple(remarks))


def _covered(at: FloatArray, given: FloatArray) -> float:
    """Share of the times `at` that lie within those given."""
    return float(np.mean((at >= given[0]) & (at <= given[-1])))


def _check_command(record: Record, command_v: FloatArray, place: str) -> None:
    sent = record.column(COMMAND)
    size = float(np.std(sent))
    other = float(np.sqrt(np.mean((command_v - sent) ** 2)))
    if other > SAME_COMMAND * size:
        raise ValueError(
            f"{place}: its command differs from that of the record {record.name} by {other:.3g} V "
            f"rms: expected a simulation of the same command, which moves by {size:.3g} V rms; "
            "simulate the command of the record, or check the unit of the column"
        )

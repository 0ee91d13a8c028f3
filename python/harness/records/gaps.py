# SPDX-License-Identifier: MIT
"""Gaps of a record in words: how many rows are missing, and what helps against it."""

from __future__ import annotations

from .record import Record
from .timebase import BRIDGED_STEPS, MAX_JITTER, Gap


def missing_rows(gap: Gap, dt_s: float) -> int:
    """Returns the number of rows that are missing in a gap."""
    return max(round(gap.duration_s / dt_s) - 1, 1)


def is_short(gap: Gap, dt_s: float) -> bool:
    """Whether so few rows are missing that a log is interpolated there."""
    return gap.duration_s <= (BRIDGED_STEPS + MAX_JITTER) * dt_s


def what_is_missing(record: Record) -> str:
    """Returns what is missing in a record, such as "128 single rows are missing"; "" if nothing."""
    if not record.gaps or record.dt_s is None:
        return ""
    dt_s = record.dt_s
    short = [gap for gap in record.gaps if is_short(gap, dt_s)]
    long = [gap for gap in record.gaps if not is_short(gap, dt_s)]
    said = []
    if short:
        rows = sum(missing_rows(gap, dt_s) for gap in short)
        if rows == len(short):
            said.append("1 single row is" if rows == 1 else f"{rows} single rows are")
        else:
            where = "1 place" if len(short) == 1 else f"{len(short)} places"
            said.append(f"{rows} rows at {where} are")
        said[0] += " missing"
    if long:
        longest = max(long, key=lambda gap: gap.duration_s)
        seconds = f"{longest.duration_s:.3g} s after {longest.start_s:.4g} s"
        said.append(
            f"there is a gap of {seconds}"
            if len(long) == 1
            else f"there are {len(long)} gaps, the longest of {seconds}"
        )
    return " and ".join(said)


def mend_of_gaps(record: Record) -> str:
    """Returns what helps against the gaps of a record."""
    assert record.dt_s is not None
    if any(is_short(gap, record.dt_s) for gap in record.gaps):
        return (
            f"read it with --dt {record.dt_s:.6g}, which interpolates holes of up to "
            f"{round(BRIDGED_STEPS) - 1} rows"
        )
    return "find out why the logger left rows out, or give a part without a gap"


def pieces_in_words(record: Record) -> str:
    """Returns one clause on the gaps of a record and the pieces that they leave."""
    pieces = len(record.segments)
    return f"{what_is_missing(record)}, so the record is in {pieces} pieces"


def gap_remarks(record: Record) -> tuple[str, ...]:
    """Returns a remark on a record with gaps that was read as it is; none of one without."""
    if not record.gaps:
        return ()
    return (
        f"{pieces_in_words(record)}; nothing is filled in, and a simulation starts anew in each. "
        f"To mend it: {mend_of_gaps(record)}",
    )

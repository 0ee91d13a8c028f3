# SPDX-License-Identifier: MIT
"""Takes the command of a record to drive a rig."""

from __future__ import annotations

import numpy as np

from ...base.arrays import FloatArray
from ...catalogue.channels import COMMAND
from ...records import Record
from ...records.timebase import mend_of_gaps, pieces_in_words
from ...rigs import Rig
from .controller import command_limit

# A logged command may be beyond the rated one, where the valve is fully open. One that is so far
# beyond it is in another unit.
MOST_COMMAND = 10


def logged_command(record: Record, rig: Rig) -> tuple[FloatArray, float]:
    """Returns the command of a record, V, shape (N,), and its sampling time in seconds.

    Raises
    ------
    ValueError
        the record has no command, has gaps or no time, or its command is far beyond the rated one.
    """
    place = record.source or record.name
    command = record.column(COMMAND)
    if record.dt_s is None:
        raise ValueError(f"{place}: a command without time cannot drive a rig; give its time")
    if len(record.segments) > 1:
        raise ValueError(
            f"{place}: a command with gaps cannot drive a rig: {pieces_in_words(record)}; "
            f"{mend_of_gaps(record)}"
        )
    largest, limit = float(np.abs(command).max()), command_limit(rig)
    if largest > MOST_COMMAND * limit:
        raise ValueError(
            f"{place}, column '{COMMAND}': the command reaches {largest:.4g} V: expected at most "
            f"{MOST_COMMAND} times the rated command of {limit:g} V; is the column in V?"
        )
    return command, record.dt_s

# SPDX-License-Identifier: MIT
"""Measured and simulated records: one schema, several file formats, messages that help.

>>> record = read_record("bench.csv")                                  # the full schema
>>> record = read_record("crane.csv", columns=("valve_opening", "oil_pressure"))  # any two columns
>>> record = read_record("run.mf4"); record.origin             # a log: what was taken for what
"""

from ..catalogue.channels import CHANNELS, REQUIRED_COLUMNS, Channel
from .checks import Gap, Jitter, TimeBase
from .errors import RecordError
from .mapping import NO_HINTS, ColumnMap, Hints, Layout
from .reading import read_record
from .record import Origin, Record, Taken, make_record, write_record

__all__ = [
    "CHANNELS",
    "NO_HINTS",
    "REQUIRED_COLUMNS",
    "Channel",
    "ColumnMap",
    "Gap",
    "Hints",
    "Jitter",
    "Layout",
    "Origin",
    "Record",
    "RecordError",
    "Taken",
    "TimeBase",
    "make_record",
    "read_record",
    "write_record",
]

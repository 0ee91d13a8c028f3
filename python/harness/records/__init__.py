# SPDX-License-Identifier: MIT
"""Measured and simulated records: one schema, several file formats, messages that help.

>>> record = read_record("bench.csv")                                  # the full schema
>>> record = read_record("crane.csv", columns=("valve_opening", "oil_pressure"))  # any two columns
>>> record = read_record("run.mf4"); record.origin             # a log: what was taken for what
"""

from ..catalogue.channels import CHANNELS
from .errors import RecordError
from .mapping import NO_HINTS, ColumnMap, Hints, Layout
from .reading import read_record
from .record import Origin, Record, Taken, make_record, write_record

__all__ = [
    "CHANNELS",
    "NO_HINTS",
    "ColumnMap",
    "Hints",
    "Layout",
    "Origin",
    "Record",
    "RecordError",
    "Taken",
    "make_record",
    "read_record",
    "write_record",
]

# SPDX-License-Identifier: MIT
from __future__ import annotations
import os
from collections.abc import Mapping
from dataclasses import replace
from ehsid.harness import records
from ehsid.harness.api.tables import Columns, columns_of
from ehsid.harness.api.record import Record
from ehsid.harness.api.wording import in_python, log_reading
from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.records import NO_HINTS, Hints, read_record
from ehsid.harness.records.formats import record_of_columns
from ehsid.harness.records.logs.mapping import parse_maps
Source = str | os.PathLike[str] | Columns | Record | records.Record

def read(source: Source, *, maps: Mapping[str, str] | None=None, dt_s: float | None=None, name: str | None=None) -> Record:
    ...

def hints_of(maps: Mapping[str, str] | None, dt_s: float | None) -> Hints:
    ...

def record_of(source: Source) -> records.Record:
    ...

# SPDX-License-Identifier: MIT
"""Records of one machine under names that differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from .in_memory import digest
from .record import Record


def told_apart(records: Sequence[Record]) -> list[Record]:
    """Returns the records with unique names.

    If records have the same file stem, the name of the folder is put before it.

    Raises
    ------
    ValueError
        two records have the same data, or the names are still not unique.
    """
    seen: dict[str, Record] = {}
    for record in records:
        # A record that was made in memory, such as a simulated one, has no digest of a file.
        key = record.sha256 or digest(record.columns.items())
        if key in seen:
            raise ValueError(
                f"{_place(record)}: the same data as {_place(seen[key])}; give each record once, "
                "and hold out none that is fitted"
            )
        seen[key] = record
    stems = [record.name for record in records]
    named = [
        replace(record, name=f"{Path(record.source).resolve().parent.name}_{record.name}")
        if record.source is not None and stems.count(record.name) > 1
        else record
        for record in records
    ]
    names = [record.name for record in named]
    twice = [record for record in named if names.count(record.name) > 1]
    if twice:
        raise ValueError(
            f"{_place(twice[0])} and {_place(twice[1])}: both are called "
            f"'{twice[0].name}'; rename one"
        )
    return named


def _place(record: Record) -> Path | str:
    """Returns the file of a record, or its name where it has none."""
    return record.source or record.name

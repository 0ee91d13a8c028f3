# SPDX-License-Identifier: MIT
"""Records of one machine under names that differ."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ehsid.harness.records.record import Record


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
        assert record.sha256 is not None
        first = seen.setdefault(record.sha256, record)
        if first is not record:
            raise ValueError(
                f"{record.source}: the same data as {first.source}; give each record once, and "
                "hold out none that is fitted"
            )
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
            f"{twice[0].source} and {twice[1].source}: both are called "
            f"'{twice[0].name}'; rename one"
        )
    return named

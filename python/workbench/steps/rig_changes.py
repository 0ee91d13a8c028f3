# SPDX-License-Identifier: MIT
"""The rig that a diagnosis found beside the rig before, as tables."""

from __future__ import annotations

from pathlib import Path

from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.diagnosis.schema import DiagnosisFile
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.changes import Change, changes
from ehsid.harness.rigs.table_words import table_words
from ehsid.harness.show.gap_words import first_upper, quantity, unit_of, value_name
from ehsid.harness.show.page import Block, Folded, Heading, Items, Table

from .. import look

# Of a value: smaller changes are nothing that a data sheet could say, and are not shown.
LEAST_CHANGE = 1e-3
COLUMNS = ("value", "before", "after", "change")


def rig_changes_html(before_file: Path, after_file: Path, found: DiagnosisFile) -> str:
    """Returns what the diagnosis made of the rig: what it added, and which values moved.

    Parameters
    ----------
    before_file, after_file
        the rig of the diagnosis, and the one that it wrote.
    found
        the diagnosis; it says which values moved more than by chance.
    """
    before, after = read_rig(before_file), read_rig(after_file)
    moved = {name for name, value in found.calibration.items() if value.moved}
    every = changes(before, after, least=LEAST_CHANGE)
    added = [one for one in every if one.before is None and not _is_nuisance(one)]
    fitted = [one for one in every if one.before is not None and not _is_nuisance(one)]
    hidden = [one for one in every if _is_nuisance(one)]
    blocks: list[Block] = [Heading("The rig with what was found")]
    laws = _laws(before, after)
    if added:
        blocks.append(_table("Added", added, moved))
    if laws:
        blocks += ["Added:", Items(laws)]
    if not (added or laws):
        blocks.append("No effect was added.")
    if fitted:
        caption = "Values that moved by 0.1 % or more"
        if any(one.key in moved for one in fitted):
            caption += "; marked: the change matters, and cannot be chance"
        blocks.append(_table(caption, fitted, moved))
    if hidden:
        title = f"What no data sheet states ({len(hidden)})"
        blocks.append(Folded(title, [_table("", hidden, moved)]))
    return look.told(*blocks)


def _is_nuisance(change: Change) -> bool:
    return ParameterKey(change.key).is_nuisance


def _table(caption: str, shown: list[Change], moved: set[str]) -> Table:
    rows = [
        (
            first_upper(value_name(one.key)),
            _shown(one.key, one.before),
            _shown(one.key, one.after),
            "" if one.share is None else f"{100.0 * one.share:+.2g} %",
        )
        for one in shown
    ]
    marked = [i for i, one in enumerate(shown) if one.key in moved]
    return Table(caption, COLUMNS, rows, marked)


def _shown(key: str, value: float | None) -> str:
    return "–" if value is None else quantity(value, unit_of(key))


def _laws(before: Rig, after: Rig) -> list[str]:
    """Returns the terms that have no name in the catalogue."""
    return [
        f"{name}: {table_words(law.adds_to, law.of)}, a table of {len(law.knots)} points"
        for name, law in after.tables.items()
        if name not in before.tables
    ]

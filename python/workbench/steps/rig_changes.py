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

from .. import look

# Of a value: smaller changes are nothing that a data sheet could say, and are not shown.
LEAST_CHANGE = 1e-3
COLUMNS = ["value", "before", "after", "change"]


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
    html = "<h2>The rig with what was found</h2>"
    laws = _laws(before, after)
    if added or laws:
        table = look.table(COLUMNS, [_row(one, moved) for one in added], (1, 2, 3))
        html += f"<p>Added:</p>{table if added else ''}{laws}"
    else:
        html += "<p>No effect was added.</p>"
    if fitted:
        html += (
            "<p>Values that moved by 0.1 % or more; <b>bold</b>: the change matters, and cannot be "
            "chance.</p>" + look.table(COLUMNS, [_row(one, moved) for one in fitted], (1, 2, 3))
        )
    if hidden:
        table = look.table(COLUMNS, [_row(one, moved) for one in hidden], (1, 2, 3))
        html += (
            f"<details><summary>What no data sheet states ({len(hidden)})</summary>{table}"
            "</details>"
        )
    return html


def _is_nuisance(change: Change) -> bool:
    return ParameterKey(change.key).is_nuisance


def _row(change: Change, moved: set[str]) -> list[str]:
    name = look.plain(first_upper(value_name(change.key)))
    share = "" if change.share is None else f"{100.0 * change.share:+.2g} %"
    return [
        f"<b>{name}</b>" if change.key in moved else name,
        _shown(change.key, change.before),
        _shown(change.key, change.after),
        share,
    ]


def _shown(key: str, value: float | None) -> str:
    return '<span class="soft">–</span>' if value is None else quantity(value, unit_of(key))


def _laws(before: Rig, after: Rig) -> str:
    """Returns the terms that have no name in the catalogue, one a line."""
    lines = [
        f"<li>{look.plain(name)}: {look.plain(table_words(law.adds_to, law.of))}, a table of "
        f"{len(law.knots)} points</li>"
        for name, law in after.tables.items()
        if name not in before.tables
    ]
    return f"<ul>{''.join(lines)}</ul>" if lines else ""

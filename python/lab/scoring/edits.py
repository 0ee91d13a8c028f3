# SPDX-License-Identifier: MIT
"""The edit test of a check: does the found rig follow when its causes are taken away or halved?

Of each machine with effects a check has two more records, after its effects were removed and after
they were halved. The named effects of the found rig are removed or halved, too, and nothing is
fitted. The rig then leaves as little as before where the names are right. A set of causes that
compensate each other leaves more, because the machine lost others than the rig did.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ehsid.harness.catalogue.channels import CHANNELS, POSITION, REQUIRED_COLUMNS
from ehsid.harness.diagnosis.edits import Twin, edit_test, read_twin
from ehsid.harness.diagnosis.edits.testing import AGREES
from ehsid.harness.records import read_record

from ..blind.making import EDITED, RESULTS
from .figures import LEVEL, Figure, quantile, share
from .findings import Findings
from .judging import Edited, ScoredCase

# Share of the sizes that is left, by the name of the record.
EDITS = {"removed": 0.0, "halved": 0.5}
RESAMPLED, SEED = 2000, 7


@dataclass(frozen=True)
class EditFigures:
    """The edit test of all machines with one edit."""

    edit: str
    """"removed" or "halved"."""
    each: tuple[Edited, ...]
    """Machines with effects of the catalogue for which something was named."""
    figures: tuple[Figure, ...]
    """Of right names and of others: the gap of the edited rig over its own on held-out data before,
    the gap without the edit over that with it, in how many machines the edited rig is the better
    one, and in how many it agrees; of right names how often the interval of what is left holds the
    truth; and how well both ratios separate right names from others."""


def edits_of(out: Path, name: str, findings: Findings) -> tuple[Edited, ...]:
    """Computes the edits of a case in the folder of a check.

    None where nothing was named, where the check has no such records, or where a record cannot
    carry the test.
    """
    folder, found = out / EDITED / name, out / RESULTS / name
    if not findings.named or not folder.is_dir() or not (found / "rig.augmented.toml").is_file():
        return ()
    return edits_of_twin(read_twin(found), folder)


def edits_of_twin(twin: Twin, folder: Path) -> tuple[Edited, ...]:
    """Computes both edits of a twin; the folder has the records of its machine."""
    required = (*REQUIRED_COLUMNS, POSITION)
    edited = []
    for edit, left in EDITS.items():
        record = read_record(
            folder / f"{edit}.csv",
            columns=list(CHANNELS),
            required=required,
            layout=twin.rig.columns,
        )
        try:
            test, _ = edit_test(twin, [record], [dict.fromkeys(twin.named, left)])
        except ValueError:
            continue
        told = test.edits[0]
        shown = told.left if told.shown else None
        edited.append(Edited(folder.name, edit, test.own_gap, test.found, told.gap, shown))
    return tuple(edited)


def edit_figures(cases: Sequence[ScoredCase]) -> tuple[EditFigures, ...]:
    """Returns the figures of both edits; none of a check without such records."""
    figures = []
    for edit, left in EDITS.items():
        pairs = [
            (case.names_right, one) for case in cases for one in case.edits if one.edit == edit
        ]
        if pairs:
            right, other = (
                [one for is_right, one in pairs if is_right == wanted] for wanted in (True, False)
            )
            made = figures_of(right, other, left)
            figures.append(EditFigures(edit, tuple(one for _, one in pairs), made))
    return tuple(figures)


def figures_of(right: Sequence[Edited], other: Sequence[Edited], left: float) -> tuple[Figure, ...]:
    """Returns the figures of `EditFigures`; left: share of the sizes that is left."""
    made: list[Figure] = []
    for group, words in ((right, "right names"), (other, "other names")):
        own = [one.over_own for one in group]
        fold = [one.found / one.edited for one in group]
        made += [
            quantile(f"{words}: edited over own gap before, median", own, unit="count"),
            quantile(f"{words}: the same, 90th percentile", own, 0.9, unit="count"),
            quantile(f"{words}: unedited over edited, median", fold, unit="count"),
            quantile(f"{words}: the same, 90th percentile", fold, 0.9, unit="count"),
            share(f"{words}: the edited rig is the better one", (f > 1.0 for f in fold)),
            share(f"{words}: at most {AGREES:g} times its own gap", (x <= AGREES for x in own)),
        ]
    held = (None if one.left is None else one.left.low <= left <= one.left.high for one in right)
    made.append(share("right names: interval of what is left holds the truth", held))
    made.append(
        separation(
            "unedited over edited is larger for right names than for others, share of the pairs",
            *([one.found / one.edited for one in group] for group in (other, right)),
        )
    )
    made.append(
        separation(
            "edited over own gap before is smaller for right names, share of the pairs",
            *([one.over_own for one in group] for group in (right, other)),
        )
    )
    return tuple(made)


def separation(words: str, first: Sequence[float], second: Sequence[float]) -> Figure:
    """Share of the pairs of a value of both groups of which that of the second is larger.

    0.5 separates nothing, 1 everything (area under the ROC curve: Hanley, McNeil, Radiology 143(1),
    1982). The interval is that of a bootstrap over both groups.
    """
    count = len(first) + len(second)
    if not first or not second:
        return Figure(words, math.nan, math.nan, math.nan, 0)
    a, b = np.array(first), np.array(second)
    more = (b > a[:, np.newaxis]) + 0.5 * (b == a[:, np.newaxis])
    rng = np.random.default_rng(SEED)
    draws = [
        more[np.ix_(rng.integers(a.size, size=a.size), rng.integers(b.size, size=b.size))].mean()
        for _ in range(RESAMPLED)
    ]
    low, high = np.quantile(draws, [0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL])
    return Figure(words, float(more.mean()), float(low), float(high), count)

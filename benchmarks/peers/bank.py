# SPDX-License-Identifier: MIT
"""The row of the estimator bank, which is measured by a program of its own."""

from __future__ import annotations

import json
from pathlib import Path

from ehsid.harness.show.page import Table


def bank_table(path: Path | None) -> Table | None:
    """A table out of a JSON file: a list of objects with `name`, `scalar`, `n` and `ns`.

    `ns` is the time of an update divided by the number of estimators that it updates. None without
    a file.
    """
    if path is None:
        return None
    rows = [
        (str(row["name"]), str(row["scalar"]), str(row["n"]), f"{float(row['ns']):.2f}")
        for row in json.loads(path.read_text(encoding="utf-8"))
    ]
    return Table(
        "A bank of independent estimators: time of an update of one of them.",
        ("bank", "precision", "n", "ns"),
        rows,
    )

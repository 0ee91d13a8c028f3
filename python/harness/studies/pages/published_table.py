# SPDX-License-Identifier: MIT
"""Table of the paper's recursive estimates, for comparison with our results."""

from __future__ import annotations

from ehsid.harness.report.page import Table
from ehsid.harness.studies.pages.recursive_sections import THETA_NAMES
from ehsid.harness.studies.published import RECURSIVE


def published_table() -> Table:
    """Returns the table of the paper's recursive estimates: final parameters and RMSE."""
    columns = RECURSIVE.values()
    rows = [
        (name, *(f"{column.theta[i]:.4f}" for column in columns))
        for i, name in enumerate(THETA_NAMES)
    ]
    rows.append(("RMSE", *(f"{column.rmse:.4f}" for column in columns)))
    return Table(
        "The paper's Table 3, of its own rig, whose data were not published, in units that it does "
        "not tell: no target.",
        ("", *RECURSIVE),
        rows,
    )

# SPDX-License-Identifier: MIT
"""Parts of the page in columns of equal width, as many as there is room for."""

from __future__ import annotations

import panel as pn


def in_columns(*parts: pn.viewable.Viewable, least: str = "14rem") -> pn.Column:
    """Returns the parts in rows of columns that are at least this wide, and of equal width."""
    for part in parts:
        part.sizing_mode = "stretch_width"
    columns = f"repeat(auto-fill, minmax(min({least}, 100%), 1fr))"
    return pn.Column(
        *parts,
        sizing_mode="stretch_width",
        styles={"display": "grid", "grid-template-columns": columns, "gap": "0 1.2rem"},
    )

# SPDX-License-Identifier: MIT
"""A figure as the data of an image inside a page: sharp at every size, and small."""

from __future__ import annotations

import base64
import io
import re

import matplotlib as mpl
from matplotlib.figure import Figure

# Coordinates are in points, of which a page shows one and a half pixels at most. Two decimals are
# a hundredth of that; matplotlib writes six.
PATHS = re.compile(r' d="[^"]*"')
DECIMALS = re.compile(r"(\.\d\d)\d+")


def embedded(figure: Figure) -> str:
    """Returns a figure as a data URI with an SVG image; the same figure gives the same bytes."""
    text = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "ehsid"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    small = PATHS.sub(lambda path: DECIMALS.sub(r"\1", path[0]), text.getvalue())
    return "data:image/svg+xml;base64," + base64.b64encode(small.encode("utf-8")).decode("ascii")

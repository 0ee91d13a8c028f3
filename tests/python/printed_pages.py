# SPDX-License-Identifier: MIT
"""Pages of docs whose code is run, compared with what they show."""

from __future__ import annotations

import re
import runpy
from pathlib import Path
from typing import Any

from sources import ROOT

DOCS = ROOT / "docs"


def made_by(script: str) -> dict[str, Any]:
    """The names of a script of docs that writes a page."""
    return runpy.run_path(str(DOCS / script))


def without_digits(text: str) -> str:
    """Numbers differ in their last digits between machines, and so does the width of columns."""
    plain = re.sub(r"[\u2500-\u257f]", " ", text)
    return re.sub(r"[-\s]+", " ", re.sub(r"-?[\d.]+(e[+-]?\d+)?", "#", plain))


def text_of(page: Path) -> str:
    return page.read_text(encoding="utf-8")

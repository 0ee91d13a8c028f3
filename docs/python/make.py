# SPDX-License-Identifier: MIT
"""Runs the lines of docs/python.md, writes what they print, and draws: python docs/python/make.py.

A text block below a block of Python holds what it prints.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
PAGE = HERE.with_name("python.md")
sys.path.insert(0, str(HERE.parent))  # blocks.py stands beside the folders of the pages

from blocks import run  # noqa: E402

if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    text, names = run(PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(text, encoding="utf-8")
    names["diagnosis"].plot().savefig(HERE / "diagnosis.png", dpi=80)

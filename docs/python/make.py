# SPDX-License-Identifier: MIT
"""Runs the lines of docs/python.md, writes what they print, and draws: python docs/python/make.py.

A text block below a block of Python holds what it prints.
"""

from __future__ import annotations

import io
import os
import re
import tempfile
from contextlib import chdir, redirect_stdout
from pathlib import Path
from typing import Any

HERE = Path(__file__).parent
PAGE = HERE.with_name("python.md")
BLOCK = re.compile(r"```python\n(?P<code>.*?)```\n\n```text\n(?P<shown>.*?)```\n", re.DOTALL)


def run(page: str) -> tuple[str, dict[str, Any]]:
    """Runs the page in a new folder; returns it with what was printed, and its names."""
    names: dict[str, Any] = {}

    def printed(block: re.Match[str]) -> str:
        out = io.StringIO()
        with redirect_stdout(out):
            exec(block["code"], names)
        # A space that keeps a number and its unit together cannot be seen on a page.
        text = out.getvalue().replace("\N{NO-BREAK SPACE}", " ")
        return f"```python\n{block['code']}```\n\n```text\n{text}```\n"

    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        return BLOCK.sub(printed, page), names


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    text, names = run(PAGE.read_text(encoding="utf-8"))
    PAGE.write_text(text, encoding="utf-8")
    names["diagnosis"].plot().savefig(HERE / "diagnosis.png", dpi=80)

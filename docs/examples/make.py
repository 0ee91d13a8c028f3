# SPDX-License-Identifier: MIT
"""Puts the programs of examples/ into docs/examples.md: python docs/examples/make.py

A comment with the name of a file stands above the block that has its content.
"""

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "examples.md"
BLOCK = re.compile(r"<!-- (?P<file>\S+) -->\n```(?P<language>\w+)\n(?P<text>.*?)```\n", re.DOTALL)


def filled(page: str) -> str:
    """Returns the page with the content of the files as they are."""

    def block(found: re.Match[str]) -> str:
        text = (ROOT / found["file"]).read_text(encoding="utf-8")
        return f"<!-- {found['file']} -->\n```{found['language']}\n{text}```\n"

    return BLOCK.sub(block, page)


if __name__ == "__main__":
    PAGE.write_text(filled(PAGE.read_text(encoding="utf-8")), encoding="utf-8")

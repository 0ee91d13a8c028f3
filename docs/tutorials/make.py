# SPDX-License-Identifier: MIT
"""Runs the pages with code of three sections, writes what they print, and draws their pictures.

python docs/tutorials/make.py [PAGE...]; without a page all of them. A picture of a page,
PAGE/NAME.png, is the figure that its Python calls NAME.
"""

from __future__ import annotations

import os
import re
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(DOCS))  # blocks.py stands beside the folders of the pages

import blocks  # noqa: E402

FOLDERS = ("tutorials", "how_to", "explanation")
PICTURE = re.compile(r"\]\((?P<folder>\w+)/(?P<name>\w+)\.png\)")


def pages() -> list[Path]:
    """Returns the pages with code; index.md lists the pages of a folder for the site."""
    every = [page for name in FOLDERS for page in DOCS.glob(f"{name}/*.md")]
    return sorted(
        page
        for page in every
        if page.name != "index.md" and "```" in page.read_text(encoding="utf-8")
    )


def run(page: Path) -> tuple[str, dict[str, Any]]:
    """Runs a page; returns it with what was printed, and its Python names."""
    # The pages on C++ need the sources.
    os.environ["EHSID"] = str(DOCS.parent)
    return blocks.run(page.read_text(encoding="utf-8"))


def draw(page: Path, text: str, names: dict[str, Any]) -> None:
    """Writes the pictures of a page that was run."""
    for picture in PICTURE.finditer(text):
        if picture["folder"] == page.stem:
            file = page.with_suffix("") / f"{picture['name']}.png"
            file.parent.mkdir(exist_ok=True)
            names[picture["name"]].savefig(file, dpi=80)


if __name__ == "__main__":
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    for path in map(Path, sys.argv[1:]) if sys.argv[1:] else pages():
        made, names = run(path)
        path.write_text(made, encoding="utf-8")
        draw(path, made, names)

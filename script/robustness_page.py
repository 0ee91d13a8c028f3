# SPDX-License-Identifier: MIT
"""Writes the results of script/fuzz and script/soak into docs/robustness.md.

`python script/robustness_page.py` takes the tables that the last runs have left in build/fuzz and
build/soak. A table without a run stays as it was.
"""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "robustness.md"
RESULTS = {
    "fuzz": ROOT / "build" / "fuzz" / "results.md",
    "soak": ROOT / "build" / "soak" / "results.md",
}


def with_block(page: str, name: str, block: str) -> str:
    """Returns the page with another text between the two comments of a block."""
    begin, end = f"<!-- {name}: written by script/robustness_page.py -->", f"<!-- end of {name} -->"
    pattern = re.compile(f"{re.escape(begin)}.*?{re.escape(end)}", re.DOTALL)
    if not pattern.search(page):
        raise ValueError(f"{PAGE}: has no block '{name}'; expected the lines {begin} and {end}")
    return pattern.sub(lambda _: f"{begin}\n{block.strip()}\n{end}", page)


def main() -> None:
    """Writes both blocks."""
    page = PAGE.read_text(encoding="utf-8")
    for name, path in RESULTS.items():
        if path.is_file():
            page = with_block(page, name, path.read_text(encoding="utf-8"))
            print(f"{PAGE.relative_to(ROOT)}: {name}, from {path.relative_to(ROOT)}")
        else:
            print(f"{PAGE.relative_to(ROOT)}: {name} stays; run script/{name} first")
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()

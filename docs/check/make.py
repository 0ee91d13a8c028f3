# SPDX-License-Identifier: MIT
"""Makes the results of docs/check.md: python docs/check/make.py [FOLDER]

Runs `ehsid gap-check` twice, on blind cases and on cases whose own effect is left out of the
catalogue, and keeps the page of each with its pictures. This takes an hour on two cores. With a
FOLDER, a run that was stopped continues, and finished runs are scored again.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
# Name in the documents, and what is asked of the command.
RUNS = {
    "blind": ("--count", "168", "--seed", "1"),
    "left_out": ("--count", "34", "--seed", "3", "--exclude-truth"),
}


def keep(made: Path, kept: Path) -> None:
    """The page as Markdown and its pictures."""
    shutil.rmtree(kept, ignore_errors=True)
    kept.mkdir(parents=True)
    shutil.copyfile(made / "check.md", kept / "README.md")
    for picture in sorted(made.glob("*.png")):
        shutil.copyfile(picture, kept / picture.name)


def main() -> None:
    """Both runs."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(temporary)
        for name, asked in RUNS.items():
            command = "from ehsid.harness.cli import main; main()"
            out = str(folder / name)
            subprocess.run(
                [sys.executable, "-c", command, "gap-check", "--out", out, *asked], check=True
            )
            keep(folder / name, HERE / name)


if __name__ == "__main__":
    main()

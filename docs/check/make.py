# SPDX-License-Identifier: MIT
"""Makes the results of docs/check.md: python docs/check/make.py [FOLDER]

Runs `ehsid gap-check` for each of CHECKS and scores their cases together; the page with its
pictures is kept. This takes an hour on two cores. With a FOLDER, in which each seed has a folder, a
run that was stopped continues, and finished runs are scored again.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from ehsid.lab.pages.check_page import write_page
from ehsid.lab.scoring.score import score_cases, score_folder

HERE = Path(__file__).parent
# Number of cases and their grades, by seed.
CHECKS = {
    74002: (48, ("plain", "hard", "confusable", "wide")),
    74003: (32, ("slow", "linkage")),
    74005: (60, ("slow", "linkage", "abroad")),
    74006: (24, ("field", "wide", "hard")),
}


def run(folder: Path, seed: int, count: int, grades: tuple[str, ...]) -> Path:
    """One check; returns its folder."""
    out = folder / f"{seed}"
    asked = ["--out", str(out), "--count", str(count), "--seed", str(seed)]
    asked += [word for grade in grades for word in ("--grade", grade)]
    subprocess.run([sys.executable, "-m", "ehsid", "gap-check", *asked], check=True)
    return out


def main() -> None:
    """All checks, and their page."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(temporary)
        folders = [run(folder, seed, *asked) for seed, asked in CHECKS.items()]
        made = Path(temporary) / "all"
        made.mkdir()
        write_page(score_cases([c for out in folders for c in score_folder(out).cases]), made)
        kept = HERE / "blind"
        shutil.rmtree(kept, ignore_errors=True)
        kept.mkdir()
        shutil.copyfile(made / "check.md", kept / "README.md")
        for picture in sorted(made.glob("*.png")):
            shutil.copyfile(picture, kept / picture.name)


if __name__ == "__main__":
    main()

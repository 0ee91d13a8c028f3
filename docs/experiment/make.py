# SPDX-License-Identifier: MIT
"""Makes the pictures of docs/experiment.md: python docs/experiment/make.py

Runs `ehsid experiment` as it is and keeps some of its figures.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent

# Name in the documents, and how the file that the command writes ends.
KEPT = {
    "frequency_response.png": "offline_frequency_response",
    "vague_start.png": "recursive_on_model_16_as_the_known_truth",
    "rig_change.png": "a_change_of_the_rig_without_and_with_the_reset",
    "reading.png": "physical_reading",
    "claims.png": "summary",
    "start.png": "the_start_of_lambda_1",
    "reset.png": "where_the_reset_helps",
}


def main() -> None:
    """Run the experiment and copy the first figure of each section that is kept."""
    with tempfile.TemporaryDirectory() as folder:
        command = "from ehsid.harness.cli import main; main()"
        subprocess.run([sys.executable, "-c", command, "experiment", "--out", folder], check=True)
        figures = sorted(Path(folder, "figures").glob("*.png"))
        for name, ending in KEPT.items():
            first = next(path for path in figures if path.stem[3:] == ending)
            shutil.copyfile(first, HERE / name)


if __name__ == "__main__":
    main()

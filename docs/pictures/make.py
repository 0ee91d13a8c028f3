# SPDX-License-Identifier: MIT
"""Makes the pictures of the documents: python docs/pictures/make.py."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "examples"))

from known_model import changed_runs, drawn_change  # noqa: E402  the folder is known only now

drawn_change(changed_runs(100)).savefig(HERE / "plant_change.png", dpi=100)

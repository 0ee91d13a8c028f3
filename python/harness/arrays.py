# SPDX-License-Identifier: MIT
"""Types of the arrays that go between modules; shapes stand in the docstrings of functions."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
"""Of doubles."""

# SPDX-License-Identifier: MIT
"""Pages of the blind checks and of the calibration."""

# SPDX-License-Identifier: MIT
"""Calibration of the probabilities on finished checks: fit of their constants, and checks of it."""

# SPDX-License-Identifier: MIT
"""Exports estimator configurations to a target and runs hardware-in-the-loop tests with it."""

# SPDX-License-Identifier: MIT
"""Test signals, forward runs of the simulator, and effects put into logs."""

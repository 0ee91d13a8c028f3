# SPDX-License-Identifier: MIT
"""Test signals for identification."""

from ehsid.harness.excitation.multisine import multisine

__all__ = ["multisine"]

# SPDX-License-Identifier: MIT
"""Blind checks: makes, seals and runs them."""

# SPDX-License-Identifier: MIT
"""Blind checks: sealed cases whose effect is withheld, and their diagnosis."""

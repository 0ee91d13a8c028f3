# SPDX-License-Identifier: MIT
"""Blind checks: cases whose effect is withheld, made under a seal and diagnosed."""

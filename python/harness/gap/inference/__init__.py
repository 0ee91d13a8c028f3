# SPDX-License-Identifier: MIT
"""Findings from fits: candidates, evidence for each, place and size of the gap, verdict."""

# SPDX-License-Identifier: MIT
"""Inference from fits: candidates, likelihood gains, place and size of the gap, verdict."""

# SPDX-License-Identifier: MIT
"""Fleets: each of many machines is diagnosed, then the machines are ranked."""

# SPDX-License-Identifier: MIT
"""Hunts a cause: diagnosis, the next experiment on a machine within limits, diagnosis again."""

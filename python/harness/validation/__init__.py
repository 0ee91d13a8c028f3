# SPDX-License-Identifier: MIT
"""Validation of the diagnosis by blind checks and their score, and diagnosis of fleets."""

# SPDX-License-Identifier: MIT
"""How far the diagnosis can be trusted: blind checks, their score, fleets."""

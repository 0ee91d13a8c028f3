# SPDX-License-Identifier: MIT
"""Blind checks of the diagnosis: made, sealed, run and scored on data whose effect is withheld."""

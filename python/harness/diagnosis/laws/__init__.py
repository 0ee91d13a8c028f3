# SPDX-License-Identifier: MIT
"""Laws that the catalogue does not have: which equation lacks a term, over which variable."""

# SPDX-License-Identifier: MIT
"""Score of a blind check: it compares the diagnosis of each case with the truth."""

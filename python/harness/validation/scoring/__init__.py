# SPDX-License-Identifier: MIT
"""The score of a blind check: what was said of each case against what is true."""

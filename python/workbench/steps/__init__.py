# SPDX-License-Identifier: MIT
"""The steps of the workbench, one in each file."""

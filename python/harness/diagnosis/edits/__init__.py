# SPDX-License-Identifier: MIT
"""Whether a change of the machine was what a diagnosis named: the edit test."""

from .testing import EditRun, EditTest, edit_test
from .twin import Twin, parse_edits, read_twin

__all__ = ["EditRun", "EditTest", "Twin", "edit_test", "parse_edits", "read_twin"]

# SPDX-License-Identifier: MIT
"""Says what of a rig fits a record and what does not, before anything is fitted.

Each check compares one value of the rig with what the record shows of it: `check_rig`.
"""

from .checking import check_rig
from .finding import Finding, RecordCheck, RigCheckFile, Status, rig_check_file

__all__ = ["Finding", "RecordCheck", "RigCheckFile", "Status", "check_rig", "rig_check_file"]

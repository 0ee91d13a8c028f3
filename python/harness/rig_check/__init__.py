# SPDX-License-Identifier: MIT
"""Says what of a rig fits a record and what does not, before anything is fitted.

Each check compares one value of the rig with what the record shows of it: `check_rig`.
"""

from ehsid.harness.rig_check.checking import check_rig
from ehsid.harness.rig_check.finding import Finding, RecordCheck, Status

__all__ = ["Finding", "RecordCheck", "Status", "check_rig"]

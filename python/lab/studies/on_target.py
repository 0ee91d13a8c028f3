# SPDX-License-Identifier: MIT
"""The recursive part of the experiment, as a loop that `ehsid hil` finds by its entry point."""

from __future__ import annotations

from ehsid.hil.offered_loop import OfferedLoop

from .pages.recursive_sections import published_table
from .published import SOURCE
from .target_plans import experiment_plans

LOOP = OfferedLoop(experiment_plans, published_table(), (SOURCE,))

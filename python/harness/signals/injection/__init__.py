# SPDX-License-Identifier: MIT
"""Injects known effects into logs of real machines without a change of the machine's motion.

>>> injected = inject(record, rig, {"valve_dead_band": {"overlap": 0.04}})
>>> injected.answer.effects
{'valve_dead_band': {'overlap': 0.04}}
"""

from .effects import InjectError, injectable
from .inject import answer_path, inject, write_injected
from .lag import Answer

__all__ = [
    "Answer",
    "InjectError",
    "answer_path",
    "inject",
    "injectable",
    "write_injected",
]

# SPDX-License-Identifier: MIT
"""Injects known effects into logs of real machines without a change of the machine's motion.

>>> injected = inject(record, rig, {"valve_dead_band": {"overlap": 0.04}})
>>> injected.answer.effects
{'valve_dead_band': {'overlap': 0.04}}
"""

from .answer import Answer
from .effects import InjectError, injectable
from .inject import Injected, inject
from .writing import answer_path, write_injected

__all__ = [
    "Answer",
    "InjectError",
    "Injected",
    "answer_path",
    "inject",
    "injectable",
    "write_injected",
]

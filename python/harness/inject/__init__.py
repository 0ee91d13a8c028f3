# SPDX-License-Identifier: MIT
"""Known effects put into logs of real machines, without touching what the machine did.

>>> injected = inject(record, rig, {"valve_dead_band": {"overlap": 0.04}})
>>> injected.answer.effects
{'valve_dead_band': {'overlap': 0.04}}
"""

from ehsid.harness.inject.answer import Answer
from ehsid.harness.inject.effects import InjectError, injectable
from ehsid.harness.inject.inject import Injected, inject
from ehsid.harness.inject.writing import answer_path, write_injected

__all__ = [
    "Answer",
    "InjectError",
    "Injected",
    "answer_path",
    "inject",
    "injectable",
    "write_injected",
]

# SPDX-License-Identifier: MIT
"""What a controller takes of a diagnosis or an estimate: valve tables, friction, loop gains."""

from .design import SOURCES, Commissioning, Design, design
from .writing import FILES, write_commissioning

__all__ = [
    "FILES",
    "SOURCES",
    "Commissioning",
    "Design",
    "design",
    "write_commissioning",
]

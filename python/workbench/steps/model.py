# SPDX-License-Identifier: MIT
"""Model: a linear model of a record, and the estimator of the firmware on it."""

from __future__ import annotations

from typing import Any

from .identification import Identification
from .recursive import Recursive
from .step import StepView


class ModelStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._parts = (Identification(page), Recursive(page))
        self.layout.objects = [part.layout for part in self._parts]

    def refresh(self) -> None:
        """Shows what has changed in both parts."""
        for part in self._parts:
            part.refresh()

# SPDX-License-Identifier: MIT
from __future__ import annotations
from abc import ABC, abstractmethod
from collections.abc import Sequence
from html import escape
from ehsid.harness.report.text_table import TextTable
from ehsid.harness.text import printable

class Shown(ABC):

    def summary(self) -> str:
        ...

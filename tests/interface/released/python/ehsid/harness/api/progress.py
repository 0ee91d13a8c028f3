# SPDX-License-Identifier: MIT
from __future__ import annotations
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ehsid.harness.api.wording import LOGGER
from ehsid.harness.text import printable
from ehsid.harness.time_to_go import TimeToGo, in_words
LINE_EVERY_S = 10.0

@contextmanager
def progress_of(what: str) -> Iterator[Callable[[float], None]]:
    ...

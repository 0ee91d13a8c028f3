# SPDX-License-Identifier: MIT
from __future__ import annotations
import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager
from ehsid.harness.records import Record
LOGGER = logging.getLogger('ehsid')
_ARGUMENTS = {'dt': 'dt_s', 'duration': 'duration_s', 'exclude-effect': 'exclude', 'map': 'maps', 'position0': 'position0_m'}
_MAP = re.compile("--map '([^'=]+)=([^']*)'")
_VALUE = re.compile('(?<![\\w-])--([a-z][a-z0-9-]*) (-?\\d[\\d.]*(?:e[+-]?\\d+)?)(?![\\w])')
_OPTION = re.compile('(?<![\\w-])--([a-z][a-z0-9-]*)')

def in_python_words(text: str) -> str:
    ...

@contextmanager
def in_python() -> Iterator[None]:
    ...

def log_reading(record: Record) -> None:
    ...

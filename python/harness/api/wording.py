# SPDX-License-Identifier: MIT
"""Messages of the harness in the words of Python.

The harness names the options of the commands, such as --dt; a function has arguments, such as dt_s.
"""

from __future__ import annotations

import logging
import re
from collections.abc import Iterator
from contextlib import contextmanager

from ..records import Record

LOGGER = logging.getLogger("ehsid")

# Options whose arguments have another name.
_ARGUMENTS = {
    "dt": "dt_s",
    "duration": "duration_s",
    "exclude-effect": "exclude",
    "map": "maps",
    "position0": "position0_m",
}
_MAP = re.compile(r"--map '([^'=]+)=([^']*)'")
_RANGE = re.compile(r"--([a-z][a-z-]*) (\d+-\d+)")
_VALUE = re.compile(r"(?<![\w-])--([a-z][a-z0-9-]*) (-?\d[\d.]*(?:e[+-]?\d+)?)(?![\w])")
_OPTION = re.compile(r"(?<![\w-])--([a-z][a-z0-9-]*)")


def in_python_words(text: str) -> str:
    """Returns a message with arguments in place of options."""
    text = _RANGE.sub(lambda found: f"{_argument(found[1])}='{found[2]}'", text)
    text = _MAP.sub(r"maps={'\1': '\2'}", text)
    text = _VALUE.sub(lambda found: f"{_argument(found[1])}={found[2]}", text)
    return _OPTION.sub(lambda found: _argument(found[1]), text)


def _argument(option: str) -> str:
    return _ARGUMENTS.get(option, option.replace("-", "_"))


@contextmanager
def in_python() -> Iterator[None]:
    """Puts the messages of a ValueError of the block into the words of Python."""
    try:
        yield
    except ValueError as error:
        error.args = tuple(
            in_python_words(one) if isinstance(one, str) else one for one in error.args
        )
        raise


def log_reading(record: Record) -> None:
    """Logs how a record was read: its columns as information, remarks as warnings."""
    if record.origin is None:
        return
    LOGGER.info("%s: read as %s", record.name, record.origin.kind)
    for column, channel, unit, factor, why in record.origin.rows():
        taken = "%s: '%s' taken for %s in %s, factor %s: %s"
        LOGGER.info(taken, record.name, column, channel, unit, factor, why)
    for remark in record.origin.remarks:
        LOGGER.warning("%s: %s", record.name, in_python_words(remark))

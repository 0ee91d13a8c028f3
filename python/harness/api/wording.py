# SPDX-License-Identifier: MIT
"""Messages of the harness in the words of Python.

The harness names the options of the commands, such as --dt; a function has arguments, such as dt_s.

Shows the progress of long work: a bar on a terminal, elsewhere lines of the logger `ehsid`.
"""

from __future__ import annotations

import logging
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..base.error_words import printable
from ..base.time_to_go import TimeToGo, in_words
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


LINE_EVERY_S = 10.0


@contextmanager
def progress_of(what: str) -> Iterator[Callable[[float], None]]:
    """Yields a function that takes the share of the work that is done, 0 to 1."""
    what = printable(what)
    with _bar(what) if sys.stderr is not None and sys.stderr.isatty() else _lines(what) as report:
        yield report


@contextmanager
def _bar(what: str) -> Iterator[Callable[[float], None]]:
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

    to_go = TimeToGo()
    columns = (
        TextColumn("{task.description}"),
        BarColumn(bar_width=20),
        TaskProgressColumn(),
        TextColumn("{task.fields[left]}"),
    )
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(escape(what), total=1.0, left="")

        def report(share: float) -> None:
            to_go.update(share)
            left = to_go.left_s
            words = "" if left is None else f"about {in_words(left)} to go"
            bar.update(task, completed=share, left=words)

        yield report


@contextmanager
def _lines(what: str) -> Iterator[Callable[[float], None]]:
    to_go, last = TimeToGo(), 0.0

    def report(share: float) -> None:
        nonlocal last
        to_go.update(share)
        left = to_go.left_s
        if to_go.seconds - last >= LINE_EVERY_S and left is not None:
            last = to_go.seconds
            LOGGER.info("%s: %.0f %%, about %s to go", what, 100.0 * share, in_words(left))

    LOGGER.info("%s: begins", what)
    yield report
    LOGGER.info("%s: done after %.1f s", what, to_go.seconds)

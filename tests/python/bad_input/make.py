# SPDX-License-Identifier: MIT
"""Makes README.md of the bad inputs of the tests: python tests/python/bad_input/make.py"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from types import ModuleType

from ehsid.harness.base.error_words import printable
from ehsid.harness.base.files import write_text

HERE = Path(__file__).parent
sys.path.append(str(HERE.parent))
from bad_input.case import Case, Outcome  # noqa: E402
from bad_input.catalogue import GROUPS  # noqa: E402

DOCUMENT = HERE / "README.md"
LONGEST = 400
# The lines are those of the document.
INTRODUCTION = """\
# Bad input and the message that it gets

This page shows what the program does with bad input, and which message you get. The tables have
{count} bad inputs. Each of them is a test (`tests/python/test_bad_input.py`), and
`make.py` beside it makes this page from them.

For a command, bad input of any kind ends in **one message on stderr and exit code 2**:

- There is no traceback, whatever the input is.
- The message says what is wrong and where (the file, with its row and column, key or option), what
  was expected, and how to mend it.
- Nothing has been written, replaced or deleted. Where a message names a report that explains the
  problem, that report is the only new file.
- The time and the memory are bounded: files are read up to
  [limits that can be set](../../../docs/records.md#limits).

In Python the same message is the text of an exception: `ValueError` or a class derived from it, or
`TypeError` where a value has the wrong type. In C the answer is a status. The firmware drops a
damaged frame, and refuses a request that it cannot carry out.

In the tables, files have names such as `record.csv` and `rig.toml` and are in the current folder.
Long messages are cut. `...` in a message stands for the words of a library, which depend on its
version.
"""


def cell(text: str) -> str:
    """Returns a text for a cell of a table, as it is shown."""
    text = printable(text)
    if len(text) > LONGEST:
        text = text[: LONGEST - 4].rstrip() + " ..."
    lines = [" ".join(line.split()) for line in text.splitlines()]
    return "<br>".join(re.sub(r"([\\`*_{}\[\]<>|#~$&])", r"\\\1", line) for line in lines)


def code(text: str) -> str:
    """Returns a command or call for a cell of a table."""
    text = printable(text)
    if len(text) > 160:
        text = text[:156] + " ..."
    text = text.replace("|", "\\|")
    return f"`` {text} ``" if "`" in text else f"`{text}`"


def row(case: Case, outcome: Outcome) -> str:
    """Returns the row of a case."""
    message = outcome.message
    if case.library is not None:
        message = re.sub(case.library, "...", message)
    # The meaning of a status of C begins with its name, which is code already.
    shown = message if message.startswith("`EHSID_") else cell(message)
    if not outcome.kind.startswith(("exit code", "status", "answer")):
        shown = f"`{outcome.kind}`: {shown}"
    return f"| {cell(case.wrong)} | {code(case.call)} | {shown} |"


def made_row(case: Case) -> str:
    """Gives the bad input to ehsid in a new folder; returns its row."""
    with tempfile.TemporaryDirectory() as folder:
        case.make(Path(folder))
        return row(case, case.outcome(Path(folder)))


def section(group: ModuleType, rows: Iterable[str]) -> str:
    """Returns a group as a section with a table."""
    head = "| what is wrong | command or call | message |\n|---|---|---|"
    return "\n".join([f"## {group.TITLE}", "", group.ABOUT, "", head, *rows]) + "\n"


def document(rows: Callable[[Case], str]) -> str:
    """Returns the whole document; `rows` gives the row of each case."""
    count = sum(len(group.CASES) for group in GROUPS)
    sections = [section(group, map(rows, group.CASES)) for group in GROUPS]
    return "\n".join([INTRODUCTION.format(count=count), *sections])


if __name__ == "__main__":
    write_text(DOCUMENT, document(made_row))
    print(DOCUMENT)

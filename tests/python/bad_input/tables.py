# SPDX-License-Identifier: MIT
"""Bad input of compiled programs, from the tables that their tests print and compare."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from bad_input.case import Case, Outcome


def cases_of(table: Path, outcome: Callable[[str], Outcome]) -> tuple[Case, ...]:
    """A case for each line: what is wrong, the call, and the answer; tabs in between."""
    made = []
    for line in table.read_text(encoding="utf-8").splitlines():
        wrong, call, answer = line.split("\t")
        got = outcome(answer)
        made.append(Case(wrong, call, lambda got=got: got, got.kind, {}))
    return tuple(made)

# SPDX-License-Identifier: MIT
"""The way of a lesson: its records are read and checked, a guess is made, the diagnosis runs."""

from __future__ import annotations

from enum import StrEnum

from .flow import standings
from .lesson import lesson_of
from .session import Session
from .workbench import Workbench


class Stage(StrEnum):
    """Where a lesson is."""

    preparing = "preparing"
    guess = "guess"
    diagnosing = "diagnosing"
    stopped = "stopped"
    found = "found"
    broken = "broken"


def lessons(workbench: Workbench) -> list[str]:
    """Returns the names of the sessions that are lessons, the one that was changed last first."""
    return [
        name for name in workbench.names() if (workbench.folder / name / "lesson.json").is_file()
    ]


def advance(workbench: Workbench, session: Session) -> Stage:
    """Starts what comes next in a lesson, with the same work as the steps; returns its stage.

    `stopped` is a diagnosis that was cancelled or lost, `broken` a session whose records or rig
    someone has changed so that they cannot be checked.
    """
    lesson = lesson_of(session)
    if lesson is None:
        return Stage.broken
    if not session.settings.records:
        for path in sorted((session.folder / "logs").glob("*.csv")):
            workbench.read(session, session.add(path))
    if workbench.is_reading(session):
        return Stage.preparing
    found = standings(session)
    if not found["check"].open:
        return Stage.broken
    if found["gap"].done:
        return Stage.found if lesson.guess else Stage.guess
    check, gap = workbench.job(session, "check"), workbench.job(session, "gap")
    if not found["check"].done:
        if check is None:
            workbench.check(session)
        elif not check.running:
            return Stage.broken
        return Stage.preparing
    if gap is not None and gap.running:
        return Stage.diagnosing
    if not lesson.guess:
        return Stage.guess
    if gap is None:
        workbench.diagnose(session)
        return Stage.diagnosing
    return Stage.stopped

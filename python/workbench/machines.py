# SPDX-License-Identifier: MIT
"""All machines of a folder side by side, each with what its diagnosis found."""

from __future__ import annotations

from dataclasses import dataclass

from ehsid.harness.diagnosis.schema import DiagnosisFile, read_diagnosis_file
from ehsid.harness.fleet import machine_of
from ehsid.harness.show.fleet_page import verdict_text
from ehsid.harness.show.gap_words import first_upper

from .flow import STEPS, next_step, step_states
from .session import SessionError
from .workbench import Workbench


@dataclass(frozen=True)
class MachineRow:
    """A machine in the table."""

    name: str
    """Of its session."""
    records: int | None
    """Number of its records; None where the session cannot be opened."""
    verdict: str
    """What the diagnosis found, or what the machine waits for, in words."""
    holds: bool = False
    """Whether the verdict belongs to the records and the rig of today."""
    before: float | None = None
    after: float | None = None
    """Gap with the rig as configured, and with what was found, nrmse; None without a diagnosis."""
    where: str = ""
    share: float | None = None
    """Part of the machine with the largest share of the gap, and this share; "" and None where none
    is told."""
    made: float | None = None
    """When the diagnosis was made, in seconds since 1970; None without one."""


def machine_rows(workbench: Workbench) -> list[MachineRow]:
    """Returns all machines, the one that was changed last first."""
    return [_row(workbench, name) for name in workbench.names()]


def _row(workbench: Workbench, name: str) -> MachineRow:
    try:
        session = workbench.opened(name)
    except SessionError as error:
        return MachineRow(name, None, str(error))
    records = len(session.settings.records)
    path = session.folder / "gap" / "diagnosis.json"
    job = workbench.job(session, "gap")
    if job is not None and job.running:
        return MachineRow(name, records, "The diagnosis is under way")
    try:
        found = read_diagnosis_file(path)
        made = path.stat().st_mtime
    except (OSError, ValueError):
        key = next_step(session)
        title = next(step.title for step in STEPS if step.key == key)
        return MachineRow(name, records, f"Not diagnosed yet; it stands at {title}")
    where, share = _largest_part(found)
    return MachineRow(
        name,
        records,
        first_upper(verdict_text(machine_of(name, found))),
        step_states(session)["gap"].done,
        found.how_far.nominal,
        found.how_far.augmented,
        where,
        share,
        made,
    )


def _largest_part(found: DiagnosisFile) -> tuple[str, float | None]:
    parts = found.where.subsystem
    if not parts:
        return "", None
    name = max(parts, key=lambda part: parts[part])
    return (name, parts[name]) if parts[name] > 0.0 else ("", None)

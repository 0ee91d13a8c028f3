# SPDX-License-Identifier: MIT
"""Takes over the rig that a diagnosis found: as the rig of the machine, or of a new one."""

from __future__ import annotations

import shutil

from ehsid.harness.base.files import replacing, write_text
from ehsid.harness.rigs import read_rig

from .session import RIG, Session, SessionError, free_name
from .workbench import Workbench

FOUND = "gap/rig.augmented.toml"
BEFORE = "rig.before.toml"


def use_as_rig(session: Session) -> str:
    """Makes the found rig that of the machine, and keeps the rig before; returns its file name.

    The results then no longer belong to the rig, and have to be made again.

    Raises
    ------
    SessionError
        the diagnosis has left no rig.
    """
    return replace_rig(session, _found(session))


def replace_rig(session: Session, text: str) -> str:
    """Gives the machine another rig; returns the name under which the one before stays, or ""."""
    kept = ""
    if session.rig_file.exists():
        kept = free_name(BEFORE, {path.name for path in session.folder.iterdir()})
        with replacing(session.folder / kept) as unfinished:
            shutil.copyfile(session.rig_file, unfinished)
    write_text(session.rig_file, text)
    session.settings.rig.answers.clear()  # the form no longer makes this rig
    session.save()
    return kept


def as_new_machine(workbench: Workbench, session: Session) -> Session:
    """Begins a machine that has the found rig and no records yet.

    Raises
    ------
    SessionError
        the diagnosis has left no rig.
    """
    text = _found(session)
    made = workbench.begun(f"{session.name}_found")
    write_text(made.folder / RIG, text)
    made.save()
    return made


def _found(session: Session) -> str:
    path = session.folder / FOUND
    if not path.is_file():
        raise SessionError(f"{path}: the diagnosis has left no rig file; run the diagnosis again")
    read_rig(path)  # raises RigError for a file that someone has damaged
    return path.read_text(encoding="utf-8")

# SPDX-License-Identifier: MIT
"""Takes rig files into a session, with the user's simulator that they name.

A browser gives the content of a file and never its folder, so that a path relative to a rig file
that was dropped leads nowhere. The simulator is then dropped, too, or the rig file is named by its
path.
"""

from __future__ import annotations

import os
from pathlib import Path

from ehsid.harness.base.files import write_text
from ehsid.harness.rigs import parse_rig
from ehsid.harness.rigs.checks import read_text

from .adoption import replace_rig
from .rig_program import file_of, stated_program, with_program
from .session import Session, SessionError, free_name, safe_name

# Simulators that were dropped, and the rig file that waits for one.
FOLDER = "simulator"
WAITING = "waiting.toml"
ENDINGS = (".fmu", ".py")


def take_rig_text(session: Session, text: str, given: str) -> str:
    """Makes the text of a dropped rig file the rig of the machine; returns what was done.

    Raises
    ------
    RigError
        the rig cannot be used.
    SessionError
        its simulator is not there; the text waits for it.
    """
    _, program = stated_program(text)
    if not program or file_of(program).is_absolute():
        return _taken(session, text, given)
    name = safe_name(file_of(program).name)
    if not (session.folder / FOLDER / name).is_file():
        (session.folder / FOLDER).mkdir(exist_ok=True)
        write_text(session.folder / FOLDER / WAITING, text)
        raise SessionError(
            f"{given}: its simulator {name} is named relative to the rig file, and a browser does "
            f"not tell where that is: drop {name} here, too, or give the path of the rig file on "
            "this machine in the step Rig"
        )
    return _taken(session, with_program(text, f"{FOLDER}/{name}"), given)


def take_rig_at(session: Session, path: Path) -> str:
    """Makes a rig file on this machine the rig of the machine; its simulator stays where it is.

    Raises
    ------
    RigError
        the rig cannot be read or used.
    """
    path = path.expanduser().absolute()
    text = read_text(path)
    _, program = stated_program(text)
    if program and not file_of(program).is_absolute():
        text = with_program(text, os.path.normpath(path.parent / file_of(program)))
    return _taken(session, text, path.name)


def take_program(session: Session, part: Path, given: str) -> str:
    """Keeps a dropped simulator; a rig file that waits for it becomes the rig."""
    folder = session.folder / FOLDER
    folder.mkdir(exist_ok=True)
    target = folder / given
    waiting = folder / WAITING
    for_rig = waiting.is_file() and _waited_for(read_text(waiting)) == given
    if target.exists() and not for_rig:
        target.replace(folder / free_name(given, {path.name for path in folder.iterdir()}))
    part.replace(target)
    if not for_rig:
        session.changed()
        return f"{given} is kept as a simulator; drop the rig file that names it, too."
    said = take_rig_text(session, read_text(waiting), "the rig file that waited for it")
    waiting.unlink()
    return f"{given} is kept as the simulator: {said}"


def _taken(session: Session, text: str, given: str) -> str:
    rig = parse_rig(text, source=given, folder=session.folder)
    kept = replace_rig(session, text)
    before = f"; the rig before is kept as {kept}" if kept else ""
    return f"{given} is the rig of this machine now ({rig.name}){before}."


def _waited_for(text: str) -> str:
    _, program = stated_program(text)
    return safe_name(file_of(program).name)

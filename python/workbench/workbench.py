# SPDX-License-Identifier: MIT
"""The workbench: the sessions in a folder and the jobs at work for them, without any page."""

from __future__ import annotations

import os
import re
import shutil
import sys
import tempfile
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from .jobs import Job, State, Task, check_task, gap_task, read_task
from .lesson import lesson_task
from .model_tasks import adopt_found, estimate_task, identify_task
from .next_tasks import PACKAGE, header_task, package_task
from .session import SETTINGS, Entry, Session, SessionError, free_name, safe_name

if sys.platform != "win32":
    import fcntl

FIRST = "machine"
ERRORS = "errors.log"
REMOVED = "removed"  # below the folder of the sessions: those that were removed
# Runs of the page Live, and histories of machines; no session can have these names.
LIVE, HISTORIES = "_live", "_histories"
PART = re.compile(r"\..*[0-9a-f]{8}\.part")  # a file that is being written, see `replacing`


class Workbench:
    """The sessions below a folder, each opened once, and their jobs.

    Pages come and go; sessions and jobs stay until the workbench is closed.
    """

    def __init__(self, folder: Path) -> None:
        """Opens the folder, which is made if it is missing.

        Raises
        ------
        SessionError
            it cannot be made, or not be written to.
        """
        self.folder = folder.resolve()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=self.folder):  # whether it can be written to
                pass
        except OSError as error:
            raise SessionError(
                f"{folder}: cannot be used as the folder of the workbench ({error.strerror}): "
                "expected a folder that can be written to; name another one"
            ) from None
        self._sessions: dict[str, Session] = {}
        self._jobs: dict[tuple[str, str], Job] = {}
        self._unread: list[tuple[Session, Entry]] = []
        self._read_now: tuple[str, str, str] | None = None  # session, record, and what was told
        self._lock = threading.RLock()
        self._closed = False
        self._at_work = self._cleared()

    def _cleared(self) -> int | None:
        """Removes what a workbench that was killed has left half-written.

        Returns a lock on the folder, which ends with this process. While another workbench has it,
        its files are left to it. Windows refuses to remove a file that is open.
        """
        lock = None
        if sys.platform != "win32":
            lock = os.open(self.folder, os.O_RDONLY)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:  # another one has it, or the file system has no locks
                return lock
        for name in (*self.names(), LIVE, HISTORIES):
            for path in (self.folder / name).rglob("*.part"):
                if PART.fullmatch(path.name):
                    with suppress(OSError):
                        path.unlink()
        return lock

    def names(self) -> list[str]:
        """Returns the names of the sessions, the one that was changed last in front."""
        files = [
            path
            for path in self.folder.glob(f"*/{SETTINGS}")
            if safe_name(path.parent.name) == path.parent.name
        ]
        return [path.parent.name for path in sorted(files, key=_changed_at, reverse=True)]

    def opened(self, name: str) -> Session:
        """Returns the session of a name; it is begun if there is none.

        Raises
        ------
        SessionError
            its folder cannot be used.
        """
        with self._lock:
            name = safe_name(name)
            if name in self._sessions and not self._sessions[name].is_current:
                self._forget(name)
            if name not in self._sessions:
                session = Session(self.folder / name)
                if not (session.folder / SETTINGS).exists():
                    session.save()
                self._sessions[name] = session
            return self._sessions[name]

    def _forget(self, name: str) -> None:
        """Ends the work for a session that someone has removed, edited or exchanged."""
        session = self._sessions.pop(name)
        self._unread = [one for one in self._unread if one[0] is not session]
        for key, job in list(self._jobs.items()):
            if key[0] == name:
                del self._jobs[key]
                if job.running:
                    job.cancel()
        if self._read_now is not None and self._read_now[0] == name:
            self._read_now = None
        self._read_next()

    def latest(self) -> Session:
        """Returns the session that was changed last, or a new one."""
        names = self.names()
        return self.opened(names[0]) if names else self.opened(FIRST)

    def begun(self, name: str) -> Session:
        """Returns a new session of this name; a number is added where it is taken."""
        return self.opened(free_name(safe_name(name or FIRST), {*self.names(), REMOVED}))

    def job(self, session: Session, key: str) -> Job | None:
        """Returns the job of a session and a step that runs, or ran last."""
        return self._jobs.get((session.name, key))

    def cancel(self, session: Session, key: str) -> None:
        """Ends a job that runs."""
        job = self.job(session, key)
        if job is not None and job.running:
            job.cancel()

    def read(self, session: Session, entry: Entry) -> None:
        """Reads a log as soon as no other one is being read."""
        with self._lock:
            waits = any(one is session and other.id == entry.id for one, other in self._unread)
            if not waits and self._read_now != (session.name, entry.id, entry.told()):
                self._unread.append((session, entry))
            self._read_next()

    def is_reading(self, session: Session) -> bool:
        """Whether logs of the session are being read, or wait for it."""
        with self._lock:  # between two logs none waits and none is read, for a moment
            job = self.job(session, "read")
            waiting = any(one is session for one, _ in self._unread)
            return waiting or (job is not None and job.running)

    def _read_next(self) -> None:
        with self._lock:
            if self._closed or not self._unread:
                return
            if any(job.running for (_, key), job in self._jobs.items() if key == "read"):
                return
            while self._unread:
                session, entry = self._unread.pop(0)
                if self._sessions.get(session.name) is session:  # it was not removed meanwhile
                    self._read_now = (session.name, entry.id, entry.told())
                    self._start(session, "read", f"reading {entry.id}", read_task, entry.id)
                    return

    def check(self, session: Session) -> None:
        """Starts the check of rig and records."""
        self._start(session, "check", "checking the rig against the records", check_task)

    def diagnose(self, session: Session) -> None:
        """Starts the diagnosis."""
        self._start(session, "gap", f"diagnosing {session.name}", gap_task)

    def identify(self, session: Session) -> None:
        """Starts the identification of a model."""
        self._start(session, "identify", "identifying a model", identify_task)

    def estimate(self, session: Session) -> None:
        """Starts the recursive estimation; one that is at work is ended, as its choices are old."""
        self.cancel(session, "estimate")
        self._start(session, "estimate", "running the estimator", estimate_task)

    def make_header(self, session: Session) -> None:
        """Starts to make the firmware header."""
        self._start(session, "header", "making the header", header_task)

    def pack(self, session: Session) -> None:
        """Starts to pack the session into one archive."""
        self._start(session, "package", f"packing {session.name}", package_task)

    def hide(self, session: Session) -> None:
        """Starts to make a lesson of a session that has a rig and no records."""
        self._start(session, "lesson", "hiding an effect", lesson_task)

    def _start(self, session: Session, key: str, what: str, task: Task, *args: Any) -> None:
        with self._lock:
            if self._sessions.get(session.name) is not session:  # it was removed meanwhile
                return
            running = self.job(session, key)
            if self._closed or (running is not None and running.running):
                return
            made_of = session.made_from(key)
            log = session.folder / ERRORS
            after = self._after(session, key, made_of)
            self._jobs[session.name, key] = Job(
                what, task, session.folder, *args, log=log, changed=after
            )
        session.changed()

    def _after(self, session: Session, key: str, made_of: str) -> Callable[[], None]:
        """Returns what is done after a change of a job."""

        def changed() -> None:
            job = self.job(session, key)
            if job is None or job.running:
                session.changed()
                return
            if job.state is State.done and key != "read":
                session.settings.made_of[key] = made_of
                if key == "identify":
                    adopt_found(session)
                session.save()
            else:
                session.changed()
            if key == "read":
                self._read_now = None
                self._read_next()

        return changed

    def rename(self, name: str, new_name: str) -> str:
        """Gives a session another name, made plain; returns it.

        Raises
        ------
        SessionError
            there is no such session, it is at work, or the name is taken.
        """
        with self._lock:
            session = self._resting(name)
            new = safe_name(new_name.strip())
            taken = {path.name.casefold() for path in self.folder.iterdir()} - {name.casefold()}
            if not new_name.strip() or new.casefold() in taken | {REMOVED}:
                raise SessionError(
                    f"{new_name.strip() or 'nothing'}: cannot be the name of {name}: expected one "
                    "that no other machine or file of the folder has; choose another name"
                )
            shutil.rmtree(session.folder / PACKAGE, ignore_errors=True)  # it has the name before
            self._move(session, self.folder / new)
            self._sessions[new] = session
        session.changed()
        return new

    def remove(self, name: str) -> Path:
        """Moves a session out of the way, into the folder `REMOVED`; returns where it is now.

        Raises
        ------
        SessionError
            there is no such session, or it is at work.
        """
        with self._lock:
            session = self._resting(name)
            folder = self.folder / REMOVED
            folder.mkdir(exist_ok=True)
            target = folder / free_name(name, {path.name for path in folder.iterdir()})
            self._move(session, target)
            return target

    def _resting(self, name: str) -> Session:
        """Returns a session that nothing is at work for."""
        if name not in self.names():
            raise SessionError(f"{name}: there is no such machine any more; reload the page")
        session = self.opened(name)
        running = [job.what for (of, _), job in self._jobs.items() if of == name and job.running]
        if running:
            raise SessionError(
                f"{name}: cannot be moved while work is under way ({', '.join(running)}): expected "
                "a machine at rest; cancel the work, or wait for its end"
            )
        return session

    def _move(self, session: Session, target: Path) -> None:
        """Moves the folder of a session, which is then known under no name."""
        name = session.name
        session.folder.rename(target)
        session.folder = target
        del self._sessions[name]
        self._jobs = {key: job for key, job in self._jobs.items() if key[0] != name}

    def close(self) -> None:
        """Cancels all jobs and waits for the end of their processes."""
        with self._lock:
            self._closed = True
            self._unread.clear()
            jobs = list(self._jobs.values())
        for job in jobs:
            if job.running:
                job.cancel()
        if self._at_work is not None:
            os.close(self._at_work)
            self._at_work = None


def _changed_at(path: Path) -> float:
    return path.stat().st_mtime

# SPDX-License-Identifier: MIT
"""Run a command as a process of its own, for tests that interrupt or kill it (Linux)."""

import contextlib
import os
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def interruptible(command: Sequence[str]) -> Iterator[subprocess.Popen[str]]:
    """Start a command that Ctrl-C can end; nothing of it is left afterwards.

    The command leads a process group of its own. Its standard output and standard error are pipes.

    A shell starts its background jobs with SIGINT ignored, and all their children inherit that.
    Python then installs no handler for SIGINT, and a test that sends it would wait for ever. So the
    handler is restored while the child is started.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        process = subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
    finally:
        signal.signal(signal.SIGINT, before)
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        for pipe in (process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()


def left_of_session(leader: int, within_s: float) -> list[int]:
    """Wait until no process of a session runs; return the ids of those that still do.

    `leader` is the id of the process that was started with `start_new_session=True`. A process that
    has ended counts as gone even while nobody has asked for its exit code.
    """
    deadline = time.monotonic() + within_s
    while left := _running(leader):
        if time.monotonic() > deadline:
            break
        time.sleep(0.1)
    return left


def _running(session: int) -> list[int]:
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            # The name of the program, in parentheses, may hold spaces: proc(5).
            state, _, _, of_session = path.read_text().rpartition(")")[2].split()[:4]
            if int(of_session) == session and state not in "ZX":
                found.append(int(path.parent.name))
    return found

# SPDX-License-Identifier: MIT
"""Run a command as a process of its own, for tests that interrupt or kill it."""

import contextlib
import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager


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

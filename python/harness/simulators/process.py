# SPDX-License-Identifier: MIT
"""A user's simulator in a process of its own, with limits of time and memory.

An FMU is a program of others: it can crash or hang. Here it ends its own process and one run. This
is no sandbox: the process has the rights of the user.
"""

from __future__ import annotations

import contextlib
import logging
import os
import pickle
import secrets
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from multiprocessing.connection import Client, Connection, Listener
from pathlib import Path
from typing import Any

import numpy as np

from ..base.numbers import FloatArray
from ..base.parallel import end_with
from ..records.errors import Limit
from ..rigs.simulator_section import SimulatorSection
from .around import Around, Told, run_around
from .opening import Opened, SimulatorError, open_simulator

LOGGER = logging.getLogger(__name__)

# A run of twenty seconds of a machine that takes longer than this is no use in a diagnosis.
RUN_S = Limit("EHSID_MAX_SIMULATOR_S", 300, "seconds")
MEMORY = Limit("EHSID_MAX_SIMULATOR_BYTES", 4 * 2**30, "bytes")
# Until the process has loaded Python's packages and the simulator.
START_S = 60.0


@dataclass(frozen=True)
class Failed:
    """What a run ended with in place of outputs."""

    message: str


class SimulatorProcess:
    """The process; `run` may be called from one thread at a time."""

    def __init__(self, section: SimulatorSection) -> None:
        self._section = section
        self._connection: Connection[Any, Any] | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self.limit_s: float = RUN_S.most
        """A run that takes longer is ended."""
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._known: set[int] = set()

    def run(self, told: Told, around: Around) -> FloatArray | Failed:
        """Returns the outputs of a run; each record is sent once."""
        try:
            return self._run(told, around)
        except TimeoutError:
            self.close()
            remedy = f"; {RUN_S.remedy}" if self.limit_s >= RUN_S.most else ""
            return Failed(f"a run took longer than {self.limit_s:.3g} s and was ended{remedy}")
        except (EOFError, OSError):
            code = None if self._process is None else self._process.wait()
            self.close()
            return Failed(f"the simulator crashed its process ({_ended(code)})")

    def _run(self, told: Told, around: Around) -> FloatArray | Failed:
        connection = self._connected()
        if told.number not in self._known:
            connection.send(("told", told.number, told))
            self._known.add(told.number)
        connection.send(("run", told.number, around))
        if not connection.poll(self.limit_s):
            raise TimeoutError
        answer = connection.recv()
        if isinstance(answer, SimulatorError):
            raise answer
        assert isinstance(answer, Failed | np.ndarray)
        return answer

    def _connected(self) -> Connection[Any, Any]:
        if self._connection is None:
            key = secrets.token_bytes(32)
            with Listener(authkey=key) as listener:
                # Not by the module multiprocessing, which would run the user's main script again.
                self._process = subprocess.Popen(
                    [sys.executable, "-m", __name__, str(listener.address)],
                    stdin=subprocess.PIPE,
                    stdout=subprocess.DEVNULL,
                    stderr=None if LOGGER.isEnabledFor(logging.INFO) else subprocess.DEVNULL,
                )
                assert self._process.stdin is not None
                self._process.stdin.write(key.hex().encode() + b"\n")
                self._process.stdin.flush()
                self._connection = _accepted(listener, self._process)
            self._known = set()
            self._folder = tempfile.TemporaryDirectory(prefix="ehsid-", ignore_cleanup_errors=True)
            # The program may import what this process can import.
            self._connection.send((sys.path, pickled(self._section), Path(self._folder.name)))
            if not self._connection.poll(START_S):
                self.close()
                raise SimulatorError(
                    self._section.what, f"the simulator was not loaded within {START_S:g} s"
                )
            try:
                answer = self._connection.recv()
            except EOFError:
                code = self._process.wait()
                self.close()
                raise SimulatorError(
                    self._section.what, f"loading it crashed its process ({_ended(code)})"
                ) from None
            if isinstance(answer, SimulatorError):
                self.close()
                raise answer
        return self._connection

    def close(self) -> None:
        """Ends the process."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            if self._process.stdin is not None:
                with contextlib.suppress(OSError):
                    self._process.stdin.close()
            self._process = None
        if self._connection is not None:
            self._connection.close()
            self._connection = None
        if self._folder is not None:
            self._folder.cleanup()
            self._folder = None


def pickled(section: SimulatorSection) -> bytes:
    """Returns the section for another process: what the user's own program defines goes along.

    Raises
    ------
    Exception
        the user's function or object holds something that no other process can have.
    """
    # Imported here because only a run needs it.
    import cloudpickle

    return bytes(cloudpickle.dumps(section))


def _accepted(listener: Listener, process: subprocess.Popen[bytes]) -> Connection[Any, Any]:
    """The connection of the process, or an error where it ended before."""
    found: list[Connection[Any, Any]] = []

    def accept() -> None:
        with contextlib.suppress(OSError, EOFError):
            found.append(listener.accept())

    waiting = threading.Thread(target=accept, daemon=True)
    waiting.start()
    end = time.monotonic() + START_S
    while waiting.is_alive() and process.poll() is None and time.monotonic() < end:
        waiting.join(0.05)
    if not found:
        raise SimulatorError("simulator", "its process could not be started")
    return found[0]


def _ended(code: int | None) -> str:
    """How a process ended, in words."""
    if code is None:
        return "no exit code"
    return f"signal {-code}" if code < 0 else f"exit code {code}"


def _limit_memory() -> None:
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY.most, MEMORY.most))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _serve(connection: Connection[Any, Any]) -> None:
    """Answers until the other end closes."""
    sys.path[:], section, folder = connection.recv()
    try:
        opened = open_simulator(pickle.loads(section), folder)
    except SimulatorError as error:
        connection.send(error)
        return
    connection.send("opened")
    records: dict[int, Told] = {}
    while True:
        what, key, given = connection.recv()
        if what == "told":
            records[key] = given
            continue
        connection.send(_answer(opened, records[key], given))


def _answer(opened: Opened, told: Told, around: Around) -> FloatArray | Failed | SimulatorError:
    try:
        return run_around(opened, told, around)
    except SimulatorError as error:
        return error
    except MemoryError:
        return Failed(f"a run needs more memory than allowed; {MEMORY.remedy}")


def main() -> None:
    """Entry of the process: its argument is where the other end listens."""
    end_with(os.getppid())
    key = bytes.fromhex(sys.stdin.readline().strip())
    _limit_memory()
    with contextlib.suppress(EOFError, ConnectionError, KeyboardInterrupt):
        _serve(Client(sys.argv[1], authkey=key))


if __name__ == "__main__":
    main()

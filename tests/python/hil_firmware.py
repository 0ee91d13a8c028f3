# SPDX-License-Identifier: MIT
"""The firmware of examples/firmware/servo behind the relay: on this host, and emulated."""

import os
import socket
import subprocess
from pathlib import Path

from ehsid.harness.deploy.hil import Emulator

ROOT = Path(__file__).parents[2]
# By gcc for `script/test --quick`, by clang for the whole: the one that was built last.
ON_HOST = max(
    (
        ROOT / "build" / preset / "examples" / "firmware" / "servo_host"
        for preset in ("dev", "clang")
    ),
    key=lambda path: path.stat().st_mtime if path.exists() else 0.0,
)
ON_TARGET = ROOT / "build" / "arm" / "examples" / "firmware" / "servo_an386.elf"


class HostDevice:
    """Compiled for this host: a process that talks over its standard input and output."""

    def __init__(self, program: Path = ON_HOST) -> None:
        self._program = program
        self._start()

    def _start(self) -> None:
        pipe = subprocess.PIPE
        self._process = subprocess.Popen([self._program], stdin=pipe, stdout=pipe, bufsize=0)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._input, self._output = self._process.stdin.fileno(), self._process.stdout.fileno()

    def fileno(self) -> int:
        return self._output

    def read(self) -> bytes:
        data = os.read(self._output, 4096)
        if not data:
            raise RuntimeError(f"{self._program} ended with exit code {self._process.wait()}")
        return data

    def write(self, data: bytes) -> None:
        os.write(self._input, data)  # fewer bytes than a pipe takes at once

    def reset(self) -> None:
        self.close()
        self._start()

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


class EmulatedDevice:
    """On the emulated Cortex-M4F."""

    def __init__(self, image: Path = ON_TARGET) -> None:
        self._emulator = Emulator(image)
        port = int(self._emulator.port.rpartition(":")[2])
        self._socket = socket.create_connection(("127.0.0.1", port))
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def fileno(self) -> int:
        return self._socket.fileno()

    def read(self) -> bytes:
        data = self._socket.recv(4096)
        if not data:
            raise RuntimeError(f"QEMU ended: {self._emulator.last_words()}")
        return data

    def write(self, data: bytes) -> None:
        self._socket.sendall(data)

    def reset(self) -> None:
        self._emulator.reset()

    def close(self) -> None:
        self._socket.close()
        self._emulator.close()

# SPDX-License-Identifier: MIT
"""The firmware of examples/firmware/servo behind the relay: on this host, and emulated."""

import os
import subprocess
from pathlib import Path

import pytest
from sources import ROOT

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


def on_host() -> HostDevice:
    """The firmware of this host; the test is skipped where it is not built."""
    if not ON_HOST.exists():
        pytest.skip(
            "no firmware for this host; build it: cmake --preset dev && cmake --build --preset dev"
        )
    return HostDevice()

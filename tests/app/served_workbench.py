# SPDX-License-Identifier: MIT
"""A workbench in a process of its own, and the browser of the system."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

# The first is Chromium without windows, which takes three quarters of the time.
BROWSERS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
START_S = 60.0


class Served:
    """A workbench in a process of its own."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.log = folder.parent / f"{folder.name}.log"
        command = [sys.executable, "-m", "ehsid", "app", str(folder), "--no-browser"]
        with self.log.open("wb") as output:
            self.process = subprocess.Popen(
                command,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, "COLUMNS": "300", "OPENBLAS_NUM_THREADS": "1"},
            )
        self.address = self._address()

    def _address(self) -> str:
        end = time.monotonic() + START_S
        while time.monotonic() < end and self.process.poll() is None:
            found = re.search(r"http://127\.0\.0\.1:\d+/login\?token=\S+", self.log.read_text())
            if found:
                return found[0]
            time.sleep(0.1)
        raise AssertionError(self.log.read_text())

    @property
    def root(self) -> str:
        """Address without the token."""
        return self.address.partition("/login")[0]

    def stop(self) -> int:
        """End it as Ctrl-C does; return its exit code."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        return self.process.wait(30.0)


def found_browser() -> str | None:
    """Return the path of a Chromium of the system; None without one."""
    return next((found for name in BROWSERS if (found := shutil.which(name))), None)


def children(parent: int) -> list[int]:
    """Return the worker processes of a process, without the one that tracks resources."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
            command = path.with_name("cmdline").read_text()
        except OSError:
            continue
        if int(fields[1]) == parent and "spawn_main" in command:
            found.append(int(path.parent.name))
    assert found
    return found

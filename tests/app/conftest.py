# SPDX-License-Identifier: MIT
"""A workbench and a browser for the journeys; without them they are skipped, with the reason."""

from __future__ import annotations

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
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


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    pytest.importorskip("panel", reason="the extra app is not installed")
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="the extra browser is not installed"
    )
    path = found_browser()
    if path is None:
        pytest.skip("there is no Chromium: apt-get install chromium")
    with playwright.sync_playwright() as running:
        options = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
        made = running.chromium.launch(executable_path=path, args=options)
        yield made
        made.close()


@pytest.fixture
def served(tmp_path: Path, browser: Any) -> Iterator[Served]:
    made = Served(tmp_path / "machines")
    yield made
    made.stop()
    assert "Traceback" not in made.log.read_text()


@pytest.fixture
def page(served: Served, browser: Any) -> Iterator[Any]:
    """A page of the workbench; it fetches nothing from elsewhere, and no script of it fails."""
    context = browser.new_context(viewport={"width": 1400, "height": 900})
    made = context.new_page()
    made.set_default_timeout(60_000)
    problems: list[str] = []
    made.on("pageerror", lambda error: problems.append(str(error)))
    made.on("request", lambda request: problems.extend(_elsewhere(request.url, served.root)))
    made.goto(served.address)
    made.get_by_text("Drop logs here").wait_for()
    yield made
    context.close()
    assert problems == []


def _elsewhere(url: str, root: str) -> list[str]:
    ours = url.startswith((root, root.replace("http", "ws"), "data:", "blob:"))
    return [] if ours else [url]

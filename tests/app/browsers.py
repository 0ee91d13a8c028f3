# SPDX-License-Identifier: MIT
"""A browser and its pages, for tests; without a browser they are skipped, with the reason."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from served_workbench import found_browser

# As root in a container, and without the browser's own requests to its maker.
OPTIONS = [
    "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
]  # fmt: skip


@contextmanager
def launched_browser() -> Iterator[Any]:
    """A browser; the test is skipped, with the reason, where there is none."""
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="the extra browser is not installed"
    )
    path = found_browser()
    if path is None:
        pytest.skip("there is no Chromium: apt-get install chromium-headless-shell")
    with playwright.sync_playwright() as running:
        made = running.chromium.launch(executable_path=path, args=OPTIONS)
        yield made
        made.close()


@contextmanager
def sound_page(browser: Any, timeout_ms: float = 60_000) -> Iterator[Any]:
    """A page of which no script may fail as long as the context lasts."""
    context = browser.new_context(viewport={"width": 1400, "height": 900})
    made = context.new_page()
    made.set_default_timeout(timeout_ms)
    problems: list[str] = []
    made.on("pageerror", lambda error: problems.append(str(error)))
    yield made
    context.close()
    assert problems == []


def press(page: Any, name: str) -> None:
    page.get_by_role("button", name=name).click()


def see(page: Any, text: str | re.Pattern[str]) -> None:
    page.get_by_text(text).first.wait_for()

# SPDX-License-Identifier: MIT
"""A workbench and a browser for the journeys; without them they are skipped, with the reason."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browsers import launched_browser, sound_page
from served_workbench import Served

# The journeys of every day: from a log to the verdict, a run of the Live page, and who is served.
# All others come with `script/test --all`.
EVERY_DAY = {
    "test_from_a_german_log_to_the_verdict",
    "test_a_run_to_its_end_and_a_machine_of_its_record",
    "test_without_the_token_nothing_is_served",
}


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Levels of journeys. Each is tried twice: a browser on a busy machine can miss a click.

    The report counts these as rerun, so that one that often needs it is seen.
    """
    reruns = config.pluginmanager.hasplugin("rerunfailures")  # it comes with the extra browser
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.slow)
            if item.name not in EVERY_DAY:
                item.add_marker(pytest.mark.thorough)
            if reruns:
                item.add_marker(pytest.mark.flaky(reruns=1))


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    pytest.importorskip("panel", reason="the extra app is not installed")
    with launched_browser() as made:
        yield made


@pytest.fixture(scope="session")
def workbenches(browser: Any) -> Iterator[list[Served]]:
    """The programs that were started, the last one at work; a start takes seconds."""
    started: list[Served] = []
    yield started
    for made in started:
        made.stop()


@pytest.fixture
def served(workbenches: list[Served], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    """A workbench without machines; a journey may stop it."""
    if not workbenches or workbenches[-1].process.poll() is not None:
        workbenches.append(Served(tmp_path_factory.mktemp("workbench") / "machines"))
    made = workbenches[-1]
    before = len(made.log.read_text())
    yield made
    shutil.rmtree(made.folder)
    made.folder.mkdir()
    assert "Traceback" not in made.log.read_text()[before:]


@pytest.fixture
def page(served: Served, browser: Any) -> Iterator[Any]:
    """A page of the workbench; it fetches nothing from elsewhere, and no script of it fails."""
    foreign: list[str] = []
    with sound_page(browser) as made:
        made.on("request", lambda request: foreign.extend(_elsewhere(request.url, served.root)))
        made.goto(served.address)
        made.get_by_text("Drop logs here").wait_for()
        yield made
    assert foreign == []


def _elsewhere(url: str, root: str) -> list[str]:
    ours = url.startswith((root, root.replace("http", "ws"), "data:", "blob:"))
    return [] if ours else [url]

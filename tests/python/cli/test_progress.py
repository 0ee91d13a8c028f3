# SPDX-License-Identifier: MIT
"""What is shown of long work: stages by name, a time to go, nothing where it is quick or quiet."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from ehsid.harness.base.time_to_go import TimeToGo
from ehsid.harness.cli import progress
from ehsid.harness.cli.console import Console, set_quiet


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[float]]:
    """The time, in a list of one number."""
    now = [1000.0]
    monkeypatch.setattr("ehsid.harness.cli.progress.TimeToGo", lambda: TimeToGo(lambda: now[0]))
    yield now
    set_quiet(quiet=False)


def work(clock: list[float]) -> None:
    """A minute in three stages."""
    with progress.progress_of("diagnosing bench") as shown:
        for stage, shares in (("values", [0.1]), ("alone", [0.3, 0.5, 0.7]), ("where", [0.8, 1.0])):
            shown.stage(stage)
            for share in shares:
                clock[0] = 1000.0 + 60.0 * share
                shown(share)


def test_a_log_has_a_line_for_each_stage_with_the_time_to_go(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    work(clock)
    assert capsys.readouterr().err.splitlines() == [
        "diagnosing bench: 10 %, about 54 s to go; values",
        "diagnosing bench: 10 %, about 54 s to go; alone",
        "diagnosing bench: 30 %, about 42 s to go; alone",
        "diagnosing bench: 50 %, about 30 s to go; alone",
        "diagnosing bench: 70 %, about 18 s to go; alone",
        "diagnosing bench: 70 %, about 18 s to go; where",
        "diagnosing bench: 100 %; where",
    ]


def test_quick_and_quiet_work_shows_nothing(
    clock: list[float], capsys: pytest.CaptureFixture[str]
) -> None:
    with progress.progress_of("reading") as shown:
        shown(0.5)
        clock[0] += 1.0
        shown(1.0)
    set_quiet(quiet=True)
    work(clock)
    assert capsys.readouterr().err == ""


def test_a_terminal_has_a_bar_with_the_stage(
    clock: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    terminal = Console(force_terminal=True, width=100, color_system=None)
    monkeypatch.setattr("ehsid.harness.cli.progress.Console", lambda **_: terminal)
    with terminal.capture() as captured, progress.progress_of("diagnosing bench") as shown:
        shown.stage("trying each effect alone")
        clock[0] += 20.0
        shown(0.25)
    assert "diagnosing bench: trying each effect alone" in captured.get()
    assert "about 1 min to go" not in captured.get()
    assert "about 60 s to go" in captured.get()

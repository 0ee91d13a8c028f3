# SPDX-License-Identifier: MIT
"""What is shown of runs on the target: the time to go is that of all runs, and never rises."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import pytest

import ehsid
from ehsid.harness.cli.console import Console
from ehsid.hil.answers import Result, ServoResult
from ehsid.hil.cli.runs import live, state_text
from ehsid.hil.session import Counters

RESULT = Result(
    number=0,
    command_v=0.0,
    gain_v_m=1.0,
    velocity_gain_m_s_v=0.03,
    status=int(ehsid.Status.ok),
    converged=True,
    gain_estimated=False,
    limited=False,
    residuals_white=True,
    resets=0,
    innovation_m=0.0,
    forgetting_factor=0.99,
    fit_percent=98.0,
    excitation=1.0,
    residual_variance_m2=1e-8,
    step_cycles=0,
    bad_frames=0,
    repeated=0,
    trips=0,
    theta=(0.0,) * 6,
)


def test_the_state_of_a_servo_tells_k_and_its_trust() -> None:
    head, counts = (0, 0.0, 1.0), (int(ehsid.Status.ok), False, False, 0, 0, 0, 0)
    none = (math.nan, math.nan, 1)
    known = ServoResult(*head, 0.0296, 0.001, 0, *none, *none, *counts)
    assert state_text(50.0, known, Counters()) == "50/s, K 0.0296 m/s per V (trusted), ok"
    starting = ServoResult(*head, *none, *none, *none, *counts)
    assert state_text(50.0, starting, Counters(late=2)) == "50/s, K: starting, ok, late 2"


class Clock:
    """Time that goes on with the samples."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def work(console: Console, clock: Clock, rates: tuple[float, float]) -> None:
    """Two runs of 200 samples with these rates, in samples per second."""
    with live(console, 400, clock) as stage:
        for name, rate in zip(("first", "second"), rates, strict=True):
            update = stage(name, 200)
            for done in range(1, 201):
                clock.now_s += 1.0 / rate
                update(done, RESULT, replace(Counters(), late=3 if name == "second" else 0))


@pytest.mark.parametrize("rates", [(4.0, 4.0), (8.0, 2.0), (2.0, 8.0)])
def test_lines_of_a_log_tell_a_time_for_all_runs_that_never_rises(
    rates: tuple[float, float], capsys: pytest.CaptureFixture[str]
) -> None:
    work(Console(stderr=True), Clock(), rates)
    lines = capsys.readouterr().err.splitlines()
    words = [re.search(r", about (\d+) (s|min) to go$", line) for line in lines]
    told = [int(each[1]) * (60 if each[2] == "min" else 1) for each in words if each]
    assert len(told) == len(lines) - 1 >= 6
    assert told == sorted(told, reverse=True)
    assert lines[-1].startswith("second: 200 of 200, ")
    assert "to go" not in lines[-1]
    if rates == (4.0, 4.0):
        # 40 of 400 samples are done after 10 s: the others take 90 s.
        assert lines[0] == "first: 40 of 200, 4/s, fit 98.0 %, lambda 0.9900, ok, about 2 min to go"
        assert lines[1].endswith(", about 80 s to go")
        assert ", late 3, about " in lines[-2]


def test_a_terminal_has_a_bar_for_each_run_and_one_time_to_go() -> None:
    console, clock = Console(force_terminal=True, width=140, color_system=None), Clock()
    with console.capture() as captured, live(console, 400, clock) as stage:
        for name, samples in (("first", 200), ("second", 50)):
            update = stage(name, 200)
            for done in range(1, samples + 1):
                clock.now_s += 0.2
                update(done, RESULT, Counters())
    first, second = [line for line in captured.get().splitlines() if "/200" in line][-2:]
    assert "200/200" in first
    assert "to go" not in first
    assert " 50/200" in second
    assert second.rstrip().endswith("about 30 s to go")

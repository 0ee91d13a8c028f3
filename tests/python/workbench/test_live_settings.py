# SPDX-License-Identifier: MIT
"""The form of a run: units of engineers in, SI out, and what is wrong in words."""

from __future__ import annotations

import dataclasses
import shlex
from pathlib import Path
from typing import Any

import pytest
from app_sessions import BENCH
from msgspec.structs import replace
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.cli.policy_option import POLICIES
from ehsid.workbench.live import settings as module
from ehsid.workbench.live.numbers import tidy
from ehsid.workbench.live.settings import (
    IMAGE,
    LINE,
    LiveSettings,
    command,
    python,
    read_settings,
)

FILLED = LiveSettings(
    target=LINE,
    port="socket://localhost:4444",
    rig=str(BENCH),
    effects="coulomb_friction.force_n=400, ",
    position_control=True,
    signal="steps",
    duration_s="2,5",
    dt_ms="5",
    amplitude="4,5",
    bandwidth_hz="1.5",
    seed="3",
)


def test_units_of_engineers_become_si() -> None:
    wanted = read_settings(FILLED)
    assert (wanted.address, wanted.image, wanted.baud) == ("socket://localhost:4444", None, 115200)
    signal = wanted.run.signal
    assert (signal.duration, signal.dt, signal.amplitude) == (2.5, 0.005, pytest.approx(0.0045))
    assert wanted.run.bandwidth_hz == 1.5
    assert wanted.run.values == {"effects.coulomb_friction.force_n": 400.0}
    volts = read_settings(replace(FILLED, position_control=False))
    assert volts.run.signal.amplitude == 4.5


def test_the_first_choice_needs_nothing() -> None:
    wanted = read_settings(LiveSettings())
    assert (wanted.address, wanted.image) == (None, None)
    assert wanted.run.position_control
    assert command(LiveSettings()) == ""  # `ehsid hil` is for boards


def test_real_time_gives_the_watchdog_more_time() -> None:
    slow = read_settings(FILLED).run.watchdog_ms
    assert slow == read_settings(replace(FILLED, real_time=False)).run.watchdog_ms + 10


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"port": " "}, "serial port or address: nothing is given"),
        ({"target": IMAGE}, "firmware image: nothing is given"),
        ({"duration_s": "inf"}, "duration: 'inf': expected a number above 0, in s"),
        ({"dt_ms": "0"}, "sampling time: '0': expected a number above 0, in ms"),
        ({"amplitude": "much"}, "amplitude: 'much'"),
        ({"bandwidth_hz": "-1"}, "bandwidth: '-1': expected a number above 0, in Hz"),
        ({"seed": "-1"}, "seed: '-1': expected a whole number from 0 on"),
        ({"baud": "fast"}, "baud rate: 'fast': expected a whole number from 1 on"),
        ({"effects": "x"}, "expected EFFECT.PARAMETER=NUMBER"),
        ({"rig": "none.toml"}, "none.toml"),
    ],
)
def test_what_is_wrong_is_told(change: dict[str, Any], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        read_settings(replace(FILLED, **change))


@pytest.mark.parametrize(
    "settings",
    [
        FILLED,
        LiveSettings(target=LINE, port="socket://localhost:4444", real_time=False),
        LiveSettings(target=IMAGE, image="my firmware.elf", retune=False, forgetting="constant"),
    ],
)
def test_the_command_means_the_same(
    settings: LiveSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command is run up to the place where it would open the target."""
    seen: list[Any] = []

    class ReachedError(Exception):
        pass

    def stopped(self: Any, rig: Any) -> None:
        seen.append(self)
        raise ReachedError

    monkeypatch.setattr("ehsid.hil.plan.LoopRun.plan", stopped)
    words = shlex.split(command(settings))
    assert "ReachedError" in CliRunner().invoke(cli, words[1:]).stderr
    ours, theirs = dict(vars(read_settings(settings).run)), dict(vars(seen[0]))
    for both in (ours, theirs):
        both["forgetting"] = repr(both["forgetting"])
        peak = both["signal"].amplitude  # shown with twelve digits
        peak = None if peak is None else round(peak, 12)
        both["signal"] = dataclasses.replace(both["signal"], amplitude=peak)
    assert ours == theirs


def test_the_python_can_be_read() -> None:
    compile(python(FILLED), "shown", "exec")
    names: dict[str, Any] = {}
    line = next(line for line in python(FILLED).splitlines() if line.startswith("settings ="))
    exec(line, vars(module), names)
    assert names["settings"] == FILLED


def test_policies_have_the_names_of_the_command() -> None:
    assert module.POLICIES.keys() == POLICIES.keys()


def test_options_are_named_without_dashes() -> None:
    assert tidy("--amplitude 11: expected") == "amplitude 11: expected"
    assert tidy("a - b -- c") == "a - b -- c"


def test_the_rig_of_a_machine_may_be_written_with_a_tilde(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    (tmp_path / "rig.toml").write_bytes(BENCH.read_bytes())
    assert read_settings(replace(FILLED, rig="~/rig.toml")).rig.name == "bench"

# SPDX-License-Identifier: MIT
"""Runs of a user's simulator on a command, and what they say where they cannot be made."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sources import loaded
from typer.testing import CliRunner
from user_simulators import FOLDER, needs_linux64, rig_document, text_of

import ehsid
from ehsid.harness.cli import cli
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.rig_file import parse_rig, rig_text
from ehsid.harness.signals.simulation import SimulationError, simulate
from ehsid.harness.signals.simulation.outside import opened_outside, simulate_outside

DT_S = 1e-3
COMMAND = 2.0 * np.sin(np.arange(300) * 0.05)
PYTHON = read_rig(FOLDER / "rig_python.toml")


def run(rig: Rig, command: Any = COMMAND, *, dt_s: float = DT_S, **options: Any) -> Any:
    with opened_outside(rig, options.get("position0_m")) as runs:
        assert runs is not None
        return simulate_outside(runs, command, dt_s=dt_s, **options)


def by_hand(command: Any, position_m: float) -> Any:
    bench = loaded(FOLDER / "bench_plant.py").Bench()
    read = [bench.reset(position_m=position_m)]
    read += [bench.step(DT_S, volts) for volts in command[:-1]]
    return np.array(read)


@pytest.mark.slow
def test_a_run_is_that_of_the_program_itself() -> None:
    found = run(PYTHON, position0_m=0.1)
    assert list(found.record.columns) == [
        "command_v",
        "position_m",
        "velocity_m_s",
        "pressure_a_pa",
        "pressure_b_pa",
    ]
    expected = by_hand(COMMAND, 0.1)
    for column, name in enumerate(list(found.record.columns)[1:]):
        np.testing.assert_allclose(found.record.column(name), expected[:, column], rtol=1e-9)
    assert (dict(found.error), found.substeps) == ({}, 1)


@pytest.mark.slow
def test_effects_and_values_act_around_it() -> None:
    late = run(PYTHON, values={"effects.transport_delay.delay_s": 0.02})
    moved = np.concatenate([np.zeros(20), COMMAND[:-20]])
    np.testing.assert_allclose(
        late.record.column("position_m"), run(PYTHON, moved).record.column("position_m"), atol=1e-12
    )
    slow = run(PYTHON, values={"simulator.parameters.rated_flow": 1e-4})
    assert np.ptp(slow.record.column("position_m")) < 0.5 * np.ptp(late.record.column("position_m"))


@pytest.mark.slow
def test_effects_at_ports_take_shorter_steps() -> None:
    rubbing = run(PYTHON, dt_s=0.002, values={"effects.coulomb_friction.force_n": 400.0})
    assert rubbing.substeps == 4


@pytest.mark.slow
def test_noise_comes_before_the_steps_of_the_sensor() -> None:
    noise = np.zeros((COMMAND.size, 6))
    noise[:, 0] = np.random.default_rng(1).normal(0.0, 1e-3, COMMAND.size)
    step = {"effects.sensor_quantisation.step_m": 1e-3}
    position = run(PYTHON, values=step, noise=noise).record.column("position_m")
    np.testing.assert_allclose(position / 1e-3, np.round(position / 1e-3), atol=1e-9)
    assert np.abs(np.diff(position)).max() >= 1e-3


@pytest.mark.slow
@needs_linux64
def test_an_fmu_runs_as_the_python_program() -> None:
    fmu = run(read_rig(FOLDER / "rig.toml"), position0_m=0.2)
    python = run(PYTHON, position0_m=0.2)
    for name in ("position_m", "pressure_a_pa"):
        np.testing.assert_allclose(
            fmu.record.column(name), python.record.column(name), rtol=1e-9, atol=0.0
        )


@pytest.mark.slow
@needs_linux64
def test_a_simulator_without_pressures_gives_what_it_has() -> None:
    found = run(read_rig(FOLDER / "rig_portless.toml"))
    assert list(found.record.columns) == ["command_v", "position_m"]


def test_a_start_needs_a_place_in_the_rig_file() -> None:
    document = rig_document("rig_python.toml")
    document["simulator"]["start"] = {}
    with pytest.raises(ValueError, match=r"name the value that states its start in \[simulator"):
        run(parse_rig(text_of(document)), position0_m=0.1)


@pytest.mark.slow
def test_an_effect_inside_and_a_run_to_the_stop_are_refused() -> None:
    with pytest.raises(SimulationError, match="entrained_air': it acts inside the simulator"):
        run(PYTHON, values={"effects.entrained_air.volume_fraction": 0.01})
    with pytest.raises(SimulationError, match="the rod reaches an end of its stroke"):
        run(PYTHON, np.full(1500, 9.0), keep_inside=True)
    with pytest.raises(SimulationError, match="its plant is a simulator of the user"):
        simulate(PYTHON, COMMAND, dt_s=DT_S)


@pytest.mark.slow
def test_a_program_that_stops_says_where(tmp_path: Path) -> None:
    document = rig_document("rig_python.toml")
    text = (FOLDER / "bench_plant.py").read_text()
    text = text.replace(
        "        steps = max(1, ceil(dt / 1e-4 - 1e-9))",
        "        if command_v > 5.0:\n            self.state[0] = float('nan')\n"
        "        steps = max(1, ceil(dt / 1e-4 - 1e-9))",
    )
    (tmp_path / "stops.py").write_text(text)
    document["simulator"]["python"] = f"{tmp_path / 'stops.py'}:Bench"
    command = np.where(np.arange(50) < 20, 1.0, 6.0)
    with pytest.raises(SimulationError, match=r"stops\.py:Bench: .*not finite from sample 22 on"):
        run(parse_rig(text_of(document)), command)


@pytest.mark.slow
def test_the_command_and_the_function_run_it(tmp_path: Path) -> None:
    out = tmp_path / "sim.csv"
    options = ["--excitation", "steps", "--duration", "0.3", "--out", str(out)]
    outcome = CliRunner().invoke(cli, ["simulate", str(FOLDER / "rig_python.toml"), *options])
    assert outcome.exit_code == 0, outcome.output
    assert "the error of integration is not known" in outcome.output
    found = ehsid.simulate(FOLDER / "rig_python.toml", "steps", duration_s=0.3)
    written = ehsid.read(out)
    np.testing.assert_allclose(
        written.result.column("position_m"), found.record.result.column("position_m")
    )
    again = ehsid.simulate(FOLDER / "rig_python.toml", out)
    np.testing.assert_allclose(
        again.record.result.column("position_m"), found.record.result.column("position_m")
    )


@pytest.mark.slow
@needs_linux64
def test_the_rig_of_a_diagnosis_runs_from_another_folder(tmp_path: Path) -> None:
    found = read_rig(FOLDER / "rig.toml").with_values({"effects.coulomb_friction.force_n": 900.0})
    augmented = tmp_path / "rig.augmented.toml"
    augmented.write_text(rig_text(found))
    options = ["--excitation", "triangle", "--duration", "0.5", "--json"]
    outcome = CliRunner().invoke(cli, ["simulate", str(augmented), *options])
    assert json.loads(outcome.output) == {"samples": 500, "dt_s": 0.001, "substeps": 2, "error": {}}


def test_a_closed_loop_is_refused() -> None:
    options = ["--excitation", "steps", "--loop", "p"]
    outcome = CliRunner().invoke(cli, ["simulate", str(FOLDER / "rig_python.toml"), *options])
    assert outcome.exit_code == 2
    assert "expected a test signal in open loop" in " ".join(outcome.output.split())

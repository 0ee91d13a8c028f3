# SPDX-License-Identifier: MIT
import json
from pathlib import Path

import numpy as np
import pytest
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.records import read_record
from ehsid.harness.rigs import RigError, read_rig
from ehsid.harness.signals.simulation import SimulationError, parse_settings, simulate

RIG = ROOT / "examples" / "rigs" / "bench.toml"
AXIS = RIG.with_name("axis.toml")


def steps(n: int = 400) -> np.ndarray:
    return np.repeat(np.random.default_rng(0).uniform(-4.0, 4.0, n // 50), 50)


def test_record_has_time_command_and_outputs() -> None:
    run = simulate(read_rig(RIG), steps(), dt_s=1e-3, position0_m=0.1)
    assert run.record.dt_s == pytest.approx(1e-3)
    np.testing.assert_array_equal(run.record.column("command_v"), steps())
    assert run.record.column("position_m")[0] == 0.1
    assert set(run.record.columns) == {
        "command_v",
        "position_m",
        "velocity_m_s",
        "pressure_a_pa",
        "pressure_b_pa",
        "supply_pressure_pa",
        "spool",
    }


def test_reported_error_is_that_of_the_integration() -> None:
    rig, command = read_rig(RIG), steps()
    exact = simulate(rig, command, dt_s=1e-3, substeps=128).record
    for substeps in (4, 8):
        run = simulate(rig, command, dt_s=1e-3, substeps=substeps)
        for name in ("position_m", "velocity_m_s", "pressure_a_pa"):
            values = run.record.column(name)
            true = np.max(np.abs(values - exact.column(name))) / np.ptp(values)
            # The method is of second order: the difference to half the step is three quarters of
            # the error. The next order changes this by the relative size of a step, some tenths.
            assert 0.5 * true < run.error[name] < true


def test_axis_has_no_pressures() -> None:
    run = simulate(read_rig(AXIS), steps(), dt_s=1e-3)
    assert set(run.record.columns) == {"command_v", "position_m", "velocity_m_s"}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"command_v": [0.0, float("inf")]}, "not finite at sample 2"),
        ({"command_v": [[0.0, 1.0]]}, "expected at least 2 samples"),
        ({"position0_m": 0.4}, "outside the stroke, 0 to 0.3 m"),
        ({"values": {"load.mass_kg": -1.0}}, "'load.mass_kg' = -1"),
        ({"values": {"load.mass": 1.0}}, "did you mean 'load.mass_kg'"),
        ({"values": {"load.mass_kg": 0.01, "nuisance.presliding_m": 1e-6,
                     "effects.coulomb_friction.force_n": 2e4}}, "too stiff"),
        ({"command_v": np.full(3000, 5.0), "keep_inside": True}, "reaches an end of its stroke"),
    ],
)  # fmt: skip
def test_invalid_arguments_are_refused(change: dict[str, object], words: str) -> None:
    arguments: dict[str, object] = {"command_v": steps(), "dt_s": 1e-3} | change
    with pytest.raises(SimulationError, match=words):
        simulate(read_rig(RIG), **arguments)  # type: ignore[arg-type]


def test_settings_of_a_command_line() -> None:
    values = parse_settings(["coulomb_friction.force_n=400", "valve_null_bias.offset=-0.02"])
    assert values == {
        "effects.coulomb_friction.force_n": 400.0,
        "effects.valve_null_bias.offset": -0.02,
    }
    with pytest.raises(RigError) as caught:
        parse_settings(["coulomb_friction", "load_force.force_n=abc", "load_farce.force_n=1"])
    assert len(caught.value.problems) == 3


@pytest.mark.slow
def test_command_writes_a_record_that_drives_the_next_run(tmp_path: Path) -> None:
    first, second = tmp_path / "first.csv", tmp_path / "second.parquet"
    arguments = ["--excitation", "steps", "--duration", "1", "--amplitude", "3", "--json"]
    outcome = CliRunner().invoke(cli, ["simulate", str(RIG), *arguments, "--out", str(first)])
    assert outcome.exit_code == 0, outcome.output
    assert json.loads(outcome.stdout)["samples"] == 1000
    outcome = CliRunner().invoke(
        cli, ["simulate", str(RIG), "--command", str(first), "--out", str(second)]
    )
    assert outcome.exit_code == 0, outcome.output
    a, b = read_record(first), read_record(second)
    np.testing.assert_array_equal(a.column("position_m"), b.column("position_m"))
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        ".ehsid",
        "first.csv",
        "first.png",
        "second.parquet",
        "second.png",
    ]


@pytest.mark.parametrize("name", ["multisine", "prbs", "steps", "chirp", "triangle"])
def test_every_excitation_runs(name: str) -> None:
    arguments = ["--excitation", name, "--duration", "4", "--amplitude", "0.5", "--json"]
    outcome = CliRunner().invoke(cli, ["simulate", str(RIG), *arguments])
    assert outcome.exit_code == 0, outcome.output
    assert max(json.loads(outcome.stdout)["error"].values()) < 0.005


def test_catalogue_as_json() -> None:
    outcome = CliRunner().invoke(cli, ["effects", "--json"])
    effects = json.loads(outcome.stdout)
    assert len(effects) == 33
    for effect in effects:
        assert all(effect[key] for key in ("id", "subsystem", "equation", "source", "excitation"))
        for parameter in effect["parameters"]:
            assert parameter["minimum"] <= parameter["typical"] <= parameter["maximum"]

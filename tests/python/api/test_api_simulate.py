# SPDX-License-Identifier: MIT
import json
from pathlib import Path

import numpy as np
import pytest
from sources import ROOT
from typer.testing import CliRunner

import ehsid
from ehsid.harness.cli import cli
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.simulation import simulate

BENCH = ROOT / "examples" / "rigs" / "bench.toml"
VOLTS = 0.5 * np.sin(np.arange(500) * 0.02)


@pytest.fixture(scope="module")
def rig() -> ehsid.Rig:
    return ehsid.Rig.read(BENCH)


def test_an_array_gives_the_run_of_the_room(rig: ehsid.Rig) -> None:
    values = {"effects.coulomb_friction.force_n": 400.0}
    run = ehsid.simulate(rig, VOLTS, dt_s=1e-3, values=values, position0_m=0.1)
    expected = simulate(read_rig(BENCH), VOLTS, dt_s=1e-3, values=values, position0_m=0.1)
    for name, column in expected.record.columns.items():
        assert np.array_equal(run.record[name], column)
    assert run.result.substeps == expected.substeps
    assert dict(run.result.error) == dict(expected.error)


@pytest.mark.slow
def test_rigs_and_commands_of_every_kind_give_the_same(rig: ehsid.Rig, tmp_path: Path) -> None:
    expected = ehsid.simulate(rig, VOLTS, dt_s=1e-3)
    path = expected.save(tmp_path / "run.csv")
    assert path.with_suffix(".png").stat().st_size > 10_000
    for machine in (rig, rig.result, BENCH, str(BENCH)):
        for command in (path, str(path), ehsid.read(path), ehsid.read(path).result):
            run = ehsid.simulate(machine, command)
            assert np.array_equal(run.record["position_m"], expected.record["position_m"])


@pytest.mark.slow
def test_a_signal_is_that_of_the_command(rig: ehsid.Rig, tmp_path: Path) -> None:
    out = tmp_path / "sim.csv"
    line = f"simulate {BENCH} --excitation prbs --duration 1 --dt 0.002 --amplitude 2 --noise"
    done = CliRunner().invoke(cli, [*line.split(), "--seed", "3", "--out", str(out), "--json"])
    assert done.exit_code == 0, done.output
    run = ehsid.simulate(rig, "prbs", duration_s=1.0, dt_s=0.002, amplitude=2.0, noise=True, seed=3)
    assert json.loads(done.stdout)["samples"] == len(run.record)
    written = ehsid.read(out)
    for name in ("command_v", "position_m", "pressure_a_pa"):
        assert np.array_equal(run.record[name], written[name])


def test_frames_have_time_command_and_outputs(rig: ehsid.Rig) -> None:
    run = ehsid.simulate(rig, VOLTS, dt_s=1e-3)
    frame = run.to_polars()
    assert frame.columns[:3] == ["time_s", "command_v", "position_m"]
    assert np.array_equal(frame["command_v"], VOLTS)
    assert list(run.to_pandas().columns) == frame.columns


@pytest.mark.parametrize(
    ("command", "options", "says"),
    [
        (VOLTS, {}, ["dt_s=None", "an array has no time"]),
        ("multisin", {}, ["'multisin'", "multisine, prbs"]),
        ("prbs", {"amplitude": 30.0}, ["amplitude=30", "rated command, 10 V"]),
        ("prbs", {"duration_s": 0.0}, ["duration_s=0, dt_s=0.001"]),
        ("prbs", {"position0_m": 1.0}, ["position0_m=1", "0 to 0.3 m"]),
        (np.ma.masked_less(VOLTS, 0.0), {"dt_s": 1e-3}, ["masked values"]),
        (VOLTS, {"dt_s": 1e-3, "values": {"load.mas_kg": 1.0}}, ["load.mass_kg"]),
    ],
)
def test_commands_that_drive_no_rig_are_refused(
    command: object, options: dict[str, object], says: list[str], rig: ehsid.Rig
) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 -- the texts are in the table
        ehsid.simulate(rig, command, **options)  # type: ignore[arg-type]
    for text in says:
        assert text in str(caught.value)
    assert "--" not in str(caught.value)


def test_a_record_has_its_own_sampling_time(rig: ehsid.Rig) -> None:
    record = ehsid.simulate(rig, VOLTS, dt_s=1e-3).record
    with pytest.raises(ValueError, match="its own sampling time"):
        ehsid.simulate(rig, record, dt_s=1e-3)


def test_noise_needs_sensors() -> None:
    axis = BENCH.with_name("axis.toml")
    quiet = ehsid.Rig(read_rig(axis))
    if any(quiet.result.sensors.values()):
        pytest.fail("this rig must have no sensors")
    with pytest.raises(ValueError, match="gives no sensor noise"):
        ehsid.simulate(quiet, VOLTS, dt_s=1e-3, noise=True)


def test_what_is_no_rig_is_refused() -> None:
    with pytest.raises(ValueError, match="a dict is no rig"):
        ehsid.simulate({}, VOLTS, dt_s=1e-3)  # type: ignore[arg-type]

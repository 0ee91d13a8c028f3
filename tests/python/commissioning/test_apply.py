# SPDX-License-Identifier: MIT
"""`ehsid apply`: its files, what it refuses, and a loop that follows better with it."""

from __future__ import annotations

import csv
import json
import shutil
import subprocess
import tomllib
from pathlib import Path

import numpy as np
import pytest
from published_schemas import check_file
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.commissioning import design
from ehsid.harness.diagnosis.schema import (
    NOT_COMPARED,
    NOWHERE,
    DiagnosisFile,
    Provenance,
    Which,
    file_text,
)
from ehsid.harness.records.record import Origin, Taken
from ehsid.harness.rigs import read_rig, write_rig
from ehsid.harness.signals.simulation import simulate_closed_loop, suggested_controller

pytestmark = pytest.mark.usefixtures("blank_pictures")

BENCH = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
HIDDEN = {
    "effects.valve_dead_band.overlap": 0.04,
    "effects.valve_null_bias.offset": -0.01,
    "effects.coulomb_friction.force_n": 400.0,
}
# About those of a diagnosis.
SIGMAS = {
    "load.viscous_friction_n_s_m": 0.05,
    "fluid.bulk_modulus_pa": 0.05,
    "cylinder.dead_volume_a_m3": 0.05,
    "cylinder.dead_volume_b_m3": 0.05,
    "effects.valve_lag.bandwidth_hz": 0.05,
    **dict.fromkeys(HIDDEN, 0.06),
}
SERVO = {
    name: {"value": value, "ci90": [0.9 * value, 1.1 * value], "trusted": True,
           "reason_at_end": "trusted"}
    for name, value in (("gain", 0.02), ("omega_n", 120.0), ("xi", 0.3))
}  # fmt: skip


@pytest.fixture
def rig_file(tmp_path: Path) -> Path:
    """A rig with effects as a diagnosis would write it, a tenth beside the truth."""
    found = BENCH.with_values({name: 0.9 * size for name, size in HIDDEN.items()})
    path = tmp_path / "rig.augmented.toml"
    write_rig(type(found)("found", "ehs", found.values, SIGMAS, found.sensors), path)
    return path


def run(*words: str | Path) -> tuple[int, str]:
    outcome = CliRunner().invoke(cli, ["apply", *map(str, words)], env={"COLUMNS": "200"})
    return outcome.exit_code, " ".join(outcome.output.split())


@pytest.mark.slow
def test_files_can_be_read_by_others_and_agree(rig_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    code, shown = run(rig_file, "--name", "press", "--out", out)
    assert code == 0, shown
    check_file(out / "apply.json")
    told = json.loads((out / "apply.json").read_text("utf-8"))
    constants = {one["name"]: one["value"] for one in told["constants"]}
    assert all(one["unit"] and one["source"] for one in told["constants"])
    assert constants["edge_extending"] == pytest.approx(0.9 * 0.05)
    plain = tomllib.loads((out / "apply.toml").read_text("utf-8"))
    assert {name: one["value"] for name, one in plain["constants"].items()} == constants
    for table in told["tables"]:
        text = (out / f"{table['name']}.csv").read_text("utf-8")
        rows = list(csv.DictReader(text.splitlines()))
        assert len(rows) == 100
        assert [float(row["opening"]) for row in rows] == table["columns"]["opening"]
    inverse = next(one for one in told["tables"] if one["name"] == "inverse_extending")["columns"]
    structured = (out / "apply.st").read_text("utf-8")
    assert f"press_xi : LREAL := {constants['xi']:.9g};" in structured
    assert structured.count("ARRAY [0..99] OF LREAL") == 4 + 4 + 6
    assert structured.count("VAR_GLOBAL CONSTANT") == structured.count("END_VAR") == 1
    twincat = (out / "apply_twincat.st").read_text("utf-8")
    assert "{attribute 'qualified_only'}" in twincat
    listed = twincat.partition("inverse_extending : ARRAY [0..99, 0..1] OF LREAL := [")[2]
    pairs = np.array(listed.partition("];")[0].split(","), dtype=float).reshape(100, 2)
    np.testing.assert_allclose(pairs[:, 1], inverse["command"], rtol=1e-7)
    program = tmp_path / "main.c"
    program.write_text(
        '#include "out/apply.h"\n#include <stdio.h>\n'
        'int main(void) { printf("%.9g %.9g", PRESS_XI, press_inverse_extending_command[50]); }'
    )
    gcc = shutil.which("gcc")
    if gcc is not None:
        flags = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-const-variable"]
        subprocess.run([gcc, *flags, "-o", tmp_path / "a.out", program], check=True)
        answer = subprocess.run([tmp_path / "a.out"], capture_output=True, check=True).stdout
        numbers = [float(word) for word in answer.split()]
        assert numbers == pytest.approx([constants["xi"], inverse["command"][50]], rel=1e-6)
    assert "Merritt" in (out / "apply.html").read_text("utf-8")


@pytest.mark.slow
def test_a_hidden_dead_band_is_made_up_for(rig_file: Path) -> None:
    """Sizes are 10 % too small; the machine has the true ones."""
    made = design([rig_file], speed=0.5)
    assert made.gains is not None
    machine = BENCH.with_values(HIDDEN)
    t = 1e-3 * np.arange(3000)
    reference = 0.15 + 0.01 * np.sin(2.0 * np.pi * t)
    errors = []
    for controller in (
        suggested_controller(BENCH, made.gains.pole / (2.0 * np.pi)),
        made.controller(),
    ):
        loop = simulate_closed_loop(machine, reference, controller, dt_s=1e-3)
        error = reference - loop.run.record.column("position_m")
        errors.append(float(np.sqrt(np.mean(error[1000:] ** 2))))
    assert errors[1] < 0.5 * errors[0]


@pytest.mark.slow
def test_an_estimate_alone_gives_gains_and_no_tables(tmp_path: Path) -> None:
    path = tmp_path / "estimate.json"
    path.write_text(json.dumps({"servo": {**SERVO, "delay": 2}}))
    code, shown = run(path, "--json")
    told = json.loads(shown)
    assert code == 0
    assert told["tables"] == []
    assert told["refused"] == {
        "valve": "an estimate has no edges: name a diagnosis or a rig file, too"
    }
    names = [one["name"] for one in told["constants"]]
    assert {"p_pole", "placed_gain_acceleration", "p_phase_margin_worst"} <= set(names)


def test_gains_are_in_the_unit_of_the_command_of_the_estimate(tmp_path: Path) -> None:
    """A log with its command in per cent has K in m/s per per cent."""
    taken = Taken("command_v", "Command [%]", "percent", 1.0, 0.0, "its name")
    reading = Origin("text", (taken,), ()).to_dict()
    path = tmp_path / "estimate.json"
    path.write_text(json.dumps({"servo": {**SERVO, "delay": 2}, "reading": reading}))
    code, shown = run(path, "--json")
    assert code == 0
    units = {one["name"]: one["unit"] for one in json.loads(shown)["constants"]}
    assert units["p_gain_position"] == units["placed_gain_position"] == "percent/m"
    assert units["p_feed_forward"] == "percent s/m"


VERDICT = {"outside_catalogue": "take the next experiment", "insufficient_data": "did not carry"}


@pytest.mark.parametrize("verdict", VERDICT)
def test_a_verdict_that_carries_nothing_is_refused(
    verdict: str, rig_file: Path, tmp_path: Path
) -> None:
    provenance = Provenance("", (), {}, 1.0)
    which = Which((), (), (), (), None)
    file = DiagnosisFile(1, verdict, NOWHERE, which, NOT_COMPARED, {}, provenance)  # type: ignore[arg-type]
    (tmp_path / "diagnosis.json").write_text(file_text(file))
    code, shown = run(tmp_path, "--out", tmp_path / "out")
    assert code == 2
    assert f"the verdict is {verdict}" in shown
    assert VERDICT[verdict] in shown
    assert not (tmp_path / "out").exists()

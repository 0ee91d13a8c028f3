# SPDX-License-Identifier: MIT
"""What traces tell: delay, lag and play with their sizes; other causes are never named alone."""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np
import pytest
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.diagnosis.schema import read_diagnosis_file
from ehsid.harness.diagnosis.traces.findings import diagnose_traces
from ehsid.harness.diagnosis.traces.match import Matched, matched
from ehsid.harness.diagnosis.traces.terms import changed
from ehsid.harness.records import Record, make_record
from ehsid.harness.records.record import record_bytes
from ehsid.harness.rigs import Rig
from ehsid.harness.rigs.rig_file import read_rig
from ehsid.harness.signals.simulation import simulate

DT_S = 0.002
RIG = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
T = np.arange(4000) * DT_S
COMMAND = (
    1.5 * np.sin(2 * np.pi * 0.9 * T)
    + 0.8 * np.sin(2 * np.pi * 2.3 * T + 1.0)
    + 0.5 * np.sign(np.sin(2 * np.pi * 0.43 * T))
)
PLAIN = simulate(RIG, COMMAND, dt_s=DT_S).record
LIMITS = Rig("machine", "simulator", {"valve.rated_command_v": 10.0})


def measured(position_m: np.ndarray, name: str = "run") -> Record:
    noise = np.random.default_rng(7).normal(0.0, 1e-5, position_m.size)
    columns = {"time_s": T, "command_v": COMMAND, "position_m": position_m + noise}
    return make_record(columns, name=name)


def found(position_m: np.ndarray, **options: tuple[str, ...]) -> Diagnosis:
    return diagnose_traces([matched(measured(position_m), PLAIN, LIMITS)], LIMITS, **options)


def with_terms(**sizes: float) -> np.ndarray:
    trace = {"position_m": PLAIN.column("position_m")}
    return changed(trace, sizes, DT_S)["position_m"]


@pytest.mark.slow
def test_play_of_the_sensor_is_named_with_its_size() -> None:
    diagnosis = found(with_terms(sensor_backlash=4e-4, scale=0.97))
    # Friction looks the same in a position, and is not excluded.
    assert diagnosis.verdict == "ambiguous"
    assert diagnosis.ambiguity_set == (("sensor_backlash",), ("coulomb_friction",))
    assert [effect.id for effect in diagnosis.effects] == ["sensor_backlash"]
    size = diagnosis.effects[0].parameters["half_width_m"]
    assert size.value == pytest.approx(4e-4, rel=0.05)
    assert size.low < 4e-4 < size.high
    assert diagnosis.where.subsystem["sensor"] == diagnosis.where.subsystem["mechanics"] == 0.5
    assert diagnosis.how_far is not None
    assert diagnosis.how_far.augmented < 0.2 * diagnosis.how_far.nominal
    assert any("factor of 0.97" in reason for reason in diagnosis.reasons)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("term", "size"), [("transport_delay", 0.02), ("valve_lag", 12.0), ("sensor_lag", 0.02)]
)
def test_what_delays_is_found_among_all_that_delays(term: str, size: float) -> None:
    diagnosis = found(with_terms(**{term: size}))
    assert diagnosis.verdict in ("effects", "ambiguous")
    assert diagnosis.effects[0].id == term
    value = next(iter(diagnosis.effects[0].parameters.values())).value
    assert value == pytest.approx(size, rel=0.05)
    named = {name for names in diagnosis.ambiguity_set for name in names}
    assert named <= {"transport_delay", "valve_lag", "sensor_lag"}


@pytest.mark.slow
@pytest.mark.parametrize(
    "effects",
    [
        {"load_force.force_n": 2000.0},
        {"valve_dead_band.overlap": 0.04},
        {"valve_null_bias.offset": 0.03},
        {"valve_hysteresis.half_width": 0.03},
    ],
)
def test_a_cause_inside_is_never_named(effects: dict[str, float]) -> None:
    values = {f"effects.{name}": value for name, value in effects.items()}
    machine = simulate(RIG, COMMAND, dt_s=DT_S, values=values).record
    diagnosis = found(machine.column("position_m"))
    assert (diagnosis.verdict, diagnosis.effects) == ("outside_catalogue", ())
    assert diagnosis.where.regimes
    assert diagnosis.where.subsystem == {}
    assert "needs the simulator itself" in diagnosis.reasons[-1]


@pytest.mark.slow
def test_friction_is_not_taken_for_play_alone() -> None:
    values = {"effects.coulomb_friction.force_n": 2500.0}
    machine = simulate(RIG, COMMAND, dt_s=DT_S, values=values).record
    diagnosis = found(machine.column("position_m"))
    assert diagnosis.verdict == "ambiguous"
    assert ("coulomb_friction",) in diagnosis.ambiguity_set
    assert "coulomb_friction" not in {one.id for one in diagnosis.cannot_judge}


def test_a_trace_that_fits_leaves_no_gap_and_one_without_motion_nothing() -> None:
    diagnosis = found(PLAIN.column("position_m"), exclude=("sensor_backlash", "valve_lag"))
    assert diagnosis.verdict == "no_gap"
    assert {one.id for one in diagnosis.cannot_judge} >= {"coulomb_friction", "internal_leakage"}
    still = np.full(T.size, 0.1)
    assert found(still).verdict == "insufficient_data"


def test_a_trace_of_another_clock_is_brought_to_the_record() -> None:
    record = measured(PLAIN.column("position_m"))
    fine = np.arange(0.0, 7.9, 0.0005)
    late = make_record(
        {"time_s": fine + 1000.0, "position_m": np.interp(fine, T, PLAIN.column("position_m"))},
        name="sim",
    )
    pair = matched(record, late, LIMITS)
    assert isinstance(pair, Matched)
    assert "both were taken to begin at once" in pair.remarks[0].what
    error = pair.trace["position_m"] - PLAIN.column("position_m")[: len(pair.record)]
    assert np.abs(error).max() < 2e-5
    position = PLAIN.column("position_m")
    other = make_record({"time_s": T, "command_v": -COMMAND, "position_m": position}, name="sim")
    with pytest.raises(ValueError, match="expected a simulation of the same command"):
        matched(record, other, LIMITS)
    short = make_record({"time_s": T[:1000], "position_m": position[:1000]}, name="sim")
    with pytest.raises(ValueError, match="covers 25 % of the record"):
        matched(record, short, LIMITS)


@pytest.mark.slow
def test_the_command_writes_files_and_a_page(tmp_path: Path) -> None:
    record, trace = tmp_path / "run.csv", tmp_path / "sim.csv"
    record.write_bytes(record_bytes(measured(with_terms(sensor_backlash=4e-4)), "run.csv"))
    trace.write_bytes(record_bytes(PLAIN, "sim.csv"))
    out = tmp_path / "out"
    options = ["--simulated", str(trace), "--out", str(out), "--fail-on", "ambiguous"]
    outcome = CliRunner().invoke(cli, ["gap", str(record), *options])
    assert outcome.exit_code == 3, outcome.output
    assert {path.name for path in out.iterdir()} >= {"report.html", "simulation.csv"}
    assert not (out / "rig.augmented.toml").exists()
    file = read_diagnosis_file(out / "diagnosis.json")
    assert file.which.ambiguity_set == (("sensor_backlash",), ("coulomb_friction",))
    assert [one.role for one in file.provenance.records] == ["fit and held out", None]
    assert (
        msgspec.json.decode((out / "diagnosis.json").read_bytes())["which"]["effects"][0][
            "probability"
        ]
        is None
    )
    page = (out / "report.html").read_text()
    assert "The simulator was not run." in page
    assert "rig.augmented.toml" not in page


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "--rig is missing"),
        (["--simulated", "RECORD", "--validate", "RECORD"], "--validate does not go with"),
        (["--simulated", "RECORD", "--simulated", "RECORD"], "expected one trace for each record"),
    ],
)
def test_what_does_not_go_together_is_told(
    options: list[str], message: str, tmp_path: Path
) -> None:
    record = tmp_path / "run.csv"
    record.write_bytes(record_bytes(measured(PLAIN.column("position_m")), "run.csv"))
    given = [str(record) if one == "RECORD" else one for one in options]
    outcome = CliRunner().invoke(cli, ["gap", str(record), *given, "--out", str(tmp_path / "out")])
    assert outcome.exit_code == 2
    assert message in " ".join(outcome.output.split())

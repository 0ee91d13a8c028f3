# SPDX-License-Identifier: MIT
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from made_diagnoses import VERDICTS, made_diagnosis, measured_record
from msgspec.structs import replace as replace_part
from published_schemas import check_file
from typer.testing import CliRunner

import ehsid
from ehsid.harness.base.csv_text import csv_text
from ehsid.harness.cli import cli
from ehsid.harness.diagnosis.result import Diagnosis, diagnosis_text
from ehsid.harness.diagnosis.schema import SUBSYSTEMS, read_diagnosis_file
from ehsid.harness.records import Record, read_record
from ehsid.harness.rigs import read_rig
from ehsid.harness.show.gap_page import simulation_table, write_diagnosis

# The page with its plots: test_gap_page.py, and the command for each verdict.
pytestmark = pytest.mark.usefixtures("no_plots")


def used_records() -> list[Record]:
    return [
        measured_record(name, seed, seconds=1.0, dt_s=5e-3)
        for seed, name in ((1, "fit"), (2, "held_out"))
    ]


def written(diagnosis: Diagnosis, folder: Path) -> dict[str, Any]:
    write_diagnosis(folder, diagnosis, used_records(), "bench.toml")
    found = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    assert isinstance(found, dict)
    return found


def numbers_in(value: Any) -> list[float]:
    if isinstance(value, dict):
        return [number for item in value.values() for number in numbers_in(item)]
    if isinstance(value, list):
        return [number for item in value for number in numbers_in(item)]
    return [value] if isinstance(value, float) else []


def check_interval(value: Any, name: str = "value") -> None:
    """A value with its interval, in order; all numbers or all None."""
    low, high = value["ci90"]
    if value[name] is None:
        assert (low, high) == (None, None)
    else:
        assert low <= value[name] <= high


def check_contract(plain: dict[str, Any]) -> None:
    """Keys and types as the contract fixes them; more keys are allowed."""
    assert plain["schema_version"] == 1
    assert plain["verdict"] in VERDICTS
    where, which, far = plain["where"], plain["which"], plain["how_far"]
    assert where["subsystem"] == {} or set(where["subsystem"]) == set(SUBSYSTEMS)
    assert where["subsystem"] == {} or math.isclose(sum(where["subsystem"].values()), 1.0)
    for regime in where["regimes"]:
        assert isinstance(regime["condition"], str)
        assert 0.0 <= regime["share_of_gap"] <= 1.0
        assert 0.0 <= regime["share_of_time"] <= 1.0
    for key, entries in (("band_hz", where["frequency"]), ("span_s", where["time"])):
        for entry in entries:
            low, high = entry[key]
            assert low < high
            assert isinstance(entry["share_of_gap"], float)
    for effect in which["effects"]:
        assert isinstance(effect["id"], str)
        assert 0.0 <= effect["probability"] <= 1.0
        assert isinstance(effect["share_of_shrinkage"], float)
        for size in effect["parameters"].values():
            check_interval(size)
    assert bool(which["missing_law"]) == (plain["verdict"] == "outside_catalogue")
    for law in which["missing_law"]:
        assert (law["adds_to"], law["of"]) == ("force", "velocity_m_s")
        assert len(law["knots"]) == len(law["values"]) == len(law["band90"]) == 8
        assert all(
            low <= value <= high
            for value, (low, high) in zip(law["values"], law["band90"], strict=True)
        )
        assert law["share_of_shrinkage"] == 1.0
        assert law["looks_like"].endswith("as Coulomb friction of 412 N")
    for group in which["ambiguity_set"]:
        assert all(isinstance(one, str) for one in group)
    for candidate in which["candidates"]:
        assert isinstance(candidate["effects"], list)
        assert isinstance(candidate["score"], float)
        assert isinstance(candidate["held_out_shrinkage"], float)
    for one in which["cannot_judge"]:
        assert isinstance(one["id"], str)
        assert isinstance(one["why"], str)
    for one in which["could_be_seen"]:
        assert one["limit"] in ("record", "least_size", "none")
        assert (one["size"] is None) == (one["limit"] == "none")
    coming = which["next_experiment"]
    assert coming is None or coming["record"] == "next_experiment.csv"
    assert coming is None or all(isinstance(one, str) for one in coming["separates"])
    assert coming is None or isinstance(coming["description"], str)
    for step in ("nominal", "calibrated", "augmented"):
        assert far[step] is None or far[step] >= 0.0
        assert all(isinstance(gaps[step], float) for gaps in far["per_output"].values())
    assert len(far["noise_floor"]) == 2
    for name in ("shrinkage_of_explainable", "shrinkage_from_nominal"):
        check_interval(far[name])
    for value in plain["calibration"].values():
        assert isinstance(value["rig"], float)
        check_interval(value, "found")
    provenance = plain["provenance"]
    assert provenance["ehsid_version"] == ehsid.__version__
    assert all({"file", "sha256"} <= set(record) for record in provenance["records"])
    assert {"window_s", "reset", "outputs_left_out"} <= set(provenance["settings"])
    assert isinstance(provenance["seconds"], float)


@pytest.mark.slow
@pytest.mark.parametrize("verdict", VERDICTS)
def test_json_keeps_the_contract_whatever_the_verdict(verdict: Any, tmp_path: Path) -> None:
    diagnosis = made_diagnosis(verdict)
    plain = written(diagnosis, tmp_path)
    check_contract(plain)
    assert all(math.isfinite(number) for number in numbers_in(plain))
    assert plain["verdict"] == verdict
    assert plain["sentence"] == diagnosis.sentence
    assert [effect["id"] for effect in plain["which"]["effects"]] == [
        effect.id for effect in diagnosis.effects
    ]
    assert set(plain["calibration"]) == set(diagnosis.calibration)
    assert [record["role"] for record in plain["provenance"]["records"]] == ["fit", "held out"]
    check_file(tmp_path / "diagnosis.json")


def test_what_was_written_is_read_back(tmp_path: Path) -> None:
    plain = written(made_diagnosis("ambiguous"), tmp_path)
    file = read_diagnosis_file(tmp_path / "diagnosis.json")
    assert json.loads(msgspec.json.encode(file)) == plain
    assert file.which.effects[0].parameters


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"schema_version": 2}, "schema_version"),
        ({"verdict": "perhaps"}, "verdict"),
        ({"which": {}}, r"\$.which"),
        ({"calibration": {"load.mass_kg": 1.0}}, r"\$.calibration"),
    ],
)
def test_another_file_is_refused_with_the_place(
    change: dict[str, Any], says: str, tmp_path: Path
) -> None:
    plain = written(made_diagnosis("effects"), tmp_path)
    path = tmp_path / "other.json"
    path.write_text(json.dumps(plain | change))
    with pytest.raises(ValueError, match=says) as refused:
        read_diagnosis_file(path)
    assert str(path) in str(refused.value)


def test_keys_of_others_are_left_alone_and_ours_may_lack(tmp_path: Path) -> None:
    """A file of the contract without what we add, with what somebody else does."""
    plain = written(made_diagnosis("effects"), tmp_path)
    for key in ("sentence", "reasons", "remarks"):
        del plain[key]
    del plain["which"]["outside_probability"]
    for candidate in plain["which"]["candidates"]:
        for key in ("left", "small", "probability", "price"):
            del candidate[key]
    plain["which"]["missing_law"] = []
    path = tmp_path / "other.json"
    path.write_text(json.dumps(plain))
    assert read_diagnosis_file(path).verdict == "effects"


def test_values_are_those_of_the_findings(tmp_path: Path) -> None:
    diagnosis = made_diagnosis("ambiguous")
    plain = written(diagnosis, tmp_path)
    assert plain["which"]["effects"][0]["parameters"]["force_n"] == {
        "value": 412.0,
        "ci90": [396.0, 431.0],
    }
    assert plain["which"]["ambiguity_set"] == [["coulomb_friction"], ["stribeck_friction"]]
    assert plain["which"]["outside_probability"] == diagnosis.outside_probability
    for written_one, one in zip(plain["which"]["candidates"], diagnosis.candidates, strict=True):
        for name in ("left", "small", "probability", "price"):
            assert written_one[name] == getattr(one, name)
    assert plain["calibration"]["load.mass_kg"] == {
        "rig": 120.0,
        "found": 131.0,
        "ci90": [129.5, 132.6],
        "moved": True,
    }
    far = diagnosis.how_far
    assert far is not None
    assert plain["how_far"]["noise_floor"] == list(far.noise_floor)
    assert plain["where"]["regimes"][0]["share_of_gap"] == 0.63
    assert plain["provenance"]["settings"]["outputs_left_out"] == ["supply_pressure_pa"]


def nrmse(path: Path, output: str, kind: str) -> float:
    """The contract's figure, from the file alone: rms(e) / rms(m minus its mean in the window)."""
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
    measured, simulated = table[f"{output}_measured"], table[f"{output}_{kind}"]
    spread = np.concatenate(
        [
            measured[mine] - measured[mine].mean()
            for record in np.unique(table["record"])
            for window in np.unique(table["window"])
            if (mine := (table["record"] == record) & (table["window"] == window)).any()
        ]
    )
    return float(np.sqrt(np.mean((simulated - measured) ** 2) / np.mean(spread**2)))


@pytest.mark.slow
def test_gap_can_be_recomputed_from_the_simulation_file(tmp_path: Path) -> None:
    plain = written(made_diagnosis("effects"), tmp_path)
    gaps: dict[str, list[float]] = {"nominal": [], "calibrated": [], "augmented": []}
    for output, told in plain["how_far"]["per_output"].items():
        for kind, found in gaps.items():
            found.append(nrmse(tmp_path / "simulation.csv", output, kind))
            # Nine digits of a pressure of 1e7 Pa are 0.01 Pa, of an error of 1e4 Pa 1e-6.
            assert found[-1] == pytest.approx(told[kind], rel=1e-5)
    for kind, found in gaps.items():
        assert plain["how_far"][kind] == pytest.approx(np.mean(found), rel=1e-5)


def test_simulation_file_holds_samples_in_windows_only() -> None:
    diagnosis = made_diagnosis("effects")
    table = simulation_table(diagnosis.runs)
    run = diagnosis.runs[0]
    assert [*table][:3] == ["record", "time_s", "window"]
    rows = np.count_nonzero(run.window >= 0)
    assert {values.size for values in table.values()} == {rows}
    assert rows < run.window.size
    assert table["time_s"].min() == pytest.approx(0.3)
    assert ",," not in csv_text(table)


def test_outputs_that_a_record_lacks_are_empty() -> None:
    run = made_diagnosis("effects").runs[0]
    position = {"position_m"}
    kinds = ("measured", "nominal", "calibrated", "augmented")
    less = {kind: {n: v for n, v in getattr(run, kind).items() if n in position} for kind in kinds}
    table = simulation_table([run, replace(run, record="other", **less)])
    other = table["record"] == "other"
    assert np.isnan(table["pressure_a_pa_measured"][other]).all()
    assert not np.isnan(table["position_m_augmented"]).any()
    assert csv_text(table).splitlines()[-1].count(",,") > 0


@pytest.mark.slow
@pytest.mark.parametrize("verdict", ["effects", "no_gap"])
def test_augmented_rig_runs_as_it_is(verdict: Any, tmp_path: Path) -> None:
    diagnosis = made_diagnosis(verdict)
    written(diagnosis, tmp_path)
    path = tmp_path / "rig.augmented.toml"
    assert dict(read_rig(path).values) == dict(diagnosis.augmented_rig.values)
    arguments = ["--excitation", "steps", "--duration", "0.5", "--dt", "0.002"]
    outcome = CliRunner().invoke(cli, ["simulate", str(path), *arguments])
    assert outcome.exit_code == 0, outcome.output


@pytest.mark.slow
def test_next_experiment_drives_the_augmented_rig(tmp_path: Path) -> None:
    written(made_diagnosis("ambiguous"), tmp_path)
    record = read_record(tmp_path / "next_experiment.csv")
    assert record.dt_s == pytest.approx(2e-3)
    arguments = ["--command", str(tmp_path / "next_experiment.csv")]
    outcome = CliRunner().invoke(
        cli, ["simulate", str(tmp_path / "rig.augmented.toml"), *arguments]
    )
    assert outcome.exit_code == 0, outcome.output


def test_what_was_not_weighed_has_no_probability(tmp_path: Path) -> None:
    diagnosis = made_diagnosis("effects")
    first, *others = diagnosis.candidates
    screened = replace_part(first, left=None, small=None, probability=None)
    unweighed = replace(diagnosis, candidates=(screened, *others), outside_probability=None)
    which = written(unweighed, tmp_path)["which"]
    assert which["outside_probability"] is None
    assert [which["candidates"][0][key] for key in ("left", "small", "probability")] == [None] * 3
    check_file(tmp_path / "diagnosis.json")


def test_source_files_are_told_with_their_hash() -> None:
    records = [
        replace(record, sha256="ab" * 32, source=Path(f"data/{record.name}.csv"))
        for record in used_records()
    ]
    plain = json.loads(diagnosis_text(made_diagnosis("effects"), records, "bench.toml"))
    assert plain["provenance"]["records"][0] == {
        "file": str(Path("data/fit.csv")),
        "sha256": "ab" * 32,
        "role": "fit",
    }

# SPDX-License-Identifier: MIT
import json
import logging
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_stand_in import FakeDiagnose
from made_diagnoses import bench, made_diagnosis, measured_record

import ehsid
from ehsid.harness import diagnosis as gap
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.schema import Verdict
from ehsid.harness.records import write_record
from ehsid.harness.rigs import write_rig
from ehsid.harness.show.gap_page import simulation_table


@pytest.fixture
def fake(monkeypatch: pytest.MonkeyPatch) -> FakeDiagnose:
    made = FakeDiagnose(made_diagnosis("effects"))
    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", made)
    return made


def made(verdict: Verdict) -> ehsid.Diagnosis:
    record = measured_record("held_out", 2, seconds=4.3, dt_s=2e-3)
    return ehsid.Diagnosis(made_diagnosis(verdict), [record], ehsid.Rig(bench()))


def test_sizes_of_effects_stand_in_the_diagnosis_itself() -> None:
    found = made("effects")
    expected = {one.id: one.parameters for one in found.result.effects}
    assert expected
    assert found.effects == expected
    size = found.effects["coulomb_friction"]["force_n"]
    assert size.low < size.value < size.high


@pytest.mark.parametrize(("wrong", "meant"), [("exlude", "exclude"), ("validated", "validate")])
def test_a_misspelt_argument_names_the_function_and_the_nearest_one(wrong: str, meant: str) -> None:
    with pytest.raises(TypeError) as told:
        ehsid.diagnose([], ehsid.Rig(bench()), **{wrong: ["leakage"]})  # type: ignore[arg-type]
    assert str(told.value) == f"diagnose() has no argument '{wrong}': did you mean '{meant}'?"
    with pytest.raises(TypeError, match=r"argument 'zzzz': expected one of effort, exclude, "):
        ehsid.diagnose([], ehsid.Rig(bench()), zzzz=1)  # type: ignore[call-arg]


@pytest.mark.slow
def test_a_change_of_the_machine_is_what_was_named_or_not() -> None:
    """The friction of the made diagnosis is still there in its own record."""
    found = made("effects")
    told = found.edit_test(found.records[0])
    assert (told.outcome, told.edits[0].effects) == ("not_it", ("coulomb_friction",))
    half = found.edit_test([found.records[0]], {"coulomb_friction": 0.5})
    assert half.edits[0].share == (0.5,)
    assert told.found < half.edits[0].gap < told.edits[0].gap
    with pytest.raises(ValueError, match=r"effect 'load_force'.*does not name it"):
        found.edit_test(found.records, {"load_force": 0.0})


@pytest.mark.thorough
def test_a_diagnosis_is_that_of_the_room() -> None:
    """A short record whose cause is known: all but one effect are excluded, for speed."""
    record = measured_record("run", 1, seconds=6.0, dt_s=2e-3)
    excluded = [one.id for one in ehsid.effects() if one.id != "coulomb_friction"]
    expected = gap.diagnose([record], bench(), options=DiagnosisOptions(excluded))
    found = ehsid.diagnose(record, bench(), exclude=excluded, progress=False)
    assert found.verdict == expected.verdict == "effects"
    assert found.result.how_far == expected.how_far
    assert found.result.effects == expected.effects
    assert dict(found.augmented_rig.values) == dict(expected.augmented_rig.values)


def test_records_and_rigs_of_every_kind_reach_the_diagnosis(
    fake: FakeDiagnose, tmp_path: Path
) -> None:
    run, other = (measured_record(n, i, seconds=1.0, dt_s=2e-3) for i, n in enumerate("ab"))
    write_record(run, tmp_path / "run.csv")
    write_rig(bench(), tmp_path / "rig.toml")
    found = ehsid.diagnose(
        [tmp_path / "run.csv", ehsid.Record(other)],
        tmp_path / "rig.toml",
        validate=ehsid.read({"time_s": run.time_s, **run.columns} | {"spool": run.time_s}),
        exclude=["valve_lag", "valve_lag"],
        workers=1,
    )
    assert fake.asked.fitted == ["run", "b"]
    assert fake.asked.held_out == ["record"]
    assert all(
        {"command_v", "position_m"} <= set(record.columns)
        for record in (*fake.asked.records, *fake.asked.validate)
    )
    assert fake.asked.options == DiagnosisOptions(("valve_lag",))
    assert fake.asked.workers == 1
    assert dict(fake.asked.rig.values) == dict(bench().values)
    assert [record.name for record in found.records] == ["run", "b", "record"]


def test_progress_goes_to_the_logger_where_no_terminal_is(
    fake: FakeDiagnose, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ehsid.harness.api.wording.LINE_EVERY_S", 0.0)
    record = measured_record("run", 1, seconds=1.0, dt_s=2e-3)
    with caplog.at_level(logging.INFO, logger="ehsid"):
        ehsid.diagnose(record, bench())
    lines = [one.getMessage() for one in caplog.records if one.name == "ehsid"]
    assert lines[0] == "diagnosing bench: begins"
    assert lines[1].startswith("diagnosing bench: 50 %, ")
    assert lines[2].startswith("diagnosing bench: done after ")
    caplog.clear()
    ehsid.diagnose(record, bench(), progress=False)
    assert fake.asked.progress is None
    assert not caplog.records


def test_a_terminal_shows_a_bar(
    fake: FakeDiagnose, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    record = measured_record("run", 1, seconds=1.0, dt_s=2e-3)
    hostile = replace(bench(), name="[red]rig\x1b[2J")
    ehsid.diagnose(record, hostile)
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "\x1b[2J" not in shown.err
    assert fake.asked.progress is not None


@pytest.mark.slow
def test_saved_files_are_those_of_the_command(tmp_path: Path, no_plots: None) -> None:
    found = made("ambiguous")
    folder = found.save(tmp_path / "out")
    names = {path.name for path in folder.iterdir()}
    assert names == {
        *(".ehsid", "diagnosis.json", "next_experiment.csv", "report.html"),
        *("rig.augmented.toml", "simulation.csv"),
    }
    told = json.loads((folder / "diagnosis.json").read_text())
    assert told["verdict"] == "ambiguous"
    again = ehsid.Rig.read(folder / "rig.augmented.toml")
    assert dict(again.values) == dict(found.augmented_rig.values)


def test_the_summary_says_what_the_command_prints() -> None:
    told = made("effects").summary()
    assert made_diagnosis("effects").sentence in told
    assert "gap on held-out data" in told
    assert "Coulomb friction" in told


def test_frames_have_the_simulations() -> None:
    found = made("effects")
    expected = simulation_table(found.result.runs)
    assert found.to_polars().columns == [*expected]
    assert np.array_equal(found.to_polars()["position_m_nominal"], expected["position_m_nominal"])
    frame = found.to_pandas()
    assert [*frame.columns] == [*expected]
    assert np.array_equal(frame["position_m_augmented"], expected["position_m_augmented"])


def test_data_that_carry_no_diagnosis_have_no_picture() -> None:
    rig = ehsid.Rig(bench())
    run = ehsid.simulate(rig, "triangle", duration_s=0.1)
    found = ehsid.diagnose(run.record, rig, progress=False)
    assert found.verdict == "insufficient_data"
    assert found.sentence in found.summary()
    with pytest.raises(ValueError, match="no simulation to draw"):
        found.plot()


def test_what_the_diagnosis_cannot_use_is_refused(tmp_path: Path) -> None:
    record = measured_record("run", 1, seconds=1.0, dt_s=2e-3)
    with pytest.raises(ValueError, match=r"exclude 'valve_lg'.*'valve_lag'"):
        ehsid.diagnose(record, bench(), exclude=["valve_lg"])
    with pytest.raises(ValueError, match="run: the same data as run"):
        ehsid.diagnose(record, bench(), validate=[record])
    other = measured_record("run", 2, seconds=1.0, dt_s=2e-3)
    with pytest.raises(ValueError, match="run and run: both are called 'run'"):
        ehsid.diagnose(record, bench(), validate=other)
    with pytest.raises(ValueError, match=r"none\.csv: there is no such file"):
        ehsid.diagnose(tmp_path / "none.csv", bench())
    with pytest.raises(ValueError, match="needs a record"):
        ehsid.diagnose([], bench(), progress=False)

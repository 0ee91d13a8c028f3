# SPDX-License-Identifier: MIT
"""Realised shrinkage against numpy on another way to simulate windows."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gap_cases import RIG, record
from made_checks import made_answers, perfect, write_check
from windowed_runs import simulate_windows

from ehsid.harness.base.parallel import workers
from ehsid.harness.diagnosis.schema import Estimate
from ehsid.harness.diagnosis.search.candidates import DECISION_SUBSTEPS
from ehsid.harness.records import write_record
from ehsid.harness.rigs import Rig, write_rig
from ehsid.lab.scoring.baselines import independent_samples, promises, realised, without
from ehsid.lab.scoring.findings import Findings, NamedEffect
from ehsid.lab.scoring.score import score_folder

FRICTION = {"effects.coulomb_friction.force_n": 900.0}
OUTPUTS = ("position_m", "pressure_a_pa")
SAID = Findings(
    "effects",
    (NamedEffect("coulomb_friction", 0.97),),
    of_explainable=Estimate(0.97, 0.94, 0.99),
    from_nominal=Estimate(0.9, 0.8, 0.95),
    settings={"window_s": 0.5, "reset": "carry", "outputs": list(OUTPUTS)},
)
THIRD = record(FRICTION, 3, OUTPUTS, seconds=4.0)
FOUND = RIG.with_values(FRICTION)


def test_the_true_rig_closes_the_gap() -> None:
    found = realised(RIG, FOUND, THIRD, SAID)
    assert found is not None
    # What is left is noise, which the floor holds to a few per cent of it, and steps of
    # integration that the record does not have.
    assert found.of_explainable is not None
    assert found.of_explainable.value == pytest.approx(1.0, abs=0.02)
    assert found.from_nominal.value > 0.9
    assert found.from_nominal.low <= found.from_nominal.value <= found.from_nominal.high


def test_gaps_are_those_of_the_contract() -> None:
    found = realised(RIG, FOUND, THIRD, SAID)
    assert found is not None
    runs = simulate_windows(
        RIG,
        THIRD,
        value_sets=({}, FRICTION),
        substeps=DECISION_SUBSTEPS,
    )
    inside = runs.window >= 0
    gaps = []
    for which in range(2):
        nrmse = []
        for name in OUTPUTS:
            measured = THIRD.column(name)
            error = (runs.outputs[name][which] - measured)[inside]
            about_mean = np.concatenate(
                [
                    measured[runs.window == k] - measured[runs.window == k].mean()
                    for k in range(runs.window.max() + 1)
                ]
            )
            nrmse.append(np.sqrt(np.mean(error**2) / np.mean(about_mean**2)))
        gaps.append(float(np.mean(nrmse)))
    # Positions at the start of a window are smoothed in one and as measured in the other: they
    # differ by the noise of the sensor, which is in the smaller gap to its full size.
    assert found.nominal == pytest.approx(gaps[0], rel=0.02)
    assert found.augmented == pytest.approx(gaps[1], rel=0.2)
    shrunk = (found.nominal - found.augmented) / found.nominal
    assert found.from_nominal.value == pytest.approx(shrunk)


def test_a_wrong_rig_keeps_the_gap() -> None:
    wrong = RIG.with_values({"effects.valve_null_bias.offset": 0.03})
    said = replace(SAID, named=(NamedEffect("valve_null_bias", 0.9),))
    found = realised(RIG, wrong, THIRD, said)
    assert found is not None
    assert found.from_nominal.value < 0.1


def test_without_effects_there_is_nothing_explained() -> None:
    found = realised(RIG, RIG, THIRD, replace(SAID, verdict="no_gap", named=()))
    assert found is not None
    assert found.of_explainable is None
    assert found.from_nominal.value == 0.0


def test_nothing_in_common_is_not_compared() -> None:
    only = replace(SAID, settings={**SAID.settings, "outputs": ["spool"]})
    assert realised(RIG, FOUND, THIRD, only) is None


def test_effects_that_the_rig_tells_stay() -> None:
    told = RIG.with_values(
        {"effects.valve_lag.bandwidth_hz": 70.0, "effects.valve_lag.damping": 0.8}
    )
    found = told.with_values({"effects.valve_lag.bandwidth_hz": 60.0, **FRICTION})
    bare = without(found, told, ["coulomb_friction"])
    assert bare.effects() == ("valve_lag",)
    assert bare.values["effects.valve_lag.bandwidth_hz"] == 60.0


@pytest.mark.slow
@pytest.mark.parametrize("processes", [1, pytest.param(2, marks=pytest.mark.thorough)])
def test_a_check_with_a_third_record(processes: int, tmp_path: Path) -> None:
    answers = {n: one for n, one in made_answers(20).items() if one["kind"] == "one"}
    name = next(iter(answers))
    answers = {name: {**answers[name], "effects": {"coulomb_friction": {"force_n": 900.0}}}}
    write_check(tmp_path, answers, perfect)
    write_files(tmp_path, name, FOUND)
    with workers(processes):
        (case,) = score_folder(tmp_path).cases
    assert case.transfer is not None
    assert case.transfer.of_explainable is not None
    explainable, nominal = promises([case])
    assert [one.case for one in explainable.each] == [name]
    assert nominal.each[0].realised == case.transfer.from_nominal
    # 4 s of one output
    assert independent_samples(tmp_path, name, case.findings) == pytest.approx(20.0 * 4.0, rel=0.01)


def test_a_third_record_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    answers = made_answers(1)
    name = next(iter(answers))
    write_check(tmp_path, answers, perfect)
    write_files(tmp_path, name, RIG)
    (tmp_path / "transfer" / f"{name}.csv").write_text("time_s,command_v\n0,0\n0.1,0\n")
    with pytest.raises(ValueError, match=f"case {name}: .*position_m"):
        score_folder(tmp_path)


def write_files(out: Path, name: str, found: Rig) -> None:
    for folder in ("cases", "transfer", "results"):
        (out / folder / name).mkdir(parents=True, exist_ok=True)
    write_rig(RIG, out / "cases" / name / "rig.toml")
    write_record(THIRD, out / "cases" / name / "train.csv")
    write_record(THIRD, out / "transfer" / f"{name}.csv")
    write_rig(found, out / "results" / name / "rig.augmented.toml")

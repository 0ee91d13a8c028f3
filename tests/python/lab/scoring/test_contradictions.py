# SPDX-License-Identifier: MIT
"""Each rule is broken by one change of a diagnosis that breaks none."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from made_checks import diagnosis, made_answers, perfect, write_check

from ehsid.harness.diagnosis.schema import DiagnosisFile, read_number
from ehsid.harness.show.page import Table
from ehsid.lab.pages.check_page import check_page
from ehsid.lab.pages.check_words import lead
from ehsid.lab.scoring.contradictions import contradictions
from ehsid.lab.scoring.score import score_file, score_folder

Plain = dict[str, Any]
REASON = (
    "The set with the smallest errors on held-out data, load spring, is not named: load spring of "
    "this size is part of every servo."
)


def candidate(effects: list[str], score: float, share: float, standing: str, why: str) -> Plain:
    return {
        "effects": effects,
        "score": score,
        "held_out_shrinkage": share,
        "in_confidence_set": standing in ("named", "sufficient", "equivalent"),
        "standing": standing,
        "why": why,
        "probability": {"named": 0.97, "too_small": None}.get(standing, 0.01),
    }


def consistent() -> Plain:
    """A diagnosis that names friction; a spring that is too small comes before it."""
    plain = diagnosis(
        "effects",
        {"coulomb_friction": {"force_n": 400.0}},
        candidates=[
            candidate(["load_spring"], 0.0, 0.96, "too_small", "of this size"),
            candidate(["coulomb_friction"], 2.0, 0.95, "named", ""),
            candidate([], 900.0, 0.0, "worse", "its errors are larger"),
        ],
        calibration={"load.mass_kg": {"rig": 1.0, "found": 1.1, "ci90": [1.0, 1.2]}},
        shrinkage=0.95,
        subsystem="mechanics",
    )
    plain["sentence"] = "The gap is due to Coulomb friction."
    plain["reasons"] = [REASON]
    return plain


def read(plain: Plain) -> DiagnosisFile:
    return msgspec.convert(plain, DiagnosisFile, strict=False, dec_hook=read_number)


def nothing_named(plain: Plain) -> None:
    """Nothing is named, although a spring explains much and no sentence says why."""
    plain["verdict"] = "no_gap"
    plain["which"] |= {"effects": [], "ambiguity_set": []}
    _, friction, none = plain["which"]["candidates"]
    friction |= {"standing": "not_needed", "why": "why", "in_confidence_set": False}
    none |= {"standing": "sufficient", "why": "", "in_confidence_set": True}
    plain["reasons"] = ["The set with the smallest errors on held-out data is another one."]


def sufficient(plain: Plain) -> None:
    """The same said of values, and with little probability; 16 % are taken to 8 %."""
    nothing_named(plain)
    plain["sentence"] = "No effect is missing."
    plain["which"]["candidates"][2]["probability"] = 0.1


EXPERIMENT = {
    "separates": ["coulomb_friction", "load_spring"],
    "record": "next_experiment.csv",
    "description": "slow triangle",
}
BROKEN: dict[str, Callable[[Plain], Any]] = {
    "exactly one set is named or sufficient, and it is the one of the verdict": lambda plain: plain[
        "which"
    ]["candidates"][2].update(standing="sufficient", in_confidence_set=True),
    "sets are marked exactly if their standing is in the set": lambda plain: plain["which"][
        "candidates"
    ][1].update(in_confidence_set=False),
    "the ambiguity set holds the marked sets": lambda plain: plain["which"].update(
        ambiguity_set=[["load_force"]]
    ),
    "candidates are in the order of their scores": lambda plain: plain["which"]["candidates"][
        1
    ].update(score=901.0),
    "each set that is not in the set has a reason": lambda plain: plain["which"]["candidates"][
        2
    ].update(why=""),
    "a first candidate that is not in the set is explained": lambda plain: plain.update(reasons=[]),
    "a set that explains much is named or explained": nothing_named,
    "the verdict is ambiguous where families differ": lambda plain: plain.update(
        verdict="ambiguous"
    ),
    "the share that is removed is that of the named set": lambda plain: plain["which"][
        "candidates"
    ][1].update(held_out_shrinkage=0.5),
    "a worse calibration is said": lambda plain: plain["how_far"].update(calibrated=0.3),
    "values that moved are said where the verdict rests on them": lambda plain: (
        plain.update(verdict="parameters"),
        plain["how_far"].update(nominal=0.02),
    ),
    "no gap is told near the floor only, or where nothing makes it smaller": nothing_named,
    "a gap that stays above the floor is said": lambda plain: plain["how_far"].update(
        augmented=0.04
    ),
    "an open cause is said": lambda plain: plain["which"]["candidates"][1].update(probability=0.5),
    "no effect is called missing only where none is probable and no gap stays": sufficient,
    "a named effect could be judged": lambda plain: plain["which"].update(
        cannot_judge=[{"id": "coulomb_friction", "why": "the rod does not turn"}]
    ),
    "the part of the machine of each named effect has a share": lambda plain: plain["where"].update(
        subsystem={"valve": 1.0, "mechanics": 0.0}
    ),
    "an experiment is designed only where it tells something": lambda plain: plain["which"].update(
        next_experiment=EXPERIMENT
    ),
    "values that moved are no nuisances": lambda plain: plain["calibration"].update(
        {
            "nuisance.presliding_m": {
                "rig": 2e-5,
                "found": 4e-5,
                "ci90": [3e-5, 5e-5],
                "moved": True,
            }
        }
    ),
}


def test_a_consistent_diagnosis_breaks_no_rule() -> None:
    assert contradictions(read(consistent())) == ()


@pytest.mark.parametrize("rule", BROKEN)
def test_each_rule_is_broken_by_its_own_change(rule: str) -> None:
    plain = copy.deepcopy(consistent())
    BROKEN[rule](plain)
    assert rule in contradictions(read(plain))


def test_data_that_cannot_carry_a_diagnosis_need_a_reason() -> None:
    plain = diagnosis("insufficient_data")
    assert contradictions(read(plain)) == ("data that cannot carry a diagnosis have a reason",)
    plain["reasons"] = ["The record is too short."]
    assert contradictions(read(plain)) == ()


def test_candidates_of_another_program_are_not_judged_by_our_rules() -> None:
    plain = consistent()
    for each in plain["which"]["candidates"]:
        del each["standing"]
    plain["reasons"] = []
    assert contradictions(read(plain)) == ()


@pytest.mark.slow
@pytest.mark.parametrize("broken", [False, True])
def test_a_check_reports_the_cases_that_contradict_themselves(tmp_path: Path, broken: bool) -> None:
    def made(answer: Plain, rng: np.random.Generator) -> Plain:
        if answer["kind"] != "one":
            return perfect(answer, rng)
        plain = consistent()
        if broken:
            plain["reasons"] = []
        return plain

    answers = made_answers(6, seed=3)
    of_one = sorted(name for name, answer in answers.items() if answer["kind"] == "one")
    assert of_one
    score = score_folder(write_check(tmp_path, answers, made))
    rule = "a first candidate that is not in the set is explained"
    found = [(case.name, case.rules) for case in score_file(score).contradictions]
    assert found == ([(name, (rule,)) for name in of_one] if broken else [])
    (section,) = (
        each for each in check_page(score).sections if each.title.startswith("Does a diagnosis")
    )
    (block,) = section.blocks
    if broken:
        assert isinstance(block, Table)
        assert [tuple(row) for row in block.rows] == [(name, rule) for name in of_one]
    else:
        assert block == "No: all statements of each diagnosis agree with each other."
    assert any("contradict each other" in sentence for sentence in lead(score)) == broken

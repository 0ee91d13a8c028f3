# SPDX-License-Identifier: MIT
"""The edit test of a check: right names and wrong ones on a machine whose edit is known."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from gap_cases import OFF, PRESSURES, RIG, record
from made_checks import diagnosis, made_answers, perfect, write_check
from published_schemas import check_file
from scored_cases import BAND, LAG, case, findings

from ehsid.harness.records import write_record
from ehsid.harness.rigs import write_rig
from ehsid.lab.pages.check_page import write_page
from ehsid.lab.scoring.edits import edit_figures, edits_of, separation
from ehsid.lab.scoring.findings import read_findings
from ehsid.lab.scoring.judging import Edited
from ehsid.lab.scoring.score import score_folder

BIAS = {"effects.valve_null_bias.offset": 0.03}
FORCE = {"effects.load_force.force_n": 300.0}


@pytest.fixture
def check(tmp_path: Path) -> Path:
    """A check with one machine, whose null bias was found, beside a force that it does not have."""
    found = tmp_path / "results" / "one"
    found.mkdir(parents=True)
    named = {"valve_null_bias": {"offset": 0.03}, "load_force": {"force_n": 300.0}}
    told = diagnosis("effects", named)
    told["provenance"]["settings"]["outputs"] = list(PRESSURES)
    told["how_far"]["augmented"] = 0.013
    (found / "diagnosis.json").write_text(json.dumps(told))
    write_rig(RIG.with_values({**OFF, **BIAS, **FORCE}), found / "rig.augmented.toml")
    (tmp_path / "edited" / "one").mkdir(parents=True)
    for edit, share in (("removed", 0.0), ("halved", 0.5)):
        values = {name: share * size for name, size in BIAS.items()}
        write_record(record({**OFF, **values}, 7), tmp_path / "edited" / "one" / f"{edit}.csv")
    return tmp_path


@pytest.mark.slow
def test_gaps_are_those_of_the_rig_with_what_was_named_edited(check: Path) -> None:
    """Without both effects the rig is the machine; with half of the force it is not."""
    result = read_findings(check / "results" / "one")
    assert result is not None
    removed, halved = edits_of(check, "one", result)
    assert (removed.edit, removed.own, halved.edit) == ("removed", 0.013, "halved")
    assert removed.edited < 0.02
    assert removed.found > 5.0 * removed.edited
    assert removed.left is not None
    assert removed.left.low == 0.0
    assert halved.edited > 2.0 * halved.own
    assert not edits_of(check, "two", result)
    assert not edits_of(check, "one", replace(result, named=()))


def test_right_names_and_others_are_told_apart() -> None:
    cases = []
    for number in range(6):
        named = BAND if number < 4 else LAG
        gap = 0.01 * (1.0 + number)
        edits = tuple(Edited("a", edit, 0.01, 0.2, gap, None) for edit in ("removed", "halved"))
        cases.append(replace(case(findings(named), BAND), edits=edits))
    cases.append(replace(case(findings(BAND), "warming_oil", kind="open"), edits=()))
    removed, halved = edit_figures(cases)
    assert (removed.edit, halved.edit, len(removed.each)) == ("removed", "halved", 6)
    values = {figure.words: figure.value for figure in removed.figures}
    assert values["right names: edited over own gap before, median"] == pytest.approx(2.5)
    assert values["other names: unedited over edited, median"] == pytest.approx(
        0.5 * (4.0 + 10.0 / 3.0)
    )
    assert values["right names: the edited rig is the better one"] == 1.0
    assert values["right names: at most 3 times its own gap"] == 0.75
    assert [figure.value for figure in removed.figures[-2:]] == [1.0, 1.0]
    assert not edit_figures([])


def test_the_separation_is_the_area_under_the_curve() -> None:
    """For two normal distributions one deviation apart it is Phi(1 / sqrt(2))."""
    rng = np.random.default_rng(4)
    found = separation("", rng.normal(0.0, 1.0, 300).tolist(), rng.normal(1.0, 1.0, 300).tolist())
    assert found.value == pytest.approx(0.7602, abs=0.06)
    # Its standard error is 0.0193 (eq. 1 of Hanley, McNeil).
    assert found.high - found.low == pytest.approx(3.29 * 0.0193, rel=0.15)
    assert separation("", [1.0, 2.0], [1.0, 2.0]).value == 0.5
    assert separation("", [], [1.0]).n == 0


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_the_page_has_them_and_a_check_without_them_is_scored(tmp_path: Path) -> None:
    score = score_folder(write_check(tmp_path, made_answers(6), perfect))
    assert score.edits == ()
    edits = tuple(Edited("a1", edit, 0.01, 0.2, 0.02, None) for edit in ("removed", "halved"))
    figures = edit_figures([replace(case(findings(BAND), BAND), edits=edits)])
    for made, told in ((score, False), (replace(score, edits=figures), True)):
        cases = [replace(score.cases[0], name="a1"), *score.cases[1:]]
        write_page(replace(made, cases=tuple(cases)), tmp_path)
        assert ("causes are taken away" in (tmp_path / "check.md").read_text("utf-8")) == told
        check_file(tmp_path / "score.json")

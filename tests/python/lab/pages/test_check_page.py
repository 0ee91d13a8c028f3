# SPDX-License-Identifier: MIT
"""The page of a check: whole, offline, the same figures in each of its forms."""

import json
import re
from pathlib import Path

import pytest
from made_checks import fair, made_answers, write_check
from published_schemas import check_file

from ehsid.harness.show.page import Page, Picture, Section, Table
from ehsid.harness.show.rendering import markdown
from ehsid.lab.pages.check_page import check_page, write_page
from ehsid.lab.pages.check_words import figure_text, lead, number, target_text
from ehsid.lab.scoring.score import Score, score_cases, score_folder

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blank_pictures")]


@pytest.fixture(scope="module")
def score(tmp_path_factory: pytest.TempPathFactory) -> Score:
    return score_folder(write_check(tmp_path_factory.mktemp("page"), made_answers(40), fair))


@pytest.fixture(scope="module")
def written(score: Score, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("out")
    write_page(score, out)
    return out


def test_the_files_are_there_and_whole(written: Path) -> None:
    names = {path.name for path in written.iterdir()}
    assert {"report.html", "score.json", "check.md"} <= names
    assert not [name for name in names if name.endswith(".part")]
    for path in written.glob("*.png"):
        assert path.read_bytes().startswith(b"\x89PNG")


def test_the_page_works_offline(written: Path) -> None:
    html = (written / "report.html").read_text(encoding="utf-8")
    assert not re.findall(r'(?:src|href)="(?!data:|#)[^"]*"', html)
    assert html.count("<img") == len(list(written.glob("*.png")))


def test_the_json_has_every_case_and_only_finite_numbers(written: Path, score: Score) -> None:
    text = (written / "score.json").read_text(encoding="utf-8")
    assert "NaN" not in text
    assert "Infinity" not in text
    check_file(written / "score.json")
    plain = json.loads(text)
    assert [one["name"] for one in plain["cases"]] == [case.name for case in score.cases]
    assert len(plain["wrong"]) == len(score.wrong)
    figure = plain["tables"][0]["columns"]["pressures"][0]
    ours = score.tables[0].columns["pressures"][0]
    assert (figure["value"], figure["n"]) == (ours.value, ours.n)
    assert figure["target"] == {"least": 0.97, "most": None}


def test_the_markdown_has_the_same_tables_and_its_pictures_exist(
    written: Path, score: Score
) -> None:
    text = (written / "check.md").read_text(encoding="utf-8")
    pictures = re.findall(r"!\[[^]]+\]\(([^)]+)\)", text)
    assert sorted(pictures) == sorted(path.name for path in written.glob("*.png"))
    for case in score.wrong:
        assert f"| {case.name} |" in text
    for one in score.tables[0].columns["pressures"]:
        assert f"| {one.words} | {figure_text(one)} |" in text
    for line in text.splitlines():
        assert "/tmp" not in line


def test_every_table_is_rectangular(score: Score) -> None:
    for section in check_page(score).sections:
        for block in section.blocks:
            if isinstance(block, Table):
                assert {len(row) for row in block.rows} <= {len(block.columns)}, block.caption


def test_the_lead_tells_how_far_to_trust(score: Score) -> None:
    right = sum(case.judgement.right for case in score.cases)
    text = " ".join(lead(score))
    assert f"Of 40 records whose cause was withheld, {right} " in text
    assert "Negative control" in text
    assert "SEAL" not in text


def test_a_broken_seal_and_unfinished_cases_are_told(score: Score) -> None:
    text = " ".join(lead(score_cases(score.cases, unfinished=["a"], sealed=False)))
    assert "THE SEAL IS BROKEN" in text
    assert "1 record not yet diagnosed" in text


def test_an_empty_check_has_a_page(tmp_path: Path) -> None:
    write_page(score_cases([]), tmp_path)
    check_file(tmp_path / "score.json")
    assert "there is nothing to score" in (tmp_path / "report.html").read_text(encoding="utf-8")


def test_numbers_and_targets_in_words(score: Score) -> None:
    assert number(0.9687, "share") == "97\N{NO-BREAK SPACE}%"
    assert number(float("nan"), "share") == "-"
    assert number(12.04, "seconds") == "12 s"
    figures = {one.words: one for one in score.tables[0].columns["position only"]}
    texts = {words: target_text(one.target, one.unit) for words, one in figures.items()}
    assert texts["subsystem first"] == "≥ 92\N{NO-BREAK SPACE}%"
    assert texts["sets returned, mean"] == "≤ 2"
    assert texts["sizes inside their intervals"] == "85–95\N{NO-BREAK SPACE}%"
    assert texts["effect first, all"] == ""


def test_markdown_of_a_page() -> None:
    page = Page("T", ["lead"], [Section("S", ["w", Table("c", ("a", "b"), [("x|y", "1")])])])
    assert markdown(page, []) == (
        "# T\n\nlead\n\n## S\n\nw\n\nc\n\n| a | b |\n| --- | --- |\n| x\\|y | 1 |\n"
    )


def test_pictures_are_there_for_those_who_cannot_see_them(score: Score) -> None:
    page = check_page(score)
    blocks = [*page.summary, *(block for one in page.sections for block in one.blocks)]
    assert isinstance(blocks[0], Picture)
    pictures = [block for block in blocks if isinstance(block, Picture)]
    assert len(pictures) >= 5
    assert all(one.alt and one.caption for one in pictures)

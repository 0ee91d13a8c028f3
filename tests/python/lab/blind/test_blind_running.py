# SPDX-License-Identifier: MIT
"""A check is made and sealed once and runs case by case; a kill loses only unfinished cases."""

import json
import os
import pickle
import shutil
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from check_runs import TINY, StandIn, tiny_check
from published_schemas import check_file

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.parallel import workers
from ehsid.harness.diagnosis.job import ERROR, Outcome, keep
from ehsid.lab.blind.making import GRADES, SENSORS, Settings, make_check, read_seal, verify
from ehsid.lab.blind.running import read_case, run_check, unfinished_cases
from ehsid.lab.reality import variants
from ehsid.lab.reality.case import COLUMNS
from ehsid.lab.reality.effects import CATALOGUE


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A check that all tests share; they must not change it."""
    out = tmp_path_factory.mktemp("made") / "check"
    with workers(1):
        tiny_check(out)
    return out


@pytest.fixture
def check(made: Path, tmp_path: Path) -> Path:
    """A copy of the shared check, which a test may change."""
    return Path(shutil.copytree(made, tmp_path / "check"))


def answers_of(out: Path) -> dict[str, dict[str, object]]:
    return json.loads((out / "answers.json").read_text(encoding="utf-8"))


def results(out: Path) -> dict[str, dict[str, object]]:
    """Settings of each diagnosis, as the stand-in for the diagnosis wrote them."""
    return {
        path.parent.name: json.loads(path.read_text(encoding="utf-8"))["provenance"]["settings"]
        for path in sorted((out / "results").glob("*/diagnosis.json"))
    }


def test_settings_have_the_grades_and_sensors_of_the_generator() -> None:
    assert GRADES == variants.GRADES
    assert tuple(COLUMNS) == SENSORS


def test_a_check_has_a_grade() -> None:
    with pytest.raises(ValueError, match="--grade"):
        Settings(grades=())


def test_settings_survive_a_file_and_list_differences() -> None:
    settings = Settings(3, 20, ("hard", "plain"), "position", 4.0, True)
    assert msgspec.json.decode(json_text(settings), type=Settings) == settings
    other = replace(settings, count=40, grades=("hard",), seconds=None)
    assert settings.differences(other) == [
        "count 20, not 40",
        "grades hard+plain, not hard",
        "seconds 4.0, not drawn",
    ]
    assert settings.differences(settings) == []


@pytest.mark.slow
def test_a_check_has_all_grades_and_a_separate_file_of_answers(made: Path) -> None:
    names = sorted(path.name for path in (made / "cases").iterdir())
    answers = answers_of(made)
    assert sorted(answers) == names
    assert len(names) == TINY.count
    assert {answer["grade"] for answer in answers.values()} == set(GRADES)
    seeds = sorted(answer["seed"] for answer in answers.values())
    assert seeds == [700000 + i for i in range(TINY.count)]
    for name in names:
        files = sorted(path.name for path in (made / "cases" / name).iterdir())
        assert files == ["rig.toml", "train.csv", "validate.csv"]
        assert (made / "transfer" / f"{name}.csv").is_file()
        known = answers[name]["kind"] in ("one", "two")
        edited = {path.stem for path in (made / "edited" / name).glob("*.csv")}
        assert edited == ({"removed", "halved"} if known else set())
    assert sorted(path.name for path in made.iterdir()) == [
        ".ehsid",
        "answers.json",
        "cases",
        "edited",
        "seal.json",
        "transfer",
    ]


@pytest.mark.thorough
def test_the_same_settings_make_the_same_check(made: Path, tmp_path: Path) -> None:
    with workers(1):
        again = tiny_check(tmp_path / "again")
    seal = read_seal(made)
    assert again.answers_sha256 == seal.answers_sha256
    assert again.files == seal.files


def test_an_intact_check_passes(made: Path) -> None:
    check_file(made / "seal.json")
    seal = verify(made)
    assert seal.settings == TINY
    # Each case has three files and a transfer record; two more where its effects can be changed.
    changed = sum(answer["kind"] in ("one", "two") for answer in answers_of(made).values())
    assert len(seal.files) == 4 * TINY.count + 2 * changed > 4 * TINY.count


@pytest.mark.parametrize("pattern", ["answers.json", "cases/*/rig.toml", "transfer/*.csv"])
def test_a_changed_or_missing_file_breaks_the_seal(pattern: str, check: Path) -> None:
    file = next(check.glob(pattern))
    text = file.read_text(encoding="utf-8")
    file.write_text(text + " ", encoding="utf-8")
    with pytest.raises(ValueError, match="changed since it was sealed") as error:
        verify(check)
    assert str(file) in str(error.value)
    file.unlink()
    with pytest.raises(ValueError, match="now missing"):
        verify(check)
    file.write_text(text, encoding="utf-8")
    verify(check)


def test_an_added_case_breaks_the_seal(check: Path) -> None:
    file = check / "cases" / "mine.csv"
    file.write_text("time_s\n", encoding="utf-8")
    with pytest.raises(ValueError, match=r"mine\.csv: added since the check was sealed"):
        verify(check)


@pytest.mark.parametrize("text", ["", "{}", '{"answers_sha256": "0", "files": []}', "[1]"])
def test_a_seal_that_cannot_be_read_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no such file"):
        verify(tmp_path)
    (tmp_path / "seal.json").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match="not a seal"):
        verify(tmp_path)


def test_files_of_others_are_left_alone(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"has files, but no seal\.json"):
        make_check(tmp_path, TINY)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_a_check_that_cannot_be_made_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError("no space left on device")

    monkeypatch.setattr("ehsid.lab.blind.making.write_seal", full)
    with pytest.raises(OSError, match="no space"), workers(1):
        make_check(tmp_path / "check", replace(TINY, count=1))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_cases_run_and_their_results_are_written(check: Path) -> None:
    names = unfinished_cases(check)
    assert len(names) == TINY.count
    with workers(2):
        outcomes = list(run_check(check, verify(check), StandIn()))
    assert sorted(outcome.name for outcome in outcomes) == names
    assert {outcome.word for outcome in outcomes} == {"effects"}
    assert unfinished_cases(check) == []
    for name, settings in results(check).items():
        assert settings["rig"] == f"rig-{name}"
        assert (settings["fitted"], settings["held_out"]) == (["train"], ["validate"])
        assert settings["exclude"] == []
        assert settings["workers"] == 1, "one core for each case"
        assert settings["process"] != os.getpid()
        files = sorted(path.name for path in (check / "results" / name).iterdir())
        assert files == [".ehsid", "diagnosis.json", "rig.augmented.toml"]
    assert list(run_check(check, verify(check), StandIn())) == []


def test_a_task_has_neither_paths_nor_answers(check: Path) -> None:
    for name, answer in answers_of(check).items():
        task = pickle.dumps(read_case(check, name))
        assert str(check).encode() not in task
        assert b"answers" not in task
        assert b"transfer" not in task
        for effect in answer["effects"]:  # type: ignore[attr-defined]
            assert str(effect).encode() not in task


def test_an_error_is_a_result_and_the_others_go_on(check: Path) -> None:
    names = unfinished_cases(check)
    outcomes = []
    with workers(1):
        for outcome in run_check(check, verify(check), StandIn(fails=(f"rig-{names[1]}",))):
            # A run that is killed loses nothing that it has told of.
            assert outcome.name not in unfinished_cases(check)
            outcomes.append(outcome)
    assert [outcome.failed for outcome in outcomes] == [False, True, *[False] * (TINY.count - 2)]
    text = (check / "results" / names[1] / ERROR).read_text(encoding="utf-8")
    assert f"no root for rig-{names[1]}" in text
    assert "Traceback" in text
    assert f"(ArithmeticError: no root for rig-{names[1]})" in (outcomes[1].word or "")
    assert unfinished_cases(check) == []


def test_a_case_that_cannot_be_read_is_an_error_of_its_own(check: Path) -> None:
    seal, names = verify(check), unfinished_cases(check)
    (check / "cases" / names[0] / "train.csv").unlink()
    with workers(1):
        outcomes = list(run_check(check, seal, StandIn()))
    assert [outcome.failed for outcome in outcomes] == [True, *[False] * (TINY.count - 1)]
    assert "no such file" in outcomes[0].word


@pytest.mark.slow
def test_the_true_effect_is_left_out(tmp_path: Path) -> None:
    settings = Settings(seed=3, count=6, grades=("plain",), seconds=2.0, exclude_truth=True)
    out = tmp_path / "check"
    with workers(1):
        seal = make_check(out, settings)
        list(run_check(out, seal, StandIn()))
    answers, settings_by_case = answers_of(out), results(out)
    assert len(settings_by_case) == 6
    for name, answer in answers.items():
        assert answer["kind"] == "one"
        assert settings_by_case[name]["exclude"] == list(answer["effects"])  # type: ignore[call-overload]
    # Each effect is used once before any is used again.
    effects = {next(iter(answer["effects"])) for answer in answers.values()}  # type: ignore[call-overload]
    assert len(effects) == 6
    assert effects <= set(CATALOGUE)


def test_a_result_replaces_an_earlier_one_and_nothing_else(tmp_path: Path) -> None:
    keep(Outcome("a", {"one": b"1", "two": b"2"}, "", 0.0), tmp_path)
    (tmp_path / "a" / "notes").write_text("mine")
    keep(Outcome("a", {"one": b"3"}, "", 0.0), tmp_path)
    contents = {
        path.name: path.read_text() for path in (tmp_path / "a").iterdir() if path.is_file()
    }
    assert contents == {"one": "3", "notes": "mine"}
    with pytest.raises(ValueError, match=r"a/notes: is there already"):
        keep(Outcome("a", {"notes": b"4"}, "", 0.0), tmp_path)
    assert (tmp_path / "a" / "notes").read_text() == "mine"

# SPDX-License-Identifier: MIT
"""Records that are withheld like the answer, and the length of the records."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ehsid.harness.records import read_record
from ehsid.lab.reality import case as cases
from ehsid.lab.reality import make_case
from ehsid.lab.reality.batch import (
    draw_logged_every,
    draw_sampling_time,
    draw_seconds,
    write_cases,
    write_drawn_case,
)
from ehsid.lab.reality.excitation import EXCITATION_SETS, EXCITATIONS
from ehsid.lab.reality.truth import Truth
from ehsid.lab.reality.variants import GRADES, WIDE

SHORT: dict[str, Any] = {"seconds": 1.0}


@pytest.mark.slow
@pytest.mark.parametrize("grade", GRADES)
@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.thorough) for seed in range(1, 4))]
)
def test_the_transfer_record_has_another_excitation(seed: int, grade: Any) -> None:
    case = make_case(seed, grade, "one", **SHORT)
    kinds = EXCITATION_SETS["all"] if grade in WIDE else EXCITATIONS
    assert case.answer["transfer_excitation"] in kinds
    assert case.answer["transfer_excitation"] not in case.answer["excitation"]
    assert list(case.transfer) == list(case.train)
    for name, column in case.transfer.items():
        assert column.shape == case.train[name].shape
        assert np.all(np.isfinite(column))
    assert not np.array_equal(case.transfer["command_v"], case.validate["command_v"])


@pytest.mark.thorough
def test_the_transfer_record_is_never_small() -> None:
    """At small amplitudes a wrong effect can reduce the gap, too."""
    ratios = []
    for seed in range(6):
        case = make_case(seed, "confusable", "none", seconds=2.0)
        rated = case.answer["told"]["valve.rated_command_v"]
        small = max(case.answer["largest_command"])
        # Small records have 15 % of the rated command at most; the loop adds to it.
        assert small < 0.3
        if case.answer["transfer_excitation"] != "triangle":  # a triangle is slow: 30 % of the size
            ratios.append(float(np.abs(case.transfer["command_v"]).max()) / rated / small)
    assert len(ratios) >= 3
    assert min(ratios) > 1.5


def test_the_first_two_records_do_not_depend_on_the_transfer_record(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = make_case(5, "hard", "two", **SHORT)
    transfer = next(
        kind
        for kind in EXCITATIONS
        if kind not in (*before.answer["excitation"], before.answer["transfer_excitation"])
    )
    monkeypatch.setattr(cases, "_another_excitation", lambda *_: transfer)
    after = make_case(5, "hard", "two", **SHORT)
    assert not np.array_equal(after.transfer["command_v"], before.transfer["command_v"])
    for name in before.train:
        np.testing.assert_array_equal(after.train[name], before.train[name])
        np.testing.assert_array_equal(after.validate[name], before.validate[name])


@pytest.mark.slow
def test_records_after_a_change_are_of_the_same_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the others are the same to the last bit, whether these are made or not."""
    runs: list[Any] = []

    def spy(machine: Truth, *arguments: Any) -> Any:
        runs.append((machine, arguments))
        return run(machine, *arguments)

    run = cases.equations.run
    monkeypatch.setattr(cases.equations, "run", spy)
    sizes = {"valve_lag": {"bandwidth_hz": 20.0, "damping": 0.7}, "load_force": {"force_n": 400.0}}
    options: dict[str, Any] = {"kind": "two", "effects": sizes, "seconds": 1.0}
    before = make_case(5, "wide", **options)
    assert not before.edited
    runs.clear()
    after = make_case(5, "wide", **options, edited=True)
    for record in ("train", "validate", "transfer"):
        for name, column in getattr(before, record).items():
            np.testing.assert_array_equal(getattr(after, record)[name], column)
    assert after.answer == before.answer
    assert list(after.edited) == ["removed", "halved"]
    step = {"sensor_step_m": 0.0}
    (removed, others), (halved, others_of_halved) = runs[3:]
    assert removed._replace(**step) == before.healthy._replace(**step)
    assert halved.load_n == 200.0
    assert halved.spool_rad_s == pytest.approx(2.0 * before.truth.spool_rad_s)
    fields = {"load_n": 0.0, "spool_rad_s": 0.0, "spool_damping": 0.0, **step}
    assert halved._replace(**fields) == before.healthy._replace(**fields)
    for one, other in zip(others[1:], others_of_halved[1:], strict=True):
        np.testing.assert_array_equal(one, other)
    assert not make_case(5, "wide", "params", seconds=1.0, edited=True).edited


@pytest.mark.slow
def test_withheld_records_are_written_to_folders_of_their_own(tmp_path: Path) -> None:
    folder, transfer, edited = (tmp_path / name for name in ("cases", "transfer", "edited"))
    name, answer = write_drawn_case(
        folder, 3, "plain", "one", "pressures", seconds=1.0, transfer=transfer, edited=edited
    )
    assert [path.name for path in edited.iterdir()] == [name]
    assert sorted(path.name for path in (edited / name).iterdir()) == ["halved.csv", "removed.csv"]
    names = sorted(path.name for path in (folder / name).iterdir())
    assert names == ["rig.toml", "train.csv", "validate.csv"]
    assert [path.name for path in transfer.iterdir()] == [f"{name}.csv"]
    case = make_case(3, "plain", "one", sensors="pressures", seconds=1.0)
    assert case.answer == answer
    record = read_record(transfer / f"{name}.csv")
    # The tolerance is half of the last digit in the file.
    np.testing.assert_allclose(
        record.column("position_m"), case.transfer["position_m"], atol=0.51e-7, rtol=0.0
    )


@pytest.mark.thorough
def test_lengths_are_drawn_independently(tmp_path: Path) -> None:
    lengths = [draw_seconds(seed, "plain") for seed in range(500)]
    assert 8.0 <= min(lengths) < 8.5
    assert 19.5 < max(lengths) <= 20.0
    # The mean of 500 uniform draws has a standard error of 12 / sqrt(12 * 500) = 0.155 s; the
    # tolerance is four of them.
    assert np.mean(lengths) == pytest.approx(14.0, abs=0.62)
    slow = [draw_seconds(seed, "slow") for seed in range(500)]
    assert 30.0 <= min(slow) < 31.25
    assert 58.75 < max(slow) <= 60.0
    write_cases(tmp_path / "cases", tmp_path / "answers.json", [11, 12], seconds=None)
    answers = json.loads((tmp_path / "answers.json").read_text(encoding="utf-8"))
    for name, answer in answers.items():
        assert answer["seconds"] == draw_seconds(answer["seed"], "plain")
        record = read_record(tmp_path / "cases" / name / "train.csv")
        assert len(record) == round(answer["seconds"] / answer["dt_s"])


def test_slow_records_are_sampled_every_20_or_50_ms() -> None:
    drawn = [draw_sampling_time(seed, "slow") for seed in range(200)]
    assert set(drawn) == {0.02, 0.05}
    # Of 200 fair draws, each value has 100; four standard errors are 28.
    assert 72 <= drawn.count(0.02) <= 128
    for grade in ("plain", "hard", "confusable"):
        assert {draw_sampling_time(seed, grade) for seed in range(20)} == {1e-3}
    abroad = [draw_sampling_time(seed, "abroad") for seed in range(200)]
    assert set(abroad) == {5e-3, 1e-2, 2e-2, 5e-2}
    every = [draw_logged_every(seed, "abroad") for seed in range(200)]
    assert set(every) == {1, 2}
    assert 72 <= every.count(2) <= 128
    assert {draw_logged_every(seed, "slow") for seed in range(20)} == {1}


def test_slow_records_of_the_field_are_long_and_some_have_every_fifth_command() -> None:
    """A chance of one in 10^4 at most that a value is not drawn 400 times."""
    times = {seed: draw_sampling_time(seed, "field") for seed in range(400)}
    assert set(times.values()) == {5e-4, 1e-3, 2e-3, 4e-3, 5e-3, 1e-2, 2e-2, 5e-2, 0.1}
    every = {seed: draw_logged_every(seed, "field") for seed in times}
    assert {every[seed] for seed, dt_s in times.items() if dt_s < 5e-3} == {1}
    assert {every[seed] for seed, dt_s in times.items() if dt_s >= 5e-3} == {1, 2, 5}
    for seed, dt_s in times.items():
        assert (draw_seconds(seed, "field") >= 30.0) == (dt_s >= 5e-3)


def test_a_log_of_every_second_command_is_half_of_the_log_of_all() -> None:
    """But for the samples of the clock, which is late by a share of the log's own time."""
    kinds = ("multisine", "steps")
    every = make_case(3, "plain", "none", seconds=4.0, dt_s=1e-2, excitation=kinds)
    second = make_case(3, "plain", "none", seconds=4.0, dt_s=2e-2, logged_every=2, excitation=kinds)
    for name, column in second.train.items():
        np.testing.assert_array_equal(column, every.train[name][::2], err_msg=name)
    assert (second.answer["dt_s"], second.answer["logged_every"]) == (2e-2, 2)


@pytest.mark.slow
def test_new_cases_replace_those_of_an_earlier_run_and_nothing_else(tmp_path: Path) -> None:
    def write(*seeds: int) -> list[str]:
        write_cases(tmp_path / "cases", tmp_path / "answers.json", seeds, seconds=1.0)
        return sorted(json.loads((tmp_path / "answers.json").read_text(encoding="utf-8")))

    first = write(1, 2)
    second = write(2, 3)
    assert sorted(path.name for path in (tmp_path / "cases").iterdir()) == second != first
    (case,) = set(first) & set(second)
    (tmp_path / "cases" / case / "notes.txt").write_text("mine")
    assert case not in write(3)
    assert [path.name for path in (tmp_path / "cases" / case).iterdir()] == ["notes.txt"]
    (tmp_path / "answers.json").write_text("mine")
    with pytest.raises(ValueError, match=r"answers\.json: has been changed since"):
        write(3)

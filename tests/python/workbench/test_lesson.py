# SPDX-License-Identifier: MIT
"""A lesson hides one effect; its seed alone says it again, and nothing else tells it."""

from __future__ import annotations

import time
from pathlib import Path

import pytest
from app_diagnosed import diagnosed_session
from app_sessions import BENCH

from ehsid.harness.diagnosis.schema import read_diagnosis_file
from ehsid.harness.rigs import Rig, read_rig
from ehsid.workbench import lesson as lessons_module
from ehsid.workbench.flow import step_states
from ehsid.workbench.lesson import (
    LACKING,
    LOGGED,
    Lesson,
    candidates,
    guessed,
    lesson_of,
    lesson_records,
    lesson_task,
    shows,
    truth,
)
from ehsid.workbench.lesson_part import Stage, advance, is_found, lessons, named, outcome_html
from ehsid.workbench.workbench import Workbench


@pytest.fixture(scope="module")
def bench() -> Rig:
    return read_rig(BENCH)


def seed_of(rig: Rig, effect: str) -> int:
    """Return the first seed that hides an effect."""
    return next(seed for seed in range(10_000) if truth(rig, seed)[0] == effect)


def test_a_seed_says_the_same_truth_again(bench: Rig) -> None:
    found = [truth(bench, seed) for seed in range(300)]
    assert found == [truth(bench, seed) for seed in range(300)]
    assert len({effect for effect, _ in found}) == len(candidates(bench))
    for effect, sizes in found:
        assert bench.with_values(sizes).values.keys() > bench.values.keys()
        assert all(key.startswith(f"effects.{effect}.") for key in sizes)


def test_effects_that_the_rig_has_or_the_records_cannot_show_are_not_hidden(bench: Rig) -> None:
    ids = {effect.id for effect in candidates(bench)}
    assert "valve_lag" not in ids
    assert "flow_gain_drift" not in ids
    assert not any(LACKING & set(effect.needs) for effect in candidates(bench))


def test_the_logs_have_the_effect_and_what_a_usual_machine_measures(bench: Rig) -> None:
    seed = seed_of(bench, "valve_dead_band")
    assert shows(bench, seed)
    records = lesson_records(bench, seed)
    assert [record.name for record in records] == ["multisine", "triangle", "steps"]
    for record in records:
        assert set(record.columns) == {"command_v", *LOGGED}


def test_an_effect_below_the_noise_does_not_show(bench: Rig) -> None:
    deaf = Rig(
        bench.name,
        bench.plant,
        bench.values,
        sensors=dict.fromkeys(bench.sensors, 1000000000.0),
    )
    assert not shows(deaf, seed_of(bench, "valve_dead_band"))


@pytest.mark.slow
def test_a_lesson_is_made_read_checked_and_waits_for_a_guess(
    tmp_path: Path, bench: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lessons_module, "new_seed", lambda: seed_of(bench, "valve_dead_band"))
    monkeypatch.setattr(lessons_module, "RECORDS", lessons_module.RECORDS[:1])
    workbench = Workbench(tmp_path)
    session = workbench.begun("lesson")
    session.rig_file.write_bytes(BENCH.read_bytes())
    assert lessons(workbench) == []
    lesson_task(session.folder, report=lambda share: None)
    assert lessons(workbench) == ["lesson"]
    try:
        end = time.monotonic() + 120.0
        while (stage := advance(workbench, session)) is Stage.preparing:
            assert time.monotonic() < end
            time.sleep(0.05)
        assert stage is Stage.guess
        assert step_states(session)["check"].done
        assert workbench.job(session, "gap") is None
        guessed(session, "load_force")
        assert lesson_of(session) == Lesson(seed_of(bench, "valve_dead_band"), "load_force")
        assert advance(workbench, session) is Stage.diagnosing
        job = workbench.job(session, "gap")
        assert job is not None
        job.cancel()
        assert advance(workbench, session) is Stage.stopped
        session.rig_file.unlink()
        assert advance(workbench, session) is Stage.broken
    finally:
        workbench.close()
    told = [path.read_text() for path in session.folder.glob("*.toml")]
    assert not any("dead_band" in text for text in told)


@pytest.mark.slow
def test_guess_diagnosis_and_truth_stand_side_by_side(tmp_path: Path, bench: Rig) -> None:
    session = diagnosed_session(tmp_path / "lesson", "effects")
    found = read_diagnosis_file(session.folder / "gap" / "diagnosis.json")
    effect = found.which.effects[0].id
    assert is_found(found, effect) is (True if len(found.which.effects) == 1 else None)
    assert is_found(found, "transport_delay") is False
    seed = seed_of(bench, "transport_delay")
    html = outcome_html(session, Lesson(seed, "transport_delay"))
    assert "✓ Transport delay" in html
    assert "Transport delay" in html.partition("the truth")[2]
    assert f"Seed of this lesson: {seed}" in html
    assert "ms" in html
    assert "✗ Load force" in outcome_html(session, Lesson(seed, "load_force"))


def test_an_effect_among_several_answers_is_neither_right_nor_wrong(tmp_path: Path) -> None:
    session = diagnosed_session(tmp_path / "lesson", "ambiguous")
    found = read_diagnosis_file(session.folder / "gap" / "diagnosis.json")
    assert " or " in named(found)
    for (effect,) in found.which.ambiguity_set:
        assert is_found(found, effect) is None


def test_a_session_that_is_none_has_no_lesson(tmp_path: Path) -> None:
    session = diagnosed_session(tmp_path / "press")
    assert lesson_of(session) is None
    assert advance(Workbench(tmp_path), session) is Stage.broken

# SPDX-License-Identifier: MIT
"""Sliders offer what a policy takes, and results know of which choices they are made."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from app_sessions import BENCH, entry_of, german_log, read_session

from ehsid.harness.catalogue.parameters import POLICIES
from ehsid.workbench.flow import next_step, step_states
from ehsid.workbench.model_tasks import (
    adopt_found,
    recursion_of,
    set_method,
    set_policy,
    slider_values,
    value_of,
)
from ehsid.workbench.session import ModelChoice, Session, SessionError

SETTINGS = [(name, one) for name, info in POLICIES.items() for one in info.settings]


@pytest.mark.parametrize(("policy", "setting"), SETTINGS, ids=lambda one: str(one)[:20])
def test_a_slider_offers_only_what_its_policy_takes(policy: str, setting: object) -> None:
    choice = ModelChoice(policy=policy)
    offered = slider_values(setting, value_of(choice, setting))
    assert offered == sorted(set(offered))
    assert setting.default in offered
    assert len(offered) >= 8
    for value in (offered[0], offered[-1]):
        choice.settings = {setting.name: value}
        assert f"{setting.name}=" in repr(recursion_of(choice).forgetting)


def test_a_value_from_elsewhere_stays() -> None:
    (setting,) = POLICIES["constant"].settings
    assert 0.9876 in slider_values(setting, 0.9876)


def test_a_recursion_that_does_not_take_a_policy_changes_it() -> None:
    choice = ModelChoice()
    set_policy(choice, "f-ratio")
    choice.settings = {"eta": 1.0}
    set_method(choice, "riv")
    assert (choice.policy, choice.settings) == ("exponential", {})
    assert recursion_of(choice).orders.offset
    set_policy(choice, "constant")
    set_method(choice, "riv")
    assert choice.policy == "constant"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("policy = 'none'", "policy 'none': expected one of constant, exponential"),
        ("policy = 'f-ratio'\nmethod = 'riv'", "'f-ratio': expected one of constant, exponential"),
        ("method = 'best'", "method 'best': expected one of rls, riv"),
        ("settings = { eta = 1.0 }", "setting 'eta': expected one of lambda0, lambda_initial"),
        ("nb = 7", "na, nb: expected 1 to 6"),
        ("nk = 21", "nk: expected 0 to 20"),
    ],
)
def test_a_choice_that_was_edited_by_hand_is_refused(tmp_path: Path, line: str, words: str) -> None:
    (tmp_path / "session.toml").write_text(f"version = 1\n[model]\n{line}\n")
    with pytest.raises(SessionError, match=words):
        Session(tmp_path)


def test_a_setting_outside_its_range_is_refused() -> None:
    with pytest.raises(ValueError, match="lambda0"):
        recursion_of(ModelChoice(settings={"lambda0": 2.0}))


@pytest.fixture
def session(tmp_path: Path) -> Session:
    logs = (german_log(tmp_path / f"{name}.csv", 0.5) for name in ("run", "other"))
    return read_session(tmp_path / "press", *logs)


def found(session: Session, na: int, nk: int) -> None:
    (session.folder / "model").mkdir(exist_ok=True)
    orders = {"na": na, "nb": na, "nk": nk, "offset": True}
    text = json.dumps({"chosen": {"orders": orders}})
    (session.folder / "model" / "identify.json").write_text(text)


def test_the_estimator_takes_orders_that_it_has(session: Session) -> None:
    choice = session.settings.model
    found(session, 2, 4)
    adopt_found(session)
    assert (choice.na, choice.nb, choice.nk) == (2, 2, 4)
    for na, nk in ((7, 1), (3, 21)):
        found(session, na, nk)
        adopt_found(session)
    assert (choice.na, choice.nb, choice.nk) == (2, 2, 4)


def test_choices_are_kept_in_the_session(session: Session) -> None:
    set_policy(session.settings.model, "f-ratio")
    session.settings.model.settings["eta"] = 1.5
    session.settings.model.reset = False
    session.save()
    again = Session(session.folder).settings.model
    assert again == session.settings.model
    assert again.policy == "f-ratio"


def test_a_session_of_an_earlier_version_has_the_defaults(tmp_path: Path) -> None:
    (tmp_path / "session.toml").write_text("version = 1\n")
    assert Session(tmp_path).settings.model == ModelChoice()


def test_results_are_made_of_their_own_choices_only(session: Session) -> None:
    choice = session.settings.model
    before = {key: session.made_from(key) for key in ("identify", "estimate", "gap")}

    def changed() -> set[str]:
        return {key for key, digest in before.items() if session.made_from(key) != digest}

    assert changed() == set()
    choice.delays = "1-9"
    assert changed() == {"identify"}
    choice.settings["lambda0"] = 0.95
    assert changed() == {"identify", "estimate"}
    choice.delays, choice.settings = "1-5", {}
    session.rig_file.write_text("plant = 'ehs'\n")
    assert changed() == {"gap"}
    choice.record = "other"
    assert changed() == {"identify", "estimate", "gap"}
    entry = session.modelled()
    assert entry is not None
    session.remove(entry)
    assert session.modelled() is entry_of(session)


def test_a_model_may_be_left_out_and_knows_when_it_is_old(session: Session) -> None:
    session.rig_file.write_bytes(BENCH.read_bytes())
    (session.folder / "check").mkdir()
    (session.folder / "check" / "rig_check.json").write_text("{}")
    session.settings.made_of["check"] = session.made_from("check")
    assert step_states(session)["gap"].open
    assert step_states(session)["model"].why == "no model was identified yet."
    assert next_step(session) == "gap"
    found(session, 2, 1)
    session.settings.made_of["identify"] = session.made_from("identify")
    assert step_states(session)["model"].done
    session.settings.model.orders = "2-3"
    assert "identify again" in step_states(session)["model"].why
    assert step_states(session)["gap"].open
    session.settings.made_of.clear()
    assert not step_states(session)["model"].open

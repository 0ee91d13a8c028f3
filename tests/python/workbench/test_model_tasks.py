# SPDX-License-Identifier: MIT
"""The work of the step Model: its files are those of the commands, and what is drawn fits them."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from app_sessions import german_log, read_session
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.show.rendering import text
from ehsid.workbench import model_look
from ehsid.workbench.downsampling import opened
from ehsid.workbench.equivalent import commands, python
from ehsid.workbench.model_tasks import estimate_task, estimated, identify_task, io_data, set_policy
from ehsid.workbench.session import Session

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("blank_pictures")]

FILES = ("identify.json", "estimate.json")


def nothing(share: float) -> None:
    assert 0.0 <= share <= 1.0


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Session:
    top = tmp_path_factory.mktemp("model")
    made = read_session(top / "press", german_log(top / "run of 'Monday'.csv", 3.0))
    choice = made.settings.model
    choice.orders, choice.delays, choice.nb, choice.reset = "2-3", "1-2", 2, False
    set_policy(choice, "constant")
    choice.settings |= {"lambda_": 0.97}
    made.save()
    identify_task(made.folder, report=nothing)
    estimate_task(made.folder, report=nothing)
    return made


def test_the_commands_give_the_same_files(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "records").symlink_to(session.folder / "records")
    monkeypatch.chdir(tmp_path)
    for command in commands(session, "model"):
        outcome = CliRunner().invoke(cli, shlex.split(command)[1:])
        assert outcome.exit_code == 0, outcome.output
    for name in FILES:
        written = (tmp_path / "model" / name).read_bytes()
        assert written == (session.folder / "model" / name).read_bytes()


@pytest.mark.thorough
def test_the_python_gives_the_same_files(
    session: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "records").symlink_to(session.folder / "records")
    monkeypatch.chdir(tmp_path)
    exec(python(session, "model"), {})
    for name in FILES:
        written = (tmp_path / "model" / name).read_bytes()
        assert written == (session.folder / "model" / name).read_bytes()


def test_what_is_drawn_of_a_model_is_what_was_written(session: Session) -> None:
    (found,) = model_look.read_looks(session)
    chosen = json.loads((session.folder / "model" / "identify.json").read_bytes())["chosen"]
    theta = chosen["model"]["theta"]
    for row, value in zip(found.told.coefficients.rows, theta, strict=True):
        factor = {"": 1.0, "mm/V": 1e3, "mm": 1e3}[str(row[3])]
        assert float(str(row[1])) == pytest.approx(factor * value, rel=1e-5)
    (place,) = found.told.orders.marked
    order = found.told.orders.rows[place][:2]
    assert order == [str(chosen["orders"]["na"]), str(chosen["orders"]["nk"])]
    signals = {
        key: opened(model_look.look_folder(session), key).values
        for key in (model_look.MEASURED, model_look.SIMULATED, model_look.RESIDUAL)
    }
    assert {values.size for values in signals.values()} == {1500 - 4}
    away = signals[model_look.MEASURED] - signals[model_look.SIMULATED]
    spread = np.std(signals[model_look.MEASURED])
    fit = 100.0 * (1.0 - np.sqrt(np.mean(away**2)) / spread)
    assert fit == pytest.approx(chosen["simulation_fit_percent"], rel=1e-9)
    poles = found.dynamics.poles
    assert sum(1 + (one.imag > 0.0) for one in poles) == chosen["orders"]["na"]
    assert all(one.integrates or one.frequency_hz is not None for one in poles)


def test_what_is_drawn_of_an_estimate_is_what_was_written(session: Session) -> None:
    look = model_look.read_estimate_look(session)
    assert look is not None
    plain = json.loads((session.folder / "model" / "estimate.json").read_bytes())
    assert look.figures.made_from == session.made_from("estimate")
    for name, entry in plain["parameters"].items():
        ends = [look.signals[key].values[-1] for key in (model_look.low(name), name)]
        np.testing.assert_allclose(ends, [entry["ci95"][0], entry["value"]], rtol=1e-5)
    assert look.time_s.size == look.signals[model_look.FACTOR].values.size == 3000


def test_the_servo_is_told_where_the_orders_are_those_of_one(session: Session) -> None:
    data, record = io_data(session)
    choice = session.settings.model
    told = []
    for nb in (2, 3):
        choice.nb = nb
        look = model_look.look_of(session, record, estimated(session, data), data)
        told.append(look.figures.told.servo)
    choice.nb = 2
    assert told[0] == []
    shown = text(told[1])
    for words in ("\nK  ", "m/s per V", "90 % interval", "% of the record"):
        assert words in shown


def test_gaps_of_a_record_stay_gaps(session: Session) -> None:

    data, record = io_data(session)
    parts = replace(data, segments=(slice(0, 1400), slice(1600, 3000)))
    look = model_look.look_of(session, record, estimated(session, parts), parts)
    ends_only = (model_look.low("offset"), model_look.high("offset"))
    for name, pyramid in look.signals.items():
        assert np.isnan(pyramid.values[1400:1600]).all()
        assert np.isfinite(pyramid.values[2000:]).all() or name in ends_only
        assert np.isfinite(pyramid.values[-1])


def test_a_wrong_choice_leaves_earlier_results(session: Session) -> None:
    before = (session.folder / "model" / "identify.json").read_bytes()
    session.settings.model.orders = "many"
    session.save()
    try:
        with pytest.raises(ValueError, match="orders 'many': expected a number or a range"):
            identify_task(session.folder, report=nothing)
    finally:
        session.settings.model.orders = "2-3"
        session.save()
    assert (session.folder / "model" / "identify.json").read_bytes() == before


def test_a_column_that_is_missing_is_named(session: Session) -> None:
    choice = Session(session.folder).settings.model
    assert choice.output_name == "position_m"
    session.settings.model.output_name = "velocity_m_s"
    try:
        with pytest.raises(ValueError, match="velocity_m_s"):
            io_data(session)
    finally:
        session.settings.model.output_name = "position_m"


def test_without_a_record_nothing_is_done(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="there is no record"):
        io_data(Session(tmp_path))
    assert commands(Session(tmp_path), "model") == []

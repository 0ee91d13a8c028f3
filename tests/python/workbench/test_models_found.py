# SPDX-License-Identifier: MIT
"""Models that were found one after the other: what is kept, told and drawn of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from app_sessions import german_log, read_session
from bokeh.models import GlyphRenderer, Legend

from ehsid.harness.models.identification import IoData, identify
from ehsid.harness.records import read_record
from ehsid.harness.show.page import cell_text
from ehsid.harness.show.plotting import ROLES
from ehsid.workbench.downsampling import opened
from ehsid.workbench.model_look import (
    ERROR,
    MEASURED,
    SIMULATED,
    Identified,
    key_of,
    look_folder,
    read_looks,
    write_look,
)
from ehsid.workbench.model_plots import bode_plots, drawn_models, poles_plot, simulation_plots
from ehsid.workbench.session import Session
from ehsid.workbench.steps.models_found import ModelsFound, notes, table

pytestmark = pytest.mark.slow

PRESSURE = "pressure_a_pa"


def find(
    session: Session, place: int, order: int, delay: int, output: str = "position_m", every: int = 1
) -> list[Identified]:
    """Find a model of one structure; return all that are kept."""
    entry = session.settings.records[place]
    names = ["command_v", output]
    record = read_record(session.record_of(entry), columns=names)
    data = IoData.from_record(record, *names)
    if every > 1:
        assert data.dt_s is not None
        u, y = data.u[::every], data.y[::every]
        data = IoData(u, y, (slice(0, u.size),), every * data.dt_s, *names)
    result = identify(data, orders=[order], delays=[delay])
    write_look(session, record, result, data)
    return read_looks(session)


@pytest.fixture
def session(tmp_path: Path) -> Session:
    logs = [german_log(tmp_path / f"run {i}.csv", 3.0, float(i)) for i in (1, 2)]
    return read_session(tmp_path / "press", *logs)


def numbers(models: Sequence[Identified]) -> list[int]:
    return [one.number for one in models]


def test_the_newest_models_are_kept_and_the_same_one_once(session: Session) -> None:
    assert read_looks(session) == []
    assert numbers(find(session, 0, 2, 1)) == [1]
    assert numbers(find(session, 0, 3, 1)) == [2, 1]
    assert numbers(find(session, 0, 2, 1)) == [1, 2]  # the same model comes to the front
    assert numbers(find(session, 1, 2, 1)) == [3, 1, 2]
    find(session, 0, 3, 2)
    assert numbers(find(session, 0, 2, 1, PRESSURE)) == [5, 4, 3, 1]
    again = read_looks(Session(session.folder))
    assert [one.orders.nk for one in again] == [1, 2, 1, 1]


def test_an_earlier_model_simulates_the_record_of_the_newest_one(session: Session) -> None:
    """The simulation is computed here sample by sample."""
    find(session, 0, 3, 2)
    newest, earlier = find(session, 1, 2, 1)
    record = read_record(session.record_of(session.settings.records[1]))
    u, y = record.column("command_v"), record.column("position_m")
    begin = u.size // 2 + earlier.orders.n_history
    wanted = y.copy()
    theta = np.array(earlier.theta)
    for k in range(begin, u.size):
        past = (-wanted[k - 1], -wanted[k - 2], -wanted[k - 3], u[k - 2], u[k - 3], u[k - 4], 1.0)
        wanted[k] = theta @ past
    folder = look_folder(session)
    found = opened(folder, key_of(SIMULATED, 1)).values
    measured = opened(folder, MEASURED).values
    error = opened(folder, key_of(ERROR, 1)).values
    known = np.isfinite(found)
    assert known.sum() == u.size - begin
    np.testing.assert_allclose(found[known], wanted[begin:], rtol=1e-9)
    np.testing.assert_allclose(error[known], (y - wanted)[begin:], rtol=1e-6, atol=1e-12)
    np.testing.assert_array_equal(measured, y[-measured.size :])
    away = np.linalg.norm((y - wanted)[begin:]) / np.linalg.norm(y[begin:] - np.mean(y[begin:]))
    assert float(earlier.here) == pytest.approx(100.0 * (1.0 - away), abs=0.006)
    assert earlier.here != earlier.fit
    assert newest.here == newest.fit


def test_of_other_signals_and_sampling_times_less_is_drawn_and_the_page_says_so(
    session: Session,
) -> None:
    find(session, 0, 2, 1, every=2)
    find(session, 0, 2, 1, PRESSURE)
    models = find(session, 0, 3, 1)
    assert [one.here for one in models[1:]] == ["", ""]
    assert notes(models) == [
        "With other signals, only poles and zeros are drawn: model 2.",
        "With another sampling time, nothing is drawn: model 1.",
    ]
    drawn = drawn_models(models, [1, 2])
    assert [one.name for one in drawn] == ["model 3", "model 2"]
    assert legends([poles_plot(drawn, "light")]) == ["model 3", "model 2"]
    assert legends(bode_plots(drawn, "", "light")) == ["model 3"]
    stack = simulation_plots(drawn, look_folder(session), "light")
    assert legends(stack.children) == ["measured", "model 3"]


def test_the_table_tells_what_a_servo_is_known_by(session: Session) -> None:
    find(session, 0, 2, 1)
    models = find(session, 0, 3, 1)
    told = table(models)
    assert told.columns == ("model", "na, nb, nk", "fit", "tests", "servo or slowest pole")
    assert list(told.marked) == [0]
    rows = [[cell_text(cell) for cell in row] for row in told.rows]
    assert [row[:3] for row in rows] == [
        ["2", "3, 3, 1", models[0].fit],
        ["1", "2, 2, 1", models[1].fit],
    ]
    for row, one in zip(rows, models, strict=True):
        verdicts = [words.text for words in one.told.tests]
        passed = sum(not words.startswith(("not white", "depends")) for words in verdicts)
        assert row[3] == f"{passed} of 2"
    (slow,) = [one for one in models[1].dynamics.poles if not one.integrates]
    assert rows[1][4] == f"z = {slow.real:.5g}"
    several = table(find(session, 1, 3, 1))
    assert [row[1] for row in several.rows] == ["run_2", "run_1", "run_1"]
    assert several.columns[:5] == ("model", "record", "na, nb, nk", "fit", "here")


def legends(plots: Sequence[Any]) -> list[str]:
    items = [item for plot in plots for legend in plot.select(Legend) for item in legend.items]
    return [item.label.value for item in items]


def colours(plot: Any) -> dict[str, str]:
    """The colour of each entry of the legends of a plot."""
    found = {}
    for legend in plot.select(Legend):
        for item in legend.items:
            renderer: GlyphRenderer = item.renderers[0]
            found[item.label.value] = renderer.glyph.line_color
    return found


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_model_has_one_colour_in_all_plots(session: Session, theme: str) -> None:
    find(session, 0, 2, 1)
    find(session, 0, 2, 1, PRESSURE)
    models = find(session, 0, 3, 1)
    drawn = drawn_models(models, [1, 2])
    roles = ROLES[theme]
    wanted = {"model 3": "calibrated", "model 2": "second", "model 1": "third"}
    of = {name: roles[role] for name, role in wanted.items()}
    assert colours(poles_plot(drawn, theme)) == of
    # What cannot be drawn leaves its colour free; no other model takes it.
    del of["model 2"]
    assert colours(bode_plots(drawn, "", theme)[0]) == of
    over_time = simulation_plots(drawn, look_folder(session), theme).children[0]
    assert colours(over_time) == {"measured": roles["measured"], **of}


def test_two_earlier_models_are_drawn_at_most_and_the_choice_stays(session: Session) -> None:
    for delay in (1, 2, 3):
        find(session, 0, 2, delay)
    models = find(session, 0, 3, 1)
    session.save()
    page: Any = SimpleNamespace(session=session, told=lambda handler: handler)
    part = ModelsFound(page)
    part.show(models[:1])
    assert not part.layout.visible
    part.show(models)
    assert part.layout.visible
    ticks = part.layout[1]
    assert ticks.options == {"model 3": 3, "model 2": 2, "model 1": 1}
    for ticked in ([3], [3, 2], [3, 2, 1]):
        ticks.value = ticked
        part.show(models)
    assert ticks.value == [2, 1]  # that which was ticked first gives way
    assert Session(session.folder).settings.model.beside == [2, 1]
    assert [one.name for one in part.drawn(models)] == ["model 4", "model 2", "model 1"]

# SPDX-License-Identifier: MIT
"""Sections of the offline procedure: what they show is what was found."""

from __future__ import annotations

import re
from io import BytesIO

import numpy as np
import pytest
from identification_truth import A16, B16, arx_output, model16

from ehsid.harness.models.identification import FrequencyResponse, IoData, Preprocessing
from ehsid.harness.show.model_blocks import limit_words, loop_blocks
from ehsid.harness.show.model_figures import bode, bode_figure
from ehsid.harness.show.page import Page, Picture, Section, Table
from ehsid.harness.show.rendering import render_page
from ehsid.lab.studies.pages.offline_model_blocks import outputs_figure, poles_zeros_figure
from ehsid.lab.studies.pages.offline_sections import offline_sections
from ehsid.lab.studies.procedure import Procedure, run_procedure
from ehsid.lab.studies.rig_records import ORDERS

pytestmark = pytest.mark.usefixtures("blank_pictures")

DT_S = 0.05


def run(dt_s: float | None = DT_S, **options: object) -> Procedure:
    u, y = model16(seed=1, n=1200, noise=0.1)
    y[700] += 50.0
    return run_procedure(IoData.from_arrays(u, y, dt_s=dt_s), **options)  # type: ignore[arg-type]


def blocks(sections: list[Section], kind: type) -> list:
    return [block for section in sections for block in section.blocks if isinstance(block, kind)]


def text(sections: list[Section]) -> str:
    return " ".join(blocks(sections, str))


def truth(factor: float = 1.0) -> FrequencyResponse:
    f = np.geomspace(0.1, 9.0, 40)
    back = np.exp(-2j * np.pi * f * DT_S)
    g = back * np.polyval(B16[::-1], back) / np.polyval(np.r_[1.0, A16][::-1], back)
    return FrequencyResponse(f, factor * g, "the truth")


@pytest.mark.slow
def test_everything_is_there_and_renders() -> None:
    procedure = run()
    sections = offline_sections(
        procedure, record_name="a record", published=ORDERS, rig_response=truth()
    )
    assert len(blocks(sections, Picture)) == 4
    assert all(picture.alt and picture.caption for picture in blocks(sections, Picture))
    for table in blocks(sections, Table):
        assert all(len(row) == len(table.columns) for row in table.rows)
    page = render_page(Page("Offline", ["lead"], sections))
    assert page.count("data:image/svg+xml") == 4
    assert "nan" not in text(sections).lower()


@pytest.mark.slow
def test_the_order_table_has_the_figures_and_the_paper_s_beside() -> None:
    procedure = run()
    sections = offline_sections(procedure, record_name="a record", published=ORDERS)
    (table,) = [t for t in blocks(sections, Table) if "FPE" in t.columns]
    result = procedure.best.result
    assert result is not None
    assert table.marked == [[c.orders for c in result.by_order].index(result.chosen.orders)]
    for row, candidate, paper in zip(table.rows, result.by_order, ORDERS, strict=True):
        assert row[0] == str(paper.order) == str(candidate.orders.na)
        assert float(row[2]) == pytest.approx(candidate.one_step_fit_percent, abs=6e-4)
        assert float(row[3]) == pytest.approx(candidate.simulation_fit_percent, abs=6e-3)
        assert float(row[4]) == pytest.approx(candidate.estimation.loss, rel=1e-3)
        assert float(row[5]) == pytest.approx(candidate.estimation.fpe, rel=1e-3)
        assert [float(cell) for cell in row[-3:]] == [paper.fit_percent, paper.loss, paper.fpe]
    assert "the paper's" in table.caption
    plain = offline_sections(procedure, record_name="a record")
    (table,) = [t for t in blocks(plain, Table) if "FPE" in t.columns]
    assert not any("paper" in column for column in table.columns)


@pytest.mark.slow
def test_outliers_and_settings_are_told() -> None:
    words = text(offline_sections(run(), record_name="a record"))
    assert "1 of 1196 samples replaced" in words
    assert "counted from 0: 700." in words
    left = run(preprocessing=Preprocessing(outliers=False, trend="mean", scaling=True))
    words = text(offline_sections(left, record_name="a record"))
    assert "not looked for" in words
    assert "means removed" in words


@pytest.mark.slow
def test_every_attempt_and_its_reason_are_told() -> None:
    rng = np.random.default_rng(2)
    u = rng.normal(size=1500)
    y = arx_output(np.array([-0.8]), np.array([1.0]), 1, u, 0.3 * rng.normal(size=1500))
    procedure = run_procedure(IoData.from_arrays(u, y), orders=[3, 4])
    sections = offline_sections(procedure, record_name="a record")
    (table,) = [t for t in blocks(sections, Table) if "attempt" in t.columns]
    assert [row[0] for row in table.rows] == ["1. first attempt", "2. lower orders"]
    assert table.marked == [1]
    assert table.rows[0][-1] == "non-minimal model"
    assert "cancel within their uncertainty" in text(sections)
    assert "The loop changed this choice" in text(sections)


@pytest.mark.slow
def test_agreement_with_the_rig_is_told_and_disagreement_too() -> None:
    procedure = run()
    near = text(offline_sections(procedure, record_name="a", rig_response=truth()))
    far = text(offline_sections(procedure, record_name="a", rig_response=truth(2.0)))
    assert "What lies beyond is bias" not in near
    assert "at 0 of 40 frequencies" in far
    assert "What lies beyond is bias" in far
    median = re.search(r"median ones ([\d.]+) dB", far)
    assert median is not None
    difference = procedure.against(truth(2.0)).magnitude_difference_db
    assert float(median[1]) == pytest.approx(np.median(np.abs(difference)), abs=0.006)
    # 20 log10 2 = 6.02 less than without the factor, at every frequency.
    without = procedure.against(truth()).magnitude_difference_db
    np.testing.assert_allclose(without - difference, 20.0 * np.log10(2.0))


def test_without_a_model_the_problems_are_the_page() -> None:
    procedure = run_procedure(IoData.from_arrays(np.ones(600), np.arange(600.0)))
    sections = offline_sections(procedure, record_name="a record", published=ORDERS)
    assert len(sections) == 1
    assert "not possible" in sections[0].title
    assert "Constant input: 'u' is 1 throughout the estimation part" in text(sections)
    short = run_procedure(IoData.from_arrays(np.arange(30.0), np.arange(30.0)))
    assert "Too short" in text(offline_sections(short, record_name="a record"))


@pytest.mark.slow
def test_without_a_sampling_time_frequencies_are_those_of_samples() -> None:
    procedure = run(dt_s=None)
    assert procedure.response is not None
    figure = bode_figure(bode(procedure.response), None)
    assert figure.axes[1].get_xlabel() == "frequency in cycles a sample"
    assert figure.axes[1].get_xlim()[1] < 0.5


@pytest.mark.slow
def test_the_bode_figure_shows_band_and_dots() -> None:
    procedure = run()
    assert procedure.response is not None
    # A whole turn more is the same phase, and is drawn where the model's is.
    figure = bode_figure(bode(procedure.response, truth=truth()), DT_S)
    upper, lower = figure.axes
    for axes, centre in (
        (upper, procedure.response.magnitude_db),
        (lower, procedure.response.phase_deg),
    ):
        model, dots = axes.get_lines()
        np.testing.assert_array_equal(model.get_ydata(), centre)
        assert len(axes.collections) == 1
        at = np.interp(np.log(truth().frequency_hz), np.log(model.get_xdata()), centre)
        assert np.abs(at - np.asarray(dots.get_ydata())).max() < 30.0
    # Moved by whole turns at most.
    turns = (np.asarray(dots.get_ydata()) - truth().phase_deg) / 360.0
    np.testing.assert_allclose(turns, np.round(turns[0]), atol=1e-12)


@pytest.mark.slow
def test_the_bode_figure_marks_the_margins_where_the_model_has_them() -> None:
    procedure = run()
    loop = procedure.loop
    assert procedure.response is not None
    assert loop is not None
    assert loop.half is not None
    assert loop.half.gain_crossover_hz is not None
    upper, lower = bode_figure(bode(procedure.response), DT_S, loop).axes
    assert "gain margin 6.0 dB" in upper.get_title()
    (level,) = {line.get_ydata()[0] for line in upper.get_lines() if line.get_label() == "1/k"}
    (border,) = {line.get_ydata()[0] for line in lower.get_lines() if "180" in line.get_label()}
    assert border == -180.0
    # The curves cross 1/k at the gain crossover, and have the margin there.
    at = np.log(loop.half.gain_crossover_hz)
    f = np.log(procedure.response.frequency_hz)
    assert np.interp(at, f, procedure.response.magnitude_db) == pytest.approx(level, abs=0.05)
    phase = np.interp(at, f, procedure.response.phase_deg)
    assert phase - border == pytest.approx(loop.half.phase_margin_deg, abs=0.5)


def test_proportional_control_is_told_in_words_and_tables() -> None:
    procedure = run()
    loop = procedure.loop
    assert loop is not None
    assert loop.phase_crossover_hz is not None
    words, loops, modes = loop_blocks(loop, DT_S, procedure.input_band)
    assert isinstance(words, str)
    assert isinstance(loops, Table)
    assert isinstance(modes, Table)
    assert f"stable up to k = {loop.limit_gain:.4g}" in words
    assert [float(row[0]) for row in loops.rows] == pytest.approx(
        [one.gain for one in loop.loops], rel=1e-3
    )
    assert loops.rows[1][2] == "6.0"
    assert len(modes.rows) == len(loop.modes)
    # Where the record says nothing of the frequency at which the loop oscillates, that is told.
    below = (0.0, 0.9 * loop.phase_crossover_hz)
    assert "extrapolated" in limit_words(loop, DT_S, below)
    assert "extrapolated" not in limit_words(loop, DT_S, (0.0, 2.0 * loop.phase_crossover_hz))
    assert "cycles a sample" in limit_words(loop, None, None)


@pytest.mark.slow
def test_the_pole_figure_marks_all_and_says_what_is_outside() -> None:
    procedure = run()
    assert procedure.poles_zeros is not None
    whole, near = poles_zeros_figure(procedure.poles_zeros).axes
    crosses, circles = whole.get_lines()[1], whole.get_lines()[-1]
    assert len(near.get_lines()) >= 3
    marked = [line for line in whole.get_lines() if line.get_marker() in "xo"]
    points = [np.size(line.get_xdata()) for line in marked]
    assert points == [3, 2]
    assert crosses is not circles


@pytest.mark.slow
def test_the_output_is_named_in_words_and_in_the_unit_of_the_trade() -> None:
    best = run().best
    upper, _ = outputs_figure(best, 0.05, "position_m").axes
    assert upper.get_ylabel() == "position in mm"
    assert best.simulated is not None
    assert upper.lines[0].get_ydata() == pytest.approx(1e3 * best.simulated.measured)
    figure = outputs_figure(best, 0.05, "$x_{$ \\frac{1}")
    figure.savefig(BytesIO())  # raises an error where the name is taken for a formula

# SPDX-License-Identifier: MIT
from dataclasses import replace

import numpy as np
import pytest
from bokeh.models import CrosshairTool
from made_diagnoses import made_diagnosis

from ehsid.harness.diagnosis.result import HeldOutRun
from ehsid.harness.show.gap_plots import SIMULATED, curves_of, next_plots, run_blocks
from ehsid.harness.show.page import Heading, Page, Plot, Section
from ehsid.harness.show.rendering import render_page


def run_of(samples: int) -> HeldOutRun:
    """Windows of 100 samples after 30 that are skipped; simulated = measured + 1."""
    time = np.arange(samples) * 1e-3
    window = np.maximum((np.arange(samples) - 30) // 100, -1)
    measured = {"position_m": np.sin(time)}
    simulated = {"position_m": np.sin(time) + 1.0}
    return HeldOutRun("run", time, window, time, measured, simulated, simulated, simulated)


def test_simulated_curves_break_where_a_window_ends_and_nowhere_else() -> None:
    run = run_of(530)
    columns = curves_of(run, "position_m", SIMULATED, scale=1e3, most=10_000)
    starts = [30, 130, 230, 330, 430]
    assert columns["time"].size == 530 + len(starts)
    assert not np.isnan(columns["measured"]).any()
    empty = columns["time"][np.isnan(columns["nominal"])]
    # All that is skipped at the start, and one sample drawn twice at the start of each window.
    assert np.count_nonzero(np.isnan(columns["nominal"])) == 30 + len(starts)
    assert set(np.round(empty[30:] * 1e3).astype(int)) == set(starts)
    inside = ~np.isnan(columns["augmented_error"])
    assert np.allclose(columns["augmented_error"][inside], 1e3)


def test_thinned_curves_keep_all_windows() -> None:
    columns = curves_of(run_of(100_030), "position_m", SIMULATED, scale=1.0, most=3000)
    assert columns["time"].size < 3000 + 4 * 1000 + 10
    assert np.count_nonzero(np.diff(np.isnan(columns["nominal"]).astype(int)) == 1) == 999


@pytest.mark.slow
def test_each_output_of_each_record_has_its_plots() -> None:
    run = made_diagnosis("effects").runs[0]
    blocks = run_blocks([run, replace(run, record="other")])
    assert [(block.title, block.unfolded) for block in blocks] == [
        ("held_out", True),
        ("other", False),
    ]
    for block in blocks:
        headings = [one.text.split(":")[0] for one in block.blocks if isinstance(one, Heading)]
        assert headings == ["Position", "Pressure A", "Pressure B"]
        # The command; for each output its signals and its errors.
        plots = [one.figure for one in block.blocks if isinstance(one, Plot)]
        assert len(plots) == 1 + 2 * 3
        assert len({plot.x_range for plot in plots}) == 1
        # One line at the pointer goes through all of them.
        assert len({plot.select_one(CrosshairTool).overlay for plot in plots}) == 1


def test_a_page_without_plots_needs_no_library() -> None:
    assert run_blocks([]) == []
    assert "bokeh" not in render_page(Page("Title", ["lead"], []))
    plots = next_plots(made_diagnosis("ambiguous").next_record)
    assert "bokeh" in render_page(Page("Title", ["lead"], [Section("Next", plots)]))

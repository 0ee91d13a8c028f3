# SPDX-License-Identifier: MIT
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from made_diagnoses import made_diagnosis

from ehsid.harness.gap.schema import HeldOutRun
from ehsid.harness.report.gap_curves import curves_of
from ehsid.harness.report.gap_plots import SIMULATED, next_plots, run_blocks
from ehsid.harness.report.page import Heading, Page, Plot, Section, render_page
from ehsid.harness.report.plotting import kept_samples


@given(st.integers(1, 3), st.integers(2, 4000), st.integers(10, 500), st.integers(0, 99))
def test_thinning_keeps_peaks_ends_and_order(signals: int, size: int, most: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn = [rng.standard_normal(size) for _ in range(signals)]
    always = rng.integers(0, size, 3)
    kept = kept_samples(drawn, most, always)
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0
    assert kept[-1] == size - 1
    if size > most:
        assert np.isin(always, kept).all()
    else:
        assert kept.size == size
    for signal in drawn:
        assert signal[kept].max() == signal.max()
        assert signal[kept].min() == signal.min()
    # Two of each signal in most / (2 signals) stretches, at least one; the ends, what is asked for.
    assert kept.size <= max(most, 2 * signals) + 5 + 2 * signals


def test_a_lone_peak_survives_anywhere() -> None:
    for place in range(0, 10_000, 97):
        signal = np.zeros(10_000)
        signal[place] = 1.0
        assert place in kept_samples([signal], 100)


def test_gaps_in_a_signal_are_no_peaks() -> None:
    signal = np.sin(np.arange(1000.0))
    signal[:700] = np.nan
    kept = kept_samples([signal], 50)
    assert signal[kept][~np.isnan(signal[kept])].max() == np.nanmax(signal)


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
        assert sum(isinstance(one, Plot) for one in block.blocks) == 1 + 2 * 3


def test_a_page_without_plots_needs_no_library() -> None:
    assert run_blocks([]) == []
    assert "bokeh" not in render_page(Page("Title", ["lead"], []))
    plots = next_plots(made_diagnosis("ambiguous").next_experiment.record)
    assert "bokeh" in render_page(Page("Title", ["lead"], [Section("Next", plots)]))

# SPDX-License-Identifier: MIT
"""Section of the report on the benefit of a start from the offline model."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.show.page import Picture, Section, Table
from ehsid.harness.show.plotting import draw_band, styled

from ..convergence import Starts
from ..evidence import median_interval
from ..published import DT_S
from .recursive_sections import interval_text


@styled
def _figure(starts: Mapping[float, Starts]) -> Figure:
    figure = Figure(figsize=(9, 3.6))
    panels = figure.subplots(1, len(starts), sharey=True, squeeze=False)[0]
    for axes, (noise, start) in zip(panels, starts.items(), strict=True):
        for errors, label in ((start.vague, "from nothing"), (start.seeded, "from the model")):
            time = np.arange(errors.shape[1]) * DT_S
            curves = 100.0 * np.quantile(errors, [0.05, 0.5, 0.95], axis=0)
            draw_band(axes, time + DT_S, curves, 0.15, label=label)
        axes.set(xscale="log", yscale="log")
        axes.set_title(f"noise {noise:.3g}")
        axes.set_ylim(1e-2, 200.0)
        axes.set_xlabel("time in s")
    panels[0].set_ylabel("parameter error in %")
    panels[0].legend()
    return figure


def seeding_section(starts: Mapping[float, Starts], runs: int) -> Section:
    """Returns the section that compares the seeded with the vague start, for each noise."""
    rows = []
    for noise, start in starts.items():
        seeded, vague = start.settled()
        rows.append(
            (
                f"{noise:.3g}",
                interval_text(median_interval(vague)),
                interval_text(median_interval(seeded)),
            )
        )
    return Section(
        "Seeded from the offline model",
        [
            (
                f"Model (16), default policy, {runs} runs: from nothing, and from a model of 50 s "
                "of another record and its covariance, as `ehsid export` writes it for "
                "the firmware."
            ),
            Picture(
                _figure(starts),
                "Error of the parameters, median and 5 to 95 % of the runs.",
                "Two curves for each noise: the seeded one starts where the other arrives",
            ),
            Table(
                "Samples until the error stays below 5 %, median with its 95 % interval.",
                ("noise", "from nothing", "from the model"),
                rows,
            ),
        ],
    )

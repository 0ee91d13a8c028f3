# SPDX-License-Identifier: MIT
"""Figure of K, omega_n and xi while the estimator runs."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.show.plotting import draw_band, stacked, styled

from ..reading import SIGMAS, Reading

NAMES = ("K in m/(s V)", "omega_n in rad/s", "xi")


@styled
def reading_figure(reading: Reading) -> Figure:
    """Draws K, omega_n and xi over time with their 95 % bands; grey where theta is no servo."""
    figure, panels = stacked(6.0, [1, 1, 1], xlabel="time in s")
    known = np.isfinite(reading.value).all(axis=1) & np.isfinite(reading.deviation).all(axis=1)
    for i, (axes, name) in enumerate(zip(panels, NAMES, strict=True)):
        value, deviation = reading.value[:, i], reading.deviation[:, i]
        half = SIGMAS * deviation
        draw_band(axes, reading.time_s, (value - half, value, value + half), linewidth=1.2)
        if known.any():
            # The first readings vary by orders of magnitude. The axis limits follow the later ones.
            late = value[known][known.sum() // 5 :]
            middle, reach = float(np.median(late)), float(np.ptp(late))
            margin = 0.5 * reach + 3.0 * float(np.median(deviation[known])) + 1e-12
            axes.set_ylim(min(late.min(), middle) - margin, max(late.max(), middle) + margin)
        for time, status in zip(reading.time_s, reading.status, strict=True):
            if status != "ok":
                axes.axvspan(time - reading.time_s[0], time, color="0.9", linewidth=0)
        axes.set_ylabel(name)
    return figure

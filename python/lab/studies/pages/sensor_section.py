# SPDX-License-Identifier: MIT
"""Section of the report on a noisy position sensor: the paper's factors beside other recursions.

Section of the report on the benefit of a start from the offline model.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.show.page import Picture, Section, Table
from ehsid.harness.show.plotting import draw_band, styled
from ehsid.harness.show.units import percent

from ..claims import median_interval
from ..noises import FORGETTING, N_SAMPLES, PUBLISHED_FIT, THETA, Runs, read
from ..rig_records import DT_S
from ..verdicts import Starts
from .recursive_sections import interval_text


def _reading(found: Runs) -> tuple[str, ...]:
    """K, omega_n and xi, medians; a dash where more than a tenth of the runs is no servo."""
    if float(np.mean(np.isnan(found.reading))) > 0.1:
        return ("-", "-", "-")
    return tuple(f"{value:.3g}" for value in np.nanmedian(found.reading, axis=0))


def sensor_section(results: Mapping[str, Runs], runs: int) -> Section:
    """Returns the section that compares the recursions with noise of the position sensor."""
    rows = [
        (
            name,
            f"{100.0 * found.error:.2f}",
            percent(found.coverage),
            percent(found.within_three),
            *_reading(found),
        )
        for name, found in results.items()
    ]
    truth = ", ".join(f"{value:.3g}" for value in read(THETA))
    return Section(
        "A noisy position sensor",
        [
            (
                f"Model (16), {runs} runs of {N_SAMPLES * DT_S:g} s, random command of +-1 V. The "
                f"noise is white and added to the measured position, so that the fit is that of "
                f"the paper, {PUBLISHED_FIT.sensor_fit:g} %. Least squares is then biased with "
                f"every forgetting factor of the paper, because the noise is in the regressor. The "
                f"other recursions run with {FORGETTING!r}. True K, omega_n and xi: {truth}."
            ),
            Table(
                "Error |theta_hat - theta| / |theta| after the whole record, median of the runs; "
                "90 % intervals of single parameters that contain the truth; runs whose worst "
                "parameter is within three of its own deviations; physical reading, median.",
                (
                    "recursion",
                    "error, %",
                    "90 % intervals",
                    "worst within 3",
                    "K, m/(s V)",
                    "omega_n, rad/s",
                    "xi",
                ),
                rows,
            ),
        ],
    )


def plain_sensor(results: Mapping[str, Runs]) -> list[dict[str, Any]]:
    """Returns the same for the JSON file."""
    return [
        {
            "recursion": name,
            "error": found.error,
            "coverage_90": found.coverage,
            "worst_within_three": found.within_three,
            "no_servo": float(np.mean(np.isnan(found.reading).any(axis=1))),
        }
        for name, found in results.items()
    ]


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

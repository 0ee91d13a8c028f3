# SPDX-License-Identifier: MIT
"""Section of the report on a noisy position sensor: the paper's factors beside other recursions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ehsid.harness.show.page import Section, Table
from ehsid.harness.show.shares import percent

from ..noises import FORGETTING, N_SAMPLES, PUBLISHED_FIT, THETA, Runs, read
from ..published import DT_S


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

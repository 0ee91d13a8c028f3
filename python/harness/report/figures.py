# SPDX-License-Identifier: MIT
"""Draws the figures of a recursive estimation and of an offline identification."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ehsid.harness.estimation import EstimationResult
from ehsid.harness.identification import IdentificationResult


def _axis_of(dt_s: float | None, n: int) -> tuple[np.ndarray, str]:
    return (np.arange(n), "sample") if dt_s is None else (np.arange(n) * dt_s, "time in s")


def estimation_figure(result: EstimationResult, dt_s: float | None) -> Figure:
    """Draws parameters with their 95 % bands, forgetting factor and innovation over time."""
    figure = Figure(figsize=(9, 8), layout="constrained")
    upper, middle, lower = figure.subplots(3, 1, sharex=True, height_ratios=[3, 1, 1])
    x, label = _axis_of(dt_s, result.status.size)
    # The first samples and those after a reset vary by orders of magnitude. The axis follows the
    # other samples.
    settled = result.theta_path[result.theta_path.shape[0] // 10 :]
    for i, name in enumerate(result.orders.names):
        (line,) = upper.plot(x, result.theta_path[:, i], label=name, linewidth=1.2)
        half = 1.96 * result.deviation_path[:, i]
        upper.fill_between(
            x,
            result.theta_path[:, i] - half,
            result.theta_path[:, i] + half,
            color=line.get_color(),
            alpha=0.2,
            linewidth=0,
        )
    low, high = (float(value) for value in np.quantile(settled, [0.02, 0.98]))
    margin = 0.3 * (high - low) + 1e-12
    upper.set_ylim(low - margin, high + margin)
    upper.set_ylabel("parameters, 95 % band")
    upper.legend(ncols=len(result.orders.names), fontsize="small")
    upper.set_title(result.forgetting)
    middle.plot(x, result.forgetting_factor, color="tab:green", linewidth=1.0)
    middle.set_ylabel("lambda")
    middle.margins(x=0.0)
    lower.plot(x, result.innovation, color="tab:gray", linewidth=0.8)
    lower.set_ylim(-6 * result.rmse, 6 * result.rmse)
    lower.set_ylabel("innovation")
    lower.set_xlabel(label)
    return figure


def identification_figure(result: IdentificationResult) -> Figure:
    """Draws measured and simulated output, and both residual tests with their 99 % bands."""
    figure = Figure(figsize=(9, 8), layout="constrained")
    upper, middle, lower = figure.subplots(3, 1, height_ratios=[2, 1, 1])
    _, label = _axis_of(result.dt_s, 1)
    step = 1.0 if result.dt_s is None else result.dt_s
    upper.plot(result.simulated.index * step, result.simulated.measured, label="measured")
    upper.plot(
        result.simulated.index * step,
        result.simulated.predicted,
        label=f"simulated, fit {result.chosen.simulation_fit_percent:.1f} %",
    )
    upper.set_xlabel(label)
    upper.margins(x=0.0)
    upper.legend()
    upper.set_title(f"validation half, {result.chosen.orders}")
    for axes, test, title in (
        (middle, result.whiteness, "autocorrelation of the residual"),
        (lower, result.independence, "correlation of residual and input"),
    ):
        axes.axhspan(-test.band, test.band, color="tab:orange", alpha=0.25)
        axes.axhline(0.0, color="0.5", linewidth=0.8)
        axes.vlines(test.lags, 0.0, test.correlation, linewidth=2.0)
        axes.set_title(f"{title}, 99 % band of a single lag", fontsize="medium", loc="left")
    lower.set_xlabel("lag in samples")
    return figure

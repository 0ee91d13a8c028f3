# SPDX-License-Identifier: MIT
"""Draws figures of runs with the hardware in the loop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.models.estimation.servo import ServoPath
from ehsid.harness.show.model_figures import draw_servo_value
from ehsid.harness.show.plotting import GREEN, GREY, ORANGE, VERMILION, stacked, styled

from .comparison import Agreement
from .run import RunResult


def _time(run: RunResult) -> FloatArray:
    return np.arange(len(run.results), dtype=np.float64) * run.plan.dt_s


def _limits(curves: npt.NDArray[np.floating[Any]]) -> tuple[float, float]:
    """Returns the limits of an axis, from quantiles of the curves after their first fifth.

    After a vague start or a reset, a few samples lie far outside the range of interest.
    """
    low, high = (float(x) for x in np.quantile(curves[len(curves) // 5 :], [0.01, 0.99]))
    margin = 0.2 * (high - low) + 1e-12
    return low - margin, high + margin


def _events(axes: Axes, run: RunResult) -> None:
    """Marks with vertical lines where target or estimator began anew, or the plant changed."""
    if run.plan.change_at is not None:
        axes.axvline(run.plan.change_at * run.plan.dt_s, color=GREY, linewidth=1.0)
    for sample in (*run.restarts, *run.begun):
        axes.axvline(sample * run.plan.dt_s, color=VERMILION, linewidth=1.0, linestyle=":")


@styled
def estimates_figure(runs: Sequence[tuple[str, RunResult, Agreement]]) -> Figure:
    """Draws parameters and forgetting factor over time, one column for each run.

    The target is drawn in colour, the host dashed.
    """
    figure = Figure(figsize=(max(8.0, 3.1 * len(runs)), 7.5))
    grid = figure.subplots(
        3, len(runs), sharex=True, sharey="row", squeeze=False, height_ratios=[3, 3, 1.2]
    )
    orders = runs[0][1].plan.configuration.estimator.orders
    groups = (
        (range(orders.na), 1.0, "a"),
        (range(orders.na, orders.na + orders.nb), 1e3, "b in mm/V"),
    )
    for row, (members, scale, label) in enumerate(groups):
        where = list(members)
        limits = [_limits(scale * agreement.replay.theta[:, where]) for *_, agreement in runs]
        for column, (name, run, agreement) in enumerate(runs):
            axes, time = grid[row, column], _time(run)
            for i in where:
                axes.plot(time, scale * agreement.theta[:, i], linewidth=2.0, label=orders.names[i])
                axes.plot(time, scale * agreement.replay.theta[:, i], "k--", linewidth=0.6)
            _events(axes, run)
            axes.margins(x=0.0)
            if row == 0:
                axes.set_title(name)
        grid[row, 0].set_ylim(min(low for low, _ in limits), max(high for _, high in limits))
        grid[row, 0].set_ylabel(label)
        grid[row, -1].legend(loc="upper right")
    for column, (_, run, _) in enumerate(runs):
        axes = grid[2, column]
        axes.plot(_time(run), [r.forgetting_factor for r in run.arx_results], color=GREEN)
        axes.set_xlabel("time in s")
    grid[2, 0].set_ylabel("lambda")
    return figure


@styled
def servo_figure(run: RunResult, servo: ServoPath, host: ServoPath) -> Figure:
    """Draws K, omega_n and xi over time with their bands, and those of the host dashed."""
    figure, rows = stacked(8.0, [1, 1, 1], xlabel="time in s")
    for axes, value, ours in zip(rows, servo, host, strict=True):
        draw_servo_value(axes, _time(run), value)
        axes.plot(_time(run), ours.path, "k--", linewidth=0.6)
        _events(axes, run)
    rows[0].set_xlim(0.0, len(run.results) * run.plan.dt_s)
    return figure


@styled
def control_figure(run: RunResult) -> Figure:
    """Draws reference and position, their difference, the command, and the gain of the target."""
    figure, (path, error, command, gain) = stacked(8.0, [2, 1, 1, 1.5], xlabel="time in s")
    time, controller = _time(run), run.plan.configuration.controller
    reference = run.plan.reference_m[: time.size]
    path.plot(time, 1e3 * reference, "k--", linewidth=1.0, label="reference")
    path.plot(time, 1e3 * run.position_m[: time.size], linewidth=1.2, label="position")
    path.set_ylabel("mm")
    path.legend(ncols=2, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    error.plot(time, 1e3 * (reference - run.position_m[: time.size]), linewidth=0.8)
    error.set_ylabel("error in mm")
    command.plot(time, run.command_v, linewidth=0.8)
    command.set_ylabel("command in V")
    used = np.array([result.gain_v_m for result in run.results])
    retuned = np.array([result.gain_estimated for result in run.results])
    gain.plot(time, used, linewidth=1.2, label="gain used")
    fixed, bounds = controller.fixed_gain_v_m, (controller.gain_min_v_m, controller.gain_max_v_m)
    gain.axhline(fixed, color=GREY, linestyle="--", linewidth=1.0, label="fixed")
    gain.axhspan(*bounds, color=ORANGE, alpha=0.12, label="bounds")
    gain.fill_between(
        time,
        0.0,
        0.06,
        where=retuned.tolist(),
        transform=gain.get_xaxis_transform(),
        color=GREEN,
        alpha=0.6,
        linewidth=0.0,
        label="from the estimate",
    )
    gain.set_ylabel("gain in V/m")
    gain.legend(ncols=4, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    for axes in (path, error, command, gain):
        _events(axes, run)
        axes.margins(x=0.0)
    return figure

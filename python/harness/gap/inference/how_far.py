# SPDX-License-Identifier: MIT
"""Reduction of the gap on held-out records, with intervals from a bootstrap over windows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.data.bootstrap import drawn_windows, interval
from ehsid.harness.gap.data.floor import NoiseFloor
from ehsid.harness.gap.model.comparison import Compared
from ehsid.harness.gap.schema import Estimate, HowFar


@dataclass(frozen=True, eq=False)
class WindowSums:
    """Sums over each window, by output, shape (W,) each.

    Attributes
    ----------
    error, spread
        sums of squared errors, and of squared measured values less their window's mean, in the
        squared unit of the output.
    count
        number of samples.
    """

    error: Mapping[str, FloatArray]
    spread: Mapping[str, FloatArray]
    count: FloatArray


def _by_window(numbers: npt.NDArray[np.int64], values: FloatArray) -> FloatArray:
    return np.asarray(np.bincount(numbers, values), dtype=np.float64)


def window_sums(
    records: Sequence[Compared],
    simulated: Sequence[Mapping[str, FloatArray]],
    outputs: Sequence[str],
) -> WindowSums:
    """Computes the sums over the windows of all records, window after window.

    simulated: for each record the simulated outputs by name, shape (N,).
    """
    errors: dict[str, list[FloatArray]] = {name: [] for name in outputs}
    spreads: dict[str, list[FloatArray]] = {name: [] for name in outputs}
    counts = []
    for record, shown in zip(records, simulated, strict=True):
        numbers = record.window[record.used]
        counts.append(_by_window(numbers, np.ones(numbers.size)))
        for name in outputs:
            error = (shown[name] - record.outputs[name])[record.used]
            spread = record.centred(record.outputs[name])
            errors[name].append(_by_window(numbers, error**2))
            spreads[name].append(_by_window(numbers, spread**2))
    # Windows of the blocks that are not compared have a number here, but no samples.
    count = np.concatenate(counts)
    held = count > 0.0
    return WindowSums(
        {name: np.concatenate(parts)[held] for name, parts in errors.items()},
        {name: np.concatenate(parts)[held] for name, parts in spreads.items()},
        count[held],
    )


def _gaps(sums: WindowSums, chosen: npt.NDArray[np.int64]) -> FloatArray:
    """Normalised rms error (nrmse) by output over the chosen windows, shape (outputs,)."""
    return np.array(
        [
            np.sqrt(sums.error[name][chosen].sum() / sums.spread[name][chosen].sum())
            for name in sums.error
        ]
    )


def _floors(
    sums: WindowSums, floors: Mapping[str, NoiseFloor], end: str, chosen: npt.NDArray[np.int64]
) -> FloatArray:
    return np.array(
        [
            getattr(floors[name], end)
            * np.sqrt(sums.count[chosen].sum() / sums.spread[name][chosen].sum())
            for name in sums.error
        ]
    )


def how_far(
    nominal: WindowSums,
    calibrated: WindowSums,
    augmented: WindowSums,
    floors: Mapping[str, NoiseFloor],
    rng: np.random.Generator,
) -> HowFar:
    """Computes the figures of the gap and their intervals from the sums of three simulations.

    The same windows are drawn for all three.
    """
    windows = calibrated.count.size
    every = np.arange(windows)
    gaps = {
        name: _gaps(sums, every)
        for name, sums in (
            ("nominal", nominal),
            ("calibrated", calibrated),
            ("augmented", augmented),
        )
    }

    def shares(chosen: npt.NDArray[np.int64]) -> tuple[float, float]:
        before, after, told = (
            float(_gaps(sums, chosen).mean()) for sums in (calibrated, augmented, nominal)
        )
        floor = float(_floors(calibrated, floors, "value", chosen).mean())
        explainable = (before - after) / (before - floor) if before > floor else np.nan
        return explainable, (told - after) / told if told > 0.0 else 0.0

    drawn = np.array([shares(chosen) for chosen in drawn_windows(windows, rng)])
    of_explainable, from_nominal = shares(every)

    def share(value: float, column: int) -> Estimate:
        return Estimate(value, *interval(drawn[:, column]))

    return HowFar(
        nominal=float(gaps["nominal"].mean()),
        calibrated=float(gaps["calibrated"].mean()),
        augmented=float(gaps["augmented"].mean()),
        noise_floor=(
            float(_floors(calibrated, floors, "low", every).mean()),
            float(_floors(calibrated, floors, "high", every).mean()),
        ),
        of_explainable=share(of_explainable, 0) if np.isfinite(of_explainable) else None,
        from_nominal=share(from_nominal, 1),
        per_output={
            name: (
                float(gaps["nominal"][i]),
                float(gaps["calibrated"][i]),
                float(gaps["augmented"][i]),
            )
            for i, name in enumerate(calibrated.error)
        },
    )

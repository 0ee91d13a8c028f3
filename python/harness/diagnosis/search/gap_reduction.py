# SPDX-License-Identifier: MIT
"""Reduction of the gap on held-out records, with intervals from a bootstrap over windows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from msgspec.structs import replace as replace_struct

from ...base.numbers import FloatArray
from ..data.floor import NoiseFloor
from ..data.regimes import BOOTSTRAP_SEED, drawn_windows, interval
from ..model.comparison import Compared
from ..schema import Gaps, HowFar, Value


@dataclass(frozen=True, eq=False)
class WindowSums:
    """Sums over each window, by output, shape (W,) each."""

    error: Mapping[str, FloatArray]
    spread: Mapping[str, FloatArray]
    """Sums of squared errors, and of squared measured values less their window's mean, in the
    squared unit of the output."""
    count: FloatArray
    """Number of samples."""


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
    for record, signals in zip(records, simulated, strict=True):
        numbers = record.window[record.used]
        counts.append(_by_window(numbers, np.ones(numbers.size)))
        for name in outputs:
            error = (signals[name] - record.outputs[name])[record.used]
            spread = record.centred(record.outputs[name])
            errors[name].append(_by_window(numbers, error**2))
            spreads[name].append(_by_window(numbers, spread**2))
    # Windows of the blocks that are not compared have a number here, but no samples.
    count = np.concatenate(counts)
    compared = count > 0.0
    return WindowSums(
        {name: np.concatenate(parts)[compared] for name, parts in errors.items()},
        {name: np.concatenate(parts)[compared] for name, parts in spreads.items()},
        count[compared],
    )


def _gaps(sums: WindowSums, windows: npt.NDArray[np.int64]) -> FloatArray:
    """Normalised rms error (nrmse) by output over these windows, shape (outputs,)."""
    return np.array(
        [
            np.sqrt(sums.error[name][windows].sum() / sums.spread[name][windows].sum())
            for name in sums.error
        ]
    )


def mean_gap(sums: WindowSums) -> float:
    """Normalised rms error (nrmse) over all windows, mean of the outputs."""
    return float(_gaps(sums, np.arange(sums.count.size)).mean())


def _floors(
    reached: WindowSums, floors: Mapping[str, NoiseFloor], end: str, windows: npt.NDArray[np.int64]
) -> FloatArray:
    """Noise floor by output as nrmse, shape (outputs,); never above the error that was reached.

    A simulation cannot reproduce the noise. Where its error is smaller than an estimate of the
    floor, the estimate is too high. The upper end of its interval stays.
    """
    shares = np.array(
        [
            getattr(floors[name], end)
            * np.sqrt(reached.count[windows].sum() / reached.spread[name][windows].sum())
            for name in reached.error
        ]
    )
    return shares if end == "high" else np.minimum(shares, _gaps(reached, windows))


def explained_share(
    calibrated: WindowSums,
    augmented: WindowSums,
    floors: Mapping[str, NoiseFloor],
    reached: WindowSums,
    windows: npt.NDArray[np.int64] | None = None,
) -> float | None:
    """Share of the gap above the noise floor that is removed; None where nothing is above it.

        (gap_calibrated - gap_augmented) / (gap_calibrated - floor)

    reached: sums of the simulation whose errors the noise floor cannot exceed.
    windows: numbers of the windows that count, shape (any,), with repetitions; default: each once.
    """
    if windows is None:
        windows = np.arange(calibrated.count.size)
    before, after = (float(_gaps(sums, windows).mean()) for sums in (calibrated, augmented))
    floor = float(_floors(reached, floors, "value", windows).mean())
    return (before - after) / (before - floor) if before > floor else None


def gap_reduction(
    nominal: WindowSums,
    calibrated: WindowSums,
    augmented: WindowSums,
    floors: Mapping[str, NoiseFloor],
    seed: int = BOOTSTRAP_SEED,
) -> HowFar:
    """Computes the gaps, their reduction and its intervals from the sums of three simulations.

    The same windows are drawn for all three.
    """
    window_count = calibrated.count.size
    all_windows = np.arange(window_count)
    gaps = {
        name: _gaps(sums, all_windows)
        for name, sums in (
            ("nominal", nominal),
            ("calibrated", calibrated),
            ("augmented", augmented),
        )
    }

    def shares(windows: npt.NDArray[np.int64]) -> tuple[float, float]:
        after, configured = (float(_gaps(sums, windows).mean()) for sums in (augmented, nominal))
        share = explained_share(calibrated, augmented, floors, augmented, windows)
        explainable = np.nan if share is None else share
        return explainable, (configured - after) / configured if configured > 0.0 else 0.0

    drawn = np.array([shares(windows) for windows in drawn_windows(window_count, seed)])
    of_explainable, from_nominal = shares(all_windows)

    def share(value: float, column: int) -> Value:
        return Value(value, interval(drawn[:, column]))

    return HowFar(
        nominal=float(gaps["nominal"].mean()),
        calibrated=float(gaps["calibrated"].mean()),
        augmented=float(gaps["augmented"].mean()),
        noise_floor=(
            float(_floors(augmented, floors, "low", all_windows).mean()),
            float(_floors(augmented, floors, "high", all_windows).mean()),
        ),
        shrinkage_of_explainable=share(of_explainable, 0)
        if np.isfinite(of_explainable)
        else Value.of(None),
        shrinkage_from_nominal=share(from_nominal, 1),
        gaps={
            name: Gaps(*(float(each[i]) for each in gaps.values()))
            for i, name in enumerate(calibrated.error)
        },
    )


# Distances by which intervals of 90 % of a shrinkage had to be wider to hold for other motions of
# 1,000 generated machines, at the low and the high end, with pressures (True) and with the position
# alone (False); as `intervals.SIZE_FURTHER`.
SHRINKAGE_FURTHER = {True: (0.297, 0.253), False: (0.363, 0.367)}
SHRINKAGE_FURTHER_FROM_NOMINAL = {True: (0.169, 0.139), False: (0.357, 0.079)}


def reduction_between_machines(reduction: HowFar, pressures: bool) -> HowFar:
    """Returns the reduction of the gap by effects, with intervals for other motions."""
    of_explainable = _further(reduction.shrinkage_of_explainable, SHRINKAGE_FURTHER[pressures])
    from_nominal = _further(
        reduction.shrinkage_from_nominal, SHRINKAGE_FURTHER_FROM_NOMINAL[pressures]
    )
    return replace_struct(
        reduction, shrinkage_of_explainable=of_explainable, shrinkage_from_nominal=from_nominal
    )


def _further(share: Value, distances: tuple[float, float]) -> Value:
    """Moves the ends of a share outwards; no more than the whole gap can vanish."""
    low, high = share.ci90
    return Value(share.value, (low - distances[0], max(high, min(high + distances[1], 1.0))))

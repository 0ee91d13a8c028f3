# SPDX-License-Identifier: MIT
"""With the position alone: which subsystem's process noise explains the calibrated error best.

Noise enters one subsystem of the linearised servo at a time. Over a window the error of the
position is then normal with covariance q S + floor^2 I, S known, q its intensity. The likelihood is
that of the innovations of a Kalman filter with this noise (F. C. Schweppe, IEEE Trans. Inf. Theory
11(1), 1965); the eigenvalues of S give it for every q at once. A sensor is in error by white noise,
timing by a delay that wanders, times the measured speed.

Modest: effects are no noise, and what enters by the valve looks much like what enters by the oil.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.model.inverse_signals import all_values
from ehsid.harness.gap.model.linear_noise import linear_servo, position_covariance
from ehsid.harness.gap.model.problem import Problem
from ehsid.harness.gap.thresholds import (
    BOOTSTRAP_DRAWS,
    DISTURBANCES_HZ,
    NOISE_INTENSITIES,
    NOISE_STEPS,
    NOISE_TELLS,
    PROCESS_NOISE_S,
)
from ehsid.harness.simulation import command_limit, measured_states


@dataclass(frozen=True, eq=False)
class NoiseNeeded:
    """What the process noise of each subsystem would explain.

    Attributes
    ----------
    deviation
        rms of the position that each needs within a window, m.
    behind
        nats per averaged error behind the best.
    subsystem
        share of draws of the windows in which each explains best, shared among those that cannot be
        told apart; sum 1, or empty where the noise of the sensor alone explains as much.
    """

    deviation: Mapping[str, float]
    behind: Mapping[str, float]
    subsystem: Mapping[str, float]


def noise_needed(
    problem: Problem, values: Mapping[str, float], error: FloatArray, *, seed: int = 0
) -> NoiseNeeded | None:
    """Compare the subsystems; None where the plant has no such model or a window is too short.

    Parameters
    ----------
    problem
        of the calibration.
    values
        calibrated, by full name.
    error
        of the position inside the windows, each less its mean, shape (N,).
    seed
        of the bootstrap over windows.
    """
    if problem.rig.plant not in ("ehs", "axis"):
        return None
    dt_s = problem.records[0].dt_s
    step = max(1, round(PROCESS_NOISE_S / dt_s))
    speed = np.concatenate([measured_states(one.record)[one.used, 1] for one in problem.records])
    windows = [
        (error[part], speed[part])
        for part in _windows(problem)
        if part.stop - part.start >= 4 * step
    ]
    longest = max((e.size for e, _ in windows), default=0)
    full = [(e, v) for e, v in windows if e.size == longest]
    count = longest // step
    if count < 4 or any(one.dt_s != dt_s for one in problem.records):
        return None

    def averaged(samples: FloatArray) -> FloatArray:
        return np.asarray(samples[: count * step].reshape(count, step).mean(axis=1))

    errors = np.array([averaged(e) for e, _ in full])
    speeds = np.array([averaged(v) for _, v in full])
    # The mean of a window is gone: all that is left is orthogonal to it.
    basis = np.linalg.qr(np.column_stack([np.ones(count), np.eye(count)[:, 1:]]))[0][:, 1:]
    white = problem.floors["position_m"] ** 2 / step
    likelihoods, deviations = {}, {}
    for subsystem, choices in _covariances(problem, values, count, step * dt_s, speeds).items():
        tried = [_likelihood(errors @ basis, basis, s, white) for s in choices]
        likelihoods[subsystem], deviations[subsystem] = max(tried, key=lambda one: one[0].sum())
    per_error = {name: rows / (count - 1) for name, rows in likelihoods.items()}
    best = max(float(rows.mean()) for rows in per_error.values())
    behind = {name: best - float(rows.mean()) for name, rows in per_error.items()}
    inside = (errors @ basis) ** 2
    alone = -0.5 * float(np.mean(np.log(white) + inside / white))
    if best - alone < NOISE_TELLS:
        return NoiseNeeded(deviations, behind, {})
    return NoiseNeeded(deviations, behind, _shares(per_error, np.random.default_rng(seed)))


def _windows(problem: Problem) -> list[slice]:
    """Of the samples inside windows, record after record."""
    found, first = [], 0
    for one in problem.records:
        numbers = one.window[one.used]
        edges = [*np.flatnonzero(np.diff(numbers, prepend=-1)).tolist(), numbers.size]
        found += [slice(first + a, first + b) for a, b in pairwise(edges)]
        first += numbers.size
    return found


def _covariances(
    problem: Problem, values: Mapping[str, float], count: int, dt_s: float, speeds: FloatArray
) -> dict[str, list[FloatArray]]:
    """By subsystem: covariances of one window, or of each, that its disturbance may have."""
    told = all_values(problem.rig, values)
    command = np.concatenate([one.record.column("command_v")[one.used] for one in problem.records])
    opening = float(np.sqrt(np.mean(command**2))) / command_limit(problem.rig)
    state, entries = linear_servo(told, problem.rig.plant, max(opening, 1e-3))
    found = {
        subsystem: [
            np.sum([position_covariance(state, b, corner_hz, dt_s, count) for b in enters], axis=0)
            / len(enters)
            for corner_hz in DISTURBANCES_HZ
        ]
        for subsystem, enters in entries.items()
    }
    found["sensor"] = [np.eye(count)]
    lags = dt_s * np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    scale = float(np.mean(speeds**2)) or 1.0
    found["timing"] = [
        speeds[:, :, np.newaxis]
        * np.exp(-2.0 * np.pi * corner_hz * lags)
        * speeds[:, np.newaxis, :]
        / scale
        for corner_hz in DISTURBANCES_HZ
    ]
    return found


def _likelihood(
    errors: FloatArray, basis: FloatArray, covariance: FloatArray, white: float
) -> tuple[FloatArray, float]:
    """Log-likelihood of each window at the best intensity, shape (W,), and its deviation, m."""
    inside = basis.T @ covariance @ basis
    if inside.ndim == 2:
        sizes, ways = eigh(inside)
        squares = (errors @ ways) ** 2
        sizes = np.broadcast_to(sizes, squares.shape)
    else:
        sizes, ways = np.linalg.eigh(inside)
        squares = np.einsum("wi,wij->wj", errors, ways) ** 2
    sizes = np.maximum(sizes, 0.0)
    best: tuple[FloatArray, float] | None = None
    for intensity in white * np.geomspace(*NOISE_INTENSITIES, NOISE_STEPS):
        variance = intensity * sizes + white
        rows = -0.5 * np.sum(np.log(variance) + squares / variance, axis=1)
        if best is None or rows.sum() > best[0].sum():
            best = rows, float(np.sqrt(intensity))
    assert best is not None
    return best


def _shares(per_error: Mapping[str, FloatArray], rng: np.random.Generator) -> dict[str, float]:
    """Share of draws of whole windows in which a subsystem is best, ties in equal parts."""
    names = list(per_error)
    rows = np.array([per_error[name] for name in names])
    draws = rng.integers(rows.shape[1], size=(BOOTSTRAP_DRAWS, rows.shape[1]))
    means = rows[:, draws].mean(axis=2)
    near = means > means.max(axis=0) - NOISE_TELLS
    shares = (near / near.sum(axis=0)).mean(axis=1)
    return dict(zip(names, shares.tolist(), strict=True))

# SPDX-License-Identifier: MIT
"""Subsystem whose process noise best explains the calibrated error, from the position alone.

Noise enters one subsystem of the linearised servo at a time. Over a window the position error is
then normal with the covariance q S + floor^2 I, with S known and the intensity q. The likelihood is
that of the innovations of a Kalman filter with this noise (F. C. Schweppe, IEEE Trans. Inf. Theory
11(1), 1965). The eigenvalues of S give it for every q at once. The error of a sensor is modelled as
white noise. The error of timing is modelled as a varying delay times the measured speed.

The reliability is limited: effects are not noise, and disturbances at the valve and in the oil have
similar consequences.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg import eigh

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.data.bootstrap import drawn_windows
from ehsid.harness.gap.model.inverse_signals import all_values
from ehsid.harness.gap.model.linear_noise import linear_servo, position_covariance
from ehsid.harness.gap.model.problem import Problem
from ehsid.harness.gap.thresholds import (
    DISTURBANCES_HZ,
    NOISE_INTENSITIES,
    NOISE_STEPS,
    NOISE_TELLS,
    PROCESS_NOISE_S,
)
from ehsid.harness.simulation import command_limit, measured_states


@dataclass(frozen=True, eq=False)
class NoiseNeeded:
    """Process noise that each subsystem needs to explain the position error.

    Attributes
    ----------
    deviation
        rms of the position error that each subsystem needs within a window, m.
    deficit
        log-likelihood below that of the best subsystem, nats per averaged error.
    subsystem
        share of bootstrap draws of the windows in which each subsystem explains the error best.
        Subsystems that cannot be distinguished share a draw. The sum is 1. Empty if the noise floor
        of the sensor alone explains the error as well.
    """

    deviation: Mapping[str, float]
    deficit: Mapping[str, float]
    subsystem: Mapping[str, float]


def noise_needed(
    problem: Problem, values: Mapping[str, float], error: FloatArray, *, seed: int = 0
) -> NoiseNeeded | None:
    """Compares the process noise of the subsystems by its likelihood.

    The result is None if the plant has no such model, if the windows are too short, or if the
    records have different sampling times.

    Parameters
    ----------
    problem
        the problem of the calibration.
    values
        calibrated values by full name.
    error
        error of the position inside the windows, less the mean of each window, m, shape (N,).
    seed
        seed of the bootstrap over windows.
    """
    if problem.rig.plant not in ("ehs", "axis"):
        return None
    dt_s = problem.records[0].dt_s
    step = max(1, round(PROCESS_NOISE_S / dt_s))
    speed = np.concatenate(
        [measured_states(record.record)[record.used, 1] for record in problem.records]
    )
    windows = [
        (error[part], speed[part])
        for part in _windows(problem)
        if part.stop - part.start >= 4 * step
    ]
    longest = max((e.size for e, _ in windows), default=0)
    full = [(e, v) for e, v in windows if e.size == longest]
    count = longest // step
    if count < 4 or any(record.dt_s != dt_s for record in problem.records):
        return None

    def averaged(samples: FloatArray) -> FloatArray:
        return np.asarray(samples[: count * step].reshape(count, step).mean(axis=1))

    errors = np.array([averaged(e) for e, _ in full])
    speeds = np.array([averaged(v) for _, v in full])
    # The errors have no window mean any more: the basis spans all that is orthogonal to it.
    basis = np.linalg.qr(np.column_stack([np.ones(count), np.eye(count)[:, 1:]]))[0][:, 1:]
    white = problem.floors["position_m"] ** 2 / step
    likelihoods, deviations = {}, {}
    for subsystem, covariances in _covariances(problem, values, count, step * dt_s, speeds).items():
        fits = [_likelihood(errors @ basis, basis, covariance, white) for covariance in covariances]
        likelihoods[subsystem], deviations[subsystem] = max(fits, key=lambda fit: fit[0].sum())
    per_error = {name: rows / (count - 1) for name, rows in likelihoods.items()}
    best = max(float(rows.mean()) for rows in per_error.values())
    deficit = {name: best - float(rows.mean()) for name, rows in per_error.items()}
    squares = (errors @ basis) ** 2
    white_only = -0.5 * float(np.mean(np.log(white) + squares / white))
    if best - white_only < NOISE_TELLS:
        return NoiseNeeded(deviations, deficit, {})
    return NoiseNeeded(deviations, deficit, _shares(per_error, np.random.default_rng(seed)))


def _windows(problem: Problem) -> list[slice]:
    """Slice of each window in the samples inside windows, in the order of the records."""
    windows, first = [], 0
    for record in problem.records:
        numbers = record.window[record.used]
        edges = [*np.flatnonzero(np.diff(numbers, prepend=-1)).tolist(), numbers.size]
        windows += [slice(first + a, first + b) for a, b in pairwise(edges)]
        first += numbers.size
    return windows


def _covariances(
    problem: Problem, values: Mapping[str, float], count: int, dt_s: float, speeds: FloatArray
) -> dict[str, list[FloatArray]]:
    """Possible covariances of the averaged position error within a window, by subsystem.

    There is one per corner frequency, and a single one for the sensor. A covariance has the shape
    (count, count), or (windows, count, count) if it differs by window.
    """
    plant_values = all_values(problem.rig, values)
    command = np.concatenate(
        [record.record.column("command_v")[record.used] for record in problem.records]
    )
    opening = float(np.sqrt(np.mean(command**2))) / command_limit(problem.rig)
    state, entries = linear_servo(plant_values, problem.rig.plant, max(opening, 1e-3))
    covariances = {
        subsystem: [
            np.sum([position_covariance(state, b, corner_hz, dt_s, count) for b in inputs], axis=0)
            / len(inputs)
            for corner_hz in DISTURBANCES_HZ
        ]
        for subsystem, inputs in entries.items()
    }
    covariances["sensor"] = [np.eye(count)]
    lags = dt_s * np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    scale = float(np.mean(speeds**2)) or 1.0
    covariances["timing"] = [
        speeds[:, :, np.newaxis]
        * np.exp(-2.0 * np.pi * corner_hz * lags)
        * speeds[:, np.newaxis, :]
        / scale
        for corner_hz in DISTURBANCES_HZ
    ]
    return covariances


def _likelihood(
    errors: FloatArray, basis: FloatArray, covariance: FloatArray, white: float
) -> tuple[FloatArray, float]:
    """Log-likelihood of each window at the best intensity q, nats, (W,), and sqrt(q), m."""
    reduced = basis.T @ covariance @ basis
    if reduced.ndim == 2:
        eigenvalues, eigenvectors = eigh(reduced)
        squares = (errors @ eigenvectors) ** 2
        eigenvalues = np.broadcast_to(eigenvalues, squares.shape)
    else:
        eigenvalues, eigenvectors = np.linalg.eigh(reduced)
        squares = np.einsum("wi,wij->wj", errors, eigenvectors) ** 2
    eigenvalues = np.maximum(eigenvalues, 0.0)
    best: tuple[FloatArray, float] | None = None
    for intensity in white * np.geomspace(*NOISE_INTENSITIES, NOISE_STEPS):
        variance = intensity * eigenvalues + white
        rows = -0.5 * np.sum(np.log(variance) + squares / variance, axis=1)
        if best is None or rows.sum() > best[0].sum():
            best = rows, float(np.sqrt(intensity))
    assert best is not None
    return best


def _shares(per_error: Mapping[str, FloatArray], rng: np.random.Generator) -> dict[str, float]:
    """Share of bootstrap draws of whole windows in which each subsystem is best.

    Subsystems within NOISE_TELLS of the best one share a draw in equal parts.
    """
    names = list(per_error)
    rows = np.array([per_error[name] for name in names])
    means = rows[:, drawn_windows(rows.shape[1], rng)].mean(axis=2)
    near_best = means > means.max(axis=0) - NOISE_TELLS
    shares = (near_best / near_best.sum(axis=0)).mean(axis=1)
    return dict(zip(names, shares.tolist(), strict=True))

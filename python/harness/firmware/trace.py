# SPDX-License-Identifier: MIT
"""Golden trace for the self-test of the target: some samples and the results of the estimator."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..models.identification import IoData
from .configuration import EstimatorConfiguration

Float32 = npt.NDArray[np.float32]

TRACE_SAMPLES = 64


@dataclass(frozen=True, eq=False)
class GoldenTrace:
    """Samples of a record and results of the estimator, as float32.

    Attributes
    ----------
    command, position
        samples, shape (m,), in the units of the signals.
    innovation
        `innovation` of the estimator after each sample, shape (m,); 0 before the first estimate.
    theta
        estimate after the last sample, shape (n,).
    """

    command: Float32
    position: Float32
    innovation: Float32
    theta: Float32

    @classmethod
    def of(
        cls, configuration: EstimatorConfiguration, u: npt.ArrayLike, y: npt.ArrayLike
    ) -> GoldenTrace:
        """Runs a new estimator over m samples of command u and position y, each of shape (m,)."""
        command, position = np.asarray(u, dtype=np.float32), np.asarray(y, dtype=np.float32)
        estimator = configuration.estimator()
        innovation = []
        for one_command, one_position in zip(command, position, strict=True):
            estimator.step(float(one_command), float(one_position))
            innovation.append(estimator.innovation)
        return cls(
            command,
            position,
            np.array(innovation, dtype=np.float32),
            estimator.theta_hat.astype(np.float32),
        )


def liveliest(data: IoData, length: int = TRACE_SAMPLES) -> tuple[Float32, Float32]:
    """Returns the window of command and position samples with the largest sum of scaled variances.

    The window has `length` samples, or is a whole segment if no segment is that long. Many records
    begin at rest, where a trace would show nothing. Neither signal may be constant.
    """
    scale_u, scale_y = np.std(data.u), np.std(data.y)
    best, found = -1.0, slice(0, 0)
    for segment in data.segments:
        width = min(length, segment.stop - segment.start)
        windows = np.lib.stride_tricks.sliding_window_view
        lively = windows(data.u[segment], width).var(axis=1) / scale_u**2
        lively = lively + windows(data.y[segment], width).var(axis=1) / scale_y**2
        at = int(np.argmax(lively))
        # A longer window always has priority over a shorter one.
        if (width, float(lively[at])) > (found.stop - found.start, best):
            best, found = float(lively[at]), slice(segment.start + at, segment.start + at + width)
    return data.u[found].astype(np.float32), data.y[found].astype(np.float32)

# SPDX-License-Identifier: MIT
"""A test signal together with the data that its evaluation needs later."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt


def _no_lines() -> npt.NDArray[np.int64]:
    return np.empty(0, dtype=np.int64)


@dataclass(frozen=True, eq=False)
class Excitation:
    """A command signal, checked against its limit.

    Add an offset before: `Excitation(0.5 + prbs(...), dt_s, "prbs", limit_v=10.0)`.

    Attributes
    ----------
    samples
        command in volts, shape (n,), n >= 1, finite.
    dt_s
        sampling time in seconds, > 0.
    name, description
        a word and a sentence for the reader.
    excited, detection
        spectral lines of a multisine as multiples of 1 / (n dt_s): the lines in the signal, and the
        odd lines left out. At the latter, as at even lines, a linear plant gives no response.
        Both are empty for other signals.
    limit_v
        largest allowed magnitude of a sample in volts, >= 0; infinite if there is no limit.

    Raises
    ------
    ValueError
        a value is outside its range, or a sample is beyond the limit. The signal is not clipped,
        because a clipped signal has another spectrum than the requested one.
    """

    samples: npt.NDArray[np.float64]
    dt_s: float
    name: str
    description: str = ""
    excited: npt.NDArray[np.int64] = field(default_factory=_no_lines)
    detection: npt.NDArray[np.int64] = field(default_factory=_no_lines)
    limit_v: float = np.inf

    def __post_init__(self) -> None:
        if not 0.0 < self.dt_s < np.inf:
            raise ValueError(f"{self.name}: dt_s = {self.dt_s:g}: expected a finite dt_s > 0")
        if not self.limit_v >= 0.0:
            raise ValueError(f"{self.name}: limit_v = {self.limit_v:g}: expected limit_v >= 0")
        check_samples(self.name, self.samples)
        largest = int(np.argmax(np.abs(self.samples)))
        peak = float(np.abs(self.samples[largest]))
        if peak > self.limit_v:
            raise ValueError(
                f"{self.name}: {self.samples[largest]:g} V at {largest * self.dt_s:g} s is beyond "
                f"limit_v = {self.limit_v:g}: scale the signal, its offset included, by at most "
                f"{0.999 * self.limit_v / peak:.4g}, or lower the offset"
            )


def check_samples(name: str, samples: npt.NDArray[np.float64]) -> None:
    """Raises ValueError unless the samples have shape (n,), n >= 1, and are finite.

    The message begins with the name.
    """
    if samples.ndim != 1 or samples.size == 0:
        raise ValueError(f"{name}: samples of shape {samples.shape}: expected (n,), n >= 1")
    bad = np.flatnonzero(~np.isfinite(samples))
    if bad.size:
        raise ValueError(
            f"{name}: sample {bad[0]}, counted from 0, is {samples[bad[0]]}: expected finite values"
        )

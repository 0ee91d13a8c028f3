# SPDX-License-Identifier: MIT
"""K, omega_n and xi of a servo over a record, each with its interval and a word on trust."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

import ehsid

from ...base.error_words import printable
from ...base.numbers import FloatArray
from ...catalogue.channels import CHANNELS
from ..identification import IoData

MOST_DELAY = 20  # samples, of the compiled estimator
# Share of the samples at which a value has to be trusted for more than a moment.
LEAST_SHARE = 0.1
# What JSON calls the values by their names.
KEYS = {"K": "gain", "omega_n": "omega_n", "xi": "xi"}
# Samples from which the delay is taken, and the share to which another one than the stated has to
# narrow the intervals. Of 50 servos none lost its right delay, and of 25 linear ones with 3 samples
# more 19 were given theirs (the others: one sine, which does not show it).
LOOK, CLEARLY = 20_000, 0.5


@dataclass(frozen=True, eq=False, repr=False)
class ServoValue:
    """One of K, omega_n and xi over the N samples of a record."""

    name: str
    unit: str
    """As shown."""
    path: FloatArray
    half_path: FloatArray
    """Shape (N,), value and half of its 90 % interval after each sample; NaN before the first."""
    trusted_path: npt.NDArray[np.bool_]
    """Shape (N,), whether a controller may use the value."""
    trusted_share: float
    """Share of the samples at which the value is trusted."""
    reason: ehsid.TrustReason
    """Of the last sample: why the value is not trusted."""

    @property
    def trusted(self) -> bool:
        """Whether the told value can be trusted: at the end, or before for more than a moment."""
        at_end = self.reason is ehsid.TrustReason.trusted
        return at_end or self.trusted_share >= LEAST_SHARE

    @property
    def at(self) -> int:
        """Sample whose value is told: the last one that is trusted, or else the last one."""
        last = self.path.size - 1
        return int(np.flatnonzero(self.trusted_path)[-1]) if self.trusted else last

    @property
    def told(self) -> ServoValue:
        """The same with the sample that is told alone: a folder has no room for all paths."""
        at = slice(self.at, self.at + 1)
        paths = (self.path[at].copy(), self.half_path[at].copy(), self.trusted_path[at].copy())
        return ServoValue(self.name, self.unit, *paths, self.trusted_share, self.reason)

    def __repr__(self) -> str:
        value, half = self.path[self.at], self.half_path[self.at]
        trust = "trusted" if self.trusted else f"not trusted ({self.reason.name})"
        return " ".join(f"{self.name} {value:.4g} ± {half:.2g} {self.unit}".split()) + f", {trust}"

    def to_dict(self) -> dict[str, Any]:
        """Returns the told value, and whether it is trusted there and at the end, for JSON."""
        value, half = float(self.path[self.at]), float(self.half_path[self.at])
        known = bool(np.isfinite(value) and np.isfinite(half))
        # An interval ends at 0 at the latest: none of the three changes its sign.
        ends = [max(value - half, 0.0), value + half]
        if value < 0.0:
            ends = [value - half, min(value + half, 0.0)]
        return {
            "value": value if known else None,
            "ci90": ends if known else None,
            "trusted": self.trusted,
            "reason_at_end": self.reason.name,
            "trusted_share": self.trusted_share,
        }


@dataclass(frozen=True, eq=False, repr=False)
class ServoPath:
    """What `ehsid.ServoEstimator` told of a record: Eq. (5), K omega_n^2 / (s (s^2 + ..))."""

    gain: ServoValue
    omega_n: ServoValue
    xi: ServoValue
    """In units of the output per s and unit of the input, rad/s, and 1."""
    delay: int
    """In samples, as found."""
    resets: int
    """How often all began anew."""

    def __repr__(self) -> str:
        return "; ".join(map(repr, self))

    def __iter__(self) -> Iterator[ServoValue]:
        return iter((self.gain, self.omega_n, self.xi))

    @property
    def told(self) -> ServoPath:
        """The same with the samples that are told alone."""
        gain, omega_n, xi = (value.told for value in self)
        return replace(self, gain=gain, omega_n=omega_n, xi=xi)

    def to_dict(self) -> dict[str, Any]:
        """Returns plain values for JSON."""
        return {
            **{KEYS[value.name]: value.to_dict() for value in self},
            "delay": self.delay,
            "resets": self.resets,
        }


def estimate_servo(data: IoData, delay: int, dtype: str = "float32") -> ServoPath | None:
    """Runs `ehsid.ServoEstimator` over a record; None without a sampling time.

    Parameters
    ----------
    data, dtype
        as in `estimate`.
    delay
        in samples, as stated. One more is found by the estimator, and any other up to `MOST_DELAY`
        where the record clearly shows it.
    """
    if data.dt_s is None:
        return None
    return _path(data, data.dt_s, _delay(data, data.dt_s, max(delay, 1)), dtype)


_Run = tuple[ehsid.ServoEstimator, list[ehsid.TrackedRun]]


def _run(data: IoData, segments: Sequence[slice], dt_s: float, delay: int, dtype: str) -> _Run:
    estimator = ehsid.ServoEstimator(dt_s, delay=delay, dtype=dtype)
    runs = []
    for segment in segments:
        estimator.step(float("nan"), float("nan"))  # the next sample is the first behind a hole
        runs.append(estimator.run(data.u[segment], data.y[segment]))
    return estimator, runs


def _delay(data: IoData, dt_s: float, stated: int) -> int:
    """Returns the delay with which the intervals become narrowest, or the stated one."""
    segments: list[slice] = []
    left = LOOK
    for one in data.segments:
        segments.append(slice(one.start, min(one.stop, one.start + left)))
        left -= segments[-1].stop - segments[-1].start
        if not left:
            break

    def width(delay: int) -> float:
        """Half widths of the intervals in shares of their values, at most 1, over all samples."""
        _, runs = _run(data, segments, dt_s, delay, "float32")
        total = 0.0
        for run in runs:
            for one in (run.gain, run.omega_n, run.xi):
                share = np.ones(one.value.size)
                np.divide(one.half_width, np.abs(one.value), out=share, where=one.value != 0.0)
                total += float(np.sum(np.fmin(share, 1.0)))
        return total

    # Each run also finds one sample more.
    widths = {delay: width(delay) for delay in (stated, *range(1, MOST_DELAY + 1, 2))}
    best = min(widths, key=lambda delay: widths[delay])
    return best if widths[best] < CLEARLY * widths[stated] else stated


def _path(data: IoData, dt_s: float, delay: int, dtype: str) -> ServoPath:
    estimator, runs = _run(data, data.segments, dt_s, delay, dtype)
    names = (data.output_name, data.input_name)
    units = [CHANNELS[name].unit if name in CHANNELS else printable(name) for name in names]
    rate = f"{units[0]}/s per {data.input_unit or units[1]}"

    def value(name: str, unit: str, series: list[ehsid.TrackedSeries]) -> ServoValue:
        trusted = np.concatenate([one.trusted for one in series])
        return ServoValue(
            name,
            unit,
            np.concatenate([one.value for one in series]).astype(np.float64),
            np.concatenate([one.half_width for one in series]).astype(np.float64),
            trusted,
            float(np.mean(trusted)),
            ehsid.TrustReason(int(series[-1].reason[-1])),
        )

    return ServoPath(
        value("K", rate, [run.gain for run in runs]),
        value("omega_n", "rad/s", [run.omega_n for run in runs]),
        value("xi", "", [run.xi for run in runs]),
        estimator.delay,
        estimator.resets,
    )

# SPDX-License-Identifier: MIT
"""Delays between controller, machine and log, and the second-order lag of a spool."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import expm

import ehsid

from ...base.numbers import FloatArray
from .effects import InjectError, Note, Step, rms

# A delay within a thousandth of a sample of a whole number counts as whole: clocks are no better.
WHOLE = 1e-3


def _samples(delay_s: float, dt_s: float, length: int) -> tuple[int, float]:
    """Splits a delay into whole samples and the rest, in samples.

    `length` is the number of samples of the signal; a delay of more than half of it is refused.
    """
    samples = delay_s / dt_s
    if samples > 0.5 * length:
        raise InjectError(f"a delay of {delay_s:g} s is more than half of the record")
    whole = round(samples)
    if abs(samples - whole) < WHOLE:
        return whole, 0.0
    return math.floor(samples), samples - math.floor(samples)


def before_delay(command: FloatArray, delay_s: float, dt_s: float) -> Step:
    """Returns the command before a delay, u'(t) = u(t + delay), shape (N - M,).

    M is the delay in samples, rounded up. The last M samples of u' are missing, because the command
    after the end of the record is not known. A command is held over its sample, so a delay of n + f
    samples, 0 < f < 1, has no exact pre-image: the machine would get
    f u'_{k-n-1} + (1 - f) u'_{k-n} in place of u_k. Then u' is interpolated, and the machine gets u
    smoothed over three samples.
    """
    whole, rest = _samples(delay_s, dt_s, command.size)
    start = f"the first {delay_s:g} s ran on commands from before the record as it now begins"
    if rest == 0.0:
        return Step(command[whole:].copy(), [Note(start)])
    sent = (1.0 - rest) * command[whole:-1] + rest * command[whole + 1 :]
    received = rest * sent[:-1] + (1.0 - rest) * sent[1:]
    wrong = rms(received - command[whole + 1 : -1]) / max(rms(command), np.finfo(float).tiny)
    return Step(
        sent,
        [
            Note(start),
            Note(
                f"a delay of {delay_s:g} s is not a whole number of samples of {dt_s:g} s: the "
                f"command is interpolated, and what the machine then gets differs from what it got "
                f"by {100.0 * wrong:.2g} % (rms)",
                exact=False,
            ),
        ],
    )


def behind_delay(position: FloatArray, delay_s: float, dt_s: float) -> Step:
    """Returns the delayed position, y'(t) = y(t - delay), from sample M on; shape (N - M,).

    M is the delay in samples, rounded up. Between samples y is interpolated linearly.
    """
    whole, rest = _samples(delay_s, dt_s, position.size)
    if rest == 0.0:
        return Step(position[: position.size - whole].copy(), [])
    late = rest * position[: -whole - 1] + (1.0 - rest) * position[1 : position.size - whole]
    return Step(
        late,
        [
            Note(
                f"a delay of {delay_s:g} s is not a whole number of samples of {dt_s:g} s: the "
                "position is interpolated, which also averages its noise",
                exact=False,
            )
        ],
    )


ComplexArray = npt.NDArray[np.complex128]

# The response of the inverse decays by a factor in each sample. A factor nearer to one than this
# would let it ring for a thousand samples.
RINGS = 0.97
# Share of the response that may remain at the ends of the record.
DIED_OUT = 1e-16
# Ratio of each cut-off frequency of the smoothing to the one tried before.
COARSE = 0.97
# Largest share of the command (rms) that smoothing may remove. More would be a gap of its own, as
# large as that of an effect.
MOST_LOST = 0.05


class _MeanOfSample(NamedTuple):
    """Discrete system whose output is the mean of x over a sample during which u' is held.

    The output is C z + D u', with the state z = (x, x' / w) and z <- A z + B u'.
    """

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: float

    def slowest_of_inverse(self) -> float:
        """Largest factor by which the two-sided inverse decays in a sample, from the zeros."""
        zeros = np.abs(np.linalg.eigvals(self.A - np.outer(self.B, self.C) / self.D))
        return float(np.max(np.minimum(zeros, 1.0 / np.maximum(zeros, DIED_OUT))))

    def at(self, z: ComplexArray) -> ComplexArray:
        """Transfer function D + C (z - A)^-1 B at z; complex, of the shape of z."""
        (a, b), (c, d) = self.A
        determinant = (z - a) * (z - d) - b * c
        position = ((z - d) * self.B[0] + b * self.B[1]) / determinant
        speed = (c * self.B[0] + (z - a) * self.B[1]) / determinant
        return np.asarray(self.D + self.C[0] * position + self.C[1] * speed)


def _mean_of_sample(bandwidth_hz: float, damping: float, dt_s: float) -> _MeanOfSample:
    """Returns the discrete system of a lag: exact, by a matrix exponential.

    The states of the exponential are those of the lag, the integral of x and the input.
    """
    angle = 2.0 * math.pi * bandwidth_hz * dt_s
    rates = np.zeros((4, 4))
    rates[0, 1] = angle
    rates[1] = [-angle, -2.0 * damping * angle, 0.0, angle]
    rates[2, 0] = 1.0
    step = np.asarray(expm(rates), dtype=np.float64)
    return _MeanOfSample(step[:2, :2], step[:2, 3], step[2, :2], float(step[2, 3]))


def before_lag(
    command: FloatArray,
    bandwidth_hz: float,
    damping: float,
    dt_s: float,
    limit: float = math.inf,
) -> Step:
    """Returns the command for which the spool, averaged over each sample, is `command`, shape (N,).

    The transfer function also has zeros outside the unit circle, so its inverse looks ahead by some
    samples. Therefore the inverse is computed in the frequency domain, with the signal at rest
    before and after the record. Where the result would exceed `limit`, or the largest |command| if
    that is larger, the command is first smoothed with a Gaussian without phase, as little as
    possible. A lagging valve cannot have produced the part that is removed.

    Raises
    ------
    InjectError
        the inverse decays too slowly, or smoothing would remove more than MOST_LOST of the command.
    """
    mean = _mean_of_sample(bandwidth_hz, damping, dt_s)
    slowest = mean.slowest_of_inverse()
    if slowest > RINGS:
        raise InjectError(
            f"valve_lag of {bandwidth_hz:g} Hz cannot be undone at {1.0 / dt_s:g} samples a "
            "second: take another bandwidth"
        )
    held = _with_rest(command, math.ceil(math.log(DIED_OUT) / math.log(max(slowest, 0.1))))
    spectrum = rfft(held)
    share_of_nyquist = np.linspace(0.0, 1.0, spectrum.size)
    inverse = 1.0 / mean.at(np.exp(1j * math.pi * share_of_nyquist))

    def back(response: FloatArray | ComplexArray) -> FloatArray:
        return np.asarray(irfft(spectrum * response, held.size)[: command.size], dtype=np.float64)

    def smoothing(cut_off: float) -> FloatArray:
        """Response of the Gaussian, which halves the power at `cut_off`, a share of Nyquist."""
        return np.asarray(np.exp(-0.5 * math.log(2.0) * (share_of_nyquist / cut_off) ** 2))

    exact = back(inverse)
    needed, limit = float(np.abs(exact).max()), max(limit, float(np.abs(command).max()))
    notes = [
        Note(
            "a lagging valve cannot step: its spool, averaged over each sample, is what the "
            "machine got; within a sample it is not",
            exact=False,
        )
    ]
    if needed <= limit:
        return Step(exact, notes)
    nyquist_hz = 0.5 / dt_s
    cut_off, lost, sent = 1.0, 0.0, exact
    while float(np.abs(sent).max()) > limit:
        cut_off *= COARSE
        sent = back(inverse * smoothing(cut_off))
        lost = rms(back(smoothing(cut_off)) - command) / rms(command)
        if lost > MOST_LOST:
            raise InjectError(
                f"a valve of {bandwidth_hz:g} Hz could not have made this record within its rated "
                f"command (it would take {needed:.3g} times as much): take a higher bandwidth, or "
                "a record with a smoother command"
            )
    notes.append(
        Note(
            f"to stay within rated command (it would take {needed:.3g} times as much) the command "
            f"is smoothed, half its power at {cut_off * nyquist_hz:.0f} Hz: "
            f"{100.0 * lost:.2g} % of it (rms) is lost",
            exact=False,
        )
    )
    return Step(sent, notes)


def _with_rest(command: FloatArray, samples: int) -> FloatArray:
    """Extends a command so that it rests for `samples` samples after its end and before its start.

    The spectrum takes the signal as periodic, so the rest before the start is at the end of the
    array. Between the two rests the signal returns without a step. The length is one for which the
    Fourier transform is fast.
    """
    rest = next_fast_len(command.size + 4 * samples, real=True) - command.size - 2 * samples
    return np.concatenate(
        [
            command,
            np.full(samples, command[-1]),
            command[-1]
            + (command[0] - command[-1]) * np.sin(np.linspace(0.0, 0.5 * math.pi, rest)) ** 2,
            np.full(samples, command[0]),
        ]
    )


@dataclass(frozen=True)
class Answer:
    """The answer to an injected record: what was injected, and what a diagnosis should find."""

    put_in: Mapping[str, Mapping[str, float]]
    """Ids of the injected effects with their sizes, SI, as the caller gave them."""
    effects: Mapping[str, Mapping[str, float]]
    """Effects of the catalogue that a diagnosis should find in addition to those of the original
    log, with their sizes, SI."""
    parameters: Mapping[str, float]
    """Full names of values of the rig, each with the factor by which the machine's value is now
    larger."""
    outside: tuple[str, ...]
    """Ids that are not in the catalogue and do not appear as an effect of it."""
    not_exact: tuple[str, ...]
    """Sentences that say where the record differs from what a machine with these effects would have
    logged; empty where the two agree to rounding."""
    remarks: tuple[str, ...]
    """Further sentences about the injection."""
    rig: str
    plant: str
    """Name of the rig and its plant, for which the record was made."""
    source: str | None
    sha256: str | None
    """File name of the original record and its digest; None for a record made in memory."""
    command: Mapping[str, float | None]
    """rated_v (None for a motor), largest_v_before, largest_v, share_beyond_rated: V, and a share
    of the samples."""
    samples: Mapping[str, int]
    """Numbers of samples: source, dropped_at_start, dropped_at_end, written."""

    def plain(self) -> dict[str, Any]:
        """Returns the answer as plain data for a file."""
        plain = asdict(self)
        source = {"file": plain.pop("source"), "sha256": plain.pop("sha256")}
        return {
            "schema_version": 1,
            "ehsid_version": ehsid.__version__,
            "source": source,
            **plain,
        }


def file_of(source: Path | None) -> str | None:
    """File name without the folder, which is private to the user."""
    return None if source is None else source.name

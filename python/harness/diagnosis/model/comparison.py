# SPDX-License-Identifier: MIT
"""Preparation of a record to compare with simulations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
import numpy.typing as npt
from scipy.signal import savgol_filter

from ...base.numbers import FloatArray
from ...catalogue.channels import CHANNELS
from ...records import Record
from ...signals.simulation.windows import (
    SMOOTHED_ORDER,
    SMOOTHED_S,
    STATES,
    measured_states,
    window_numbers,
)
from ...simulators.around import catches
from ..data.floor import rounding_errors
from ..schema import SKIP_S, WINDOW_S

# Where no record is held out, every third block of each record is held out. A block has four
# windows, which is longer than the memory of a servo; two thirds of the record are left to fit.
BLOCK_S = 2.0
BLOCKS_TURN = 3

Blocks = Literal["all", "fit", "held out"]

# Outputs that are compared if the record has them.
OUTPUTS = tuple(channel.name for channel in CHANNELS.values() if channel.compared)

# An output counts as noise if its variation within the windows is at most LEAST_VARIATION times its
# noise floor.
LEAST_VARIATION = 3.0

# Fewest samples that a cubic smooths, and the longest time over which the motion of a servo may be
# taken for one: in 30 ms a motion of 10 Hz bends once. More slowly sampled positions stay as
# measured.
SMOOTHED_LEAST = 5
LONGEST_SMOOTHED_S = 0.03


@dataclass(frozen=True, eq=False)
class Compared:
    """A record of N samples, divided into windows."""

    record: Record
    """The record, without gaps."""
    outputs: Mapping[str, FloatArray]
    """Measured columns that are compared, by name, shape (N,) each."""
    window: npt.NDArray[np.int64]
    """Shape (N,), number of the window of each sample, -1 for a skipped sample."""
    aligned: FloatArray
    """Shape (N, 4), states for `ehsid.simulate_plant`, NaN where it keeps its own. Each window
    starts with the measured position, or with all measured states; the first sample holds all that
    is known of the state."""
    caught: npt.NDArray[np.uint8] | None = None
    """Shape (N,), 1 where a user's simulator is brought to the measured position; None: ours."""

    @cached_property
    def used(self) -> npt.NDArray[np.bool_]:
        """Mask of the samples inside windows, shape (N,)."""
        return self.window >= 0

    @property
    def dt_s(self) -> float:
        """Sampling time of the record, s."""
        assert self.record.dt_s is not None
        return self.record.dt_s

    @property
    def seconds(self) -> float:
        """Total duration of the samples inside windows, s."""
        return float(self.size) * self.dt_s

    @cached_property
    def rounding(self) -> Mapping[str, FloatArray]:
        """Rounding errors of the compared outputs, by name, shape (N,) each."""
        return {name: rounding_errors(samples) for name, samples in self.outputs.items()}

    @cached_property
    def size(self) -> int:
        """Number of samples inside windows."""
        return int(np.count_nonzero(self.used))

    def inside(self, signal: FloatArray) -> FloatArray:
        """Returns the rows of the samples inside windows; axis 0 of `signal` has N samples.

        The result is a view of `signal` where these samples follow each other.
        """
        return np.asarray(signal[self._selection], dtype=np.float64)

    def centre(self, inside: FloatArray) -> FloatArray:
        """Subtracts the mean of each window from rows as `inside` gives them, in place."""
        begins, ends = self._window_bounds
        sums = np.add.reduceat(inside, begins, axis=0)
        for total, begin, end in zip(sums, begins, ends, strict=True):
            inside[begin:end] -= total / (end - begin)
        return inside

    def centred(self, errors: FloatArray) -> FloatArray:
        """Returns the errors inside the windows, less the mean of each window.

        Axis 0 of `errors` has the N samples of the record, axis 0 of the result those in windows.
        """
        return self.centre(np.array(self.inside(errors)))

    @cached_property
    def full_windows(self) -> tuple[int, int]:
        """Number of windows, and of samples in each; without a shorter one at the end."""
        begins, ends = self._window_bounds
        lengths = ends - begins
        length = int(lengths.max())
        return int(np.count_nonzero(lengths == length)), length

    @cached_property
    def _selection(self) -> slice | npt.NDArray[np.int64]:
        samples = np.flatnonzero(self.used)
        if samples.size and samples[-1] - samples[0] + 1 == samples.size:
            return slice(int(samples[0]), int(samples[-1]) + 1)
        return samples

    @cached_property
    def _window_bounds(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """First row of each window, and the row after its last, among the rows inside windows."""
        begins = np.flatnonzero(np.diff(self.window[self.used], prepend=-1))
        return begins, np.append(begins[1:], self.size)


def compare(
    record: Record,
    *,
    window_s: float = WINDOW_S,
    skip_s: float = SKIP_S,
    all_states: bool = False,
    blocks: Blocks = "all",
    caught: float | None = None,
) -> Compared:
    """Prepares a record for comparison with simulations.

    blocks: selects the windows of the blocks to fit, those of the held-out blocks, or all windows.
    all_states: speed and pressures, too, start each window at their measured values, so that a
    simulator with wrong values cannot lose the phase of a limit cycle.
    caught: for a user's simulator, the length of its first catch, s, see `simulators.around`.

    Raises
    ------
    ValueError
        the record has gaps, has no sampling time, or is too short for a window.
    """
    if record.dt_s is None or len(record.segments) > 1:
        raise ValueError(
            f"{record.source or record.name}: the diagnosis needs one stretch with a sampling "
            "time; cut the record at its gaps"
        )
    catching = None
    if caught is None:
        window = window_numbers(len(record), record.dt_s, window_s=window_s, skip_s=skip_s)
    else:
        window, catching = catches(len(record), record.dt_s, window_s=window_s, first_s=caught)
    position = record.column("position_m")
    smooth = _smoothed(position, record.dt_s)
    aligned = np.full((len(record), len(STATES)), np.nan)
    window_starts = np.flatnonzero(np.diff(window, prepend=-2) > 0)
    if all_states:
        aligned[window_starts] = measured_states(record)[window_starts]
    aligned[window_starts, 0] = smooth[window_starts]
    first_samples = max(1, round(SMOOTHED_S / record.dt_s))
    aligned[0, :2] = smooth[0], 0.0
    for column, name in enumerate(STATES[2:], start=2):
        if name in record.columns:
            aligned[0, column] = float(np.mean(record.column(name)[:first_samples]))
    if blocks != "all":
        # A block consists of whole windows. Their number is the one nearest to its length.
        held_out = window // max(1, round(BLOCK_S / window_s)) % BLOCKS_TURN == 1
        window[held_out if blocks == "fit" else ~held_out] = -1
    outputs = {name: record.column(name) for name in OUTPUTS if name in record.columns}
    return Compared(record, outputs, window, aligned, catching)


def _smoothed(position: FloatArray, dt_s: float) -> FloatArray:
    """Position without most of its noise, m; as measured where five samples are too long for it."""
    if SMOOTHED_LEAST * dt_s > LONGEST_SMOOTHED_S:
        return position
    length = min(
        max(SMOOTHED_LEAST, 2 * round(0.5 * SMOOTHED_S / dt_s) + 1), (position.size - 1) | 1
    )
    return np.asarray(savgol_filter(position, length, polyorder=SMOOTHED_ORDER), dtype=np.float64)


def varying_outputs(compared: Compared, floors: Mapping[str, float]) -> tuple[str, ...]:
    """Names of outputs with a floor that vary within windows by more than LEAST_VARIATION of it."""
    return tuple(
        name
        for name, measured in compared.outputs.items()
        if name in floors and np.std(compared.centred(measured)) > LEAST_VARIATION * floors[name]
    )

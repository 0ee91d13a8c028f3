# SPDX-License-Identifier: MIT
"""Gate for the time of a record: even sampling, fine sampling, sufficient length."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...catalogue.channels import CHANNELS
from ...records import Record
from ...records.timebase import mend_of_gaps, pieces_in_words
from ...rigs import Rig
from ..schema import SKIP_S, WINDOW_S, Remark
from .cylinder import oil_spring_hz
from .floor import LEAST_SAMPLES, shows_motion

# Jitter, as a share of the sampling time: a tenth of what the reader of records refuses. A sine of
# 10 Hz at 1 kHz is then wrong by 6e-5 of its amplitude.
JITTER_SHOWS = 1e-3
# A quartz clock keeps its rate to 1e-4. A sampling time that changes by more was not made by one.
CLOCK_DRIFT = 2e-4
# Smallest number of windows in a record: two to fit and two to hold out.
LEAST_WINDOWS = 4
# With fewer than ten samples per period, the held command with its delay of half a sample hides a
# lag.
SAMPLES_A_PERIOD = 10

# Number of parts of a record whose sampling times are compared.
PARTS = 10


def check_clock(record: Record) -> Iterator[Remark]:
    """Checks that the record has a time, and looks for jitter, drift and gaps in it."""
    if record.time_s is None or record.dt_s is None or record.jitter is None:
        yield Remark(
            record.name,
            "there is no column 'time_s': without the sampling time nothing can be simulated; "
            "add it, in seconds",
            serious=True,
        )
        return
    if record.jitter.rms_relative > JITTER_SHOWS:
        yield Remark(
            record.name,
            f"the time between samples wavers by {100.0 * record.jitter.rms_relative:.2g} % "
            f"(at most {100.0 * record.jitter.max_relative:.2g} %, at row "
            f"{record.jitter.worst_row}); the simulation takes it as even, fast motion looks "
            "noisier than it was",
        )
    if record.gaps:
        longest = max(record.gaps, key=lambda gap: gap.duration_s)
        yield Remark(
            record.name,
            f"samples are missing at {len(record.gaps)} places, the longest for "
            f"{longest.duration_s:.3g} s after {longest.start_s:.4g} s; the parts between are "
            "taken one by one, those too short are left out",
        )
    else:
        yield from _drift(record)


def _drift(record: Record) -> Iterator[Remark]:
    """Checks whether sampling times of parts of the record differ by more than jitter explains."""
    assert record.time_s is not None
    assert record.dt_s is not None
    assert record.jitter is not None
    edges = np.linspace(0, len(record) - 1, PARTS + 1).astype(int)
    if len(record) < 10 * PARTS:
        return
    sampling_times = np.diff(record.time_s[edges]) / np.diff(edges)
    spread = float(np.ptp(sampling_times) / record.dt_s)
    # Each end of a part is uncertain by the jitter of a single sample.
    by_jitter = 4.0 * record.jitter.max_relative / float(np.diff(edges).min())
    if spread <= max(CLOCK_DRIFT, by_jitter):
        return
    yield Remark(
        record.name,
        f"the clock drifts: the sampling time changes by {100.0 * spread:.2g} % over the "
        "record; resample it on an even clock",
    )


def check_length(record: Record, whole: Record) -> Iterator[Remark]:
    """Checks that the longest part of the `whole` record can fit windows and hold others out."""
    assert record.dt_s is not None
    seconds = len(record) * record.dt_s
    needed = SKIP_S + LEAST_WINDOWS * WINDOW_S
    if seconds < needed * (1.0 - 1e-9):
        yield Remark(
            record.name,
            f"{seconds:.3g} s without a gap are too short: the diagnosis needs {needed:g} s, "
            f"the first {SKIP_S:g} s and {LEAST_WINDOWS} windows; "
            f"{longer(whole, needed / record.dt_s)}",
            serious=True,
        )
    elif len(record) < LEAST_SAMPLES:
        yield Remark(
            record.name,
            f"{len(record)} samples are too few: the noise floor needs {LEAST_SAMPLES}; sample "
            f"faster, or {longer(whole, LEAST_SAMPLES)}",
            serious=True,
        )


def longer(record: Record, samples: float) -> str:
    """Returns what makes the longest part of a record reach a number of samples."""
    if not record.gaps or len(record) < samples * (1.0 - 1e-9):
        return "record for longer"
    return f"{pieces_in_words(record)}: {mend_of_gaps(record)}"


def check_sampling(record: Record, rig: Rig) -> Iterator[Remark]:
    """Checks that the sampling resolves the oil spring and separates noise from motion."""
    assert record.dt_s is not None
    spring_hz = oil_spring_hz(rig)
    if spring_hz is not None and spring_hz * record.dt_s > 1.0 / SAMPLES_A_PERIOD:
        yield Remark(
            record.name,
            f"sampled every {1e3 * record.dt_s:.4g} ms, too rarely for the oil spring of some "
            f"{spring_hz:.3g} Hz: oil, lags and delays can hardly be distinguished; sample "
            f"every {1e3 / (SAMPLES_A_PERIOD * spring_hz):.2g} ms",
        )
    unresolved = [
        name
        for name, column in record.columns.items()
        if name in CHANNELS and CHANNELS[name].moves and shows_motion(column)
    ]
    if unresolved:
        yield Remark(
            record.name,
            f"the noise of {', '.join(unresolved)} is not white, or cannot be distinguished "
            "from motion at this sampling time: without stretches at rest its floor is only a "
            "bound; record a few seconds at rest, too",
        )

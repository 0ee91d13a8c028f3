# SPDX-License-Identifier: MIT
"""Summaries of many runs: medians with confidence intervals, for tables and for JSON."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .claims import SETTLED
from .comparison import Outcome
from .evidence import Interval, median_interval
from .recursive import Changed

TIMES_S = (5.0, 20.0, 50.0, 100.0)


@dataclass(frozen=True)
class RunSummary:
    """Summary of one contender over all runs; times in seconds, errors as shares of |theta|.

    Attributes
    ----------
    error_at
        relative error |theta_hat - theta| / |theta|, by time.
    settled_s
        time until this error stays below 5 %; the length of the record if it never does.
    never
        share of the runs that never settle, 0 to 1.
    spread
        spread of theta over the last quarter of the run, as a share of |theta|.
    rmse
        RMSE of the innovation over the whole run.
    theta
        medians of the final parameters.
    """

    error_at: dict[float, Interval]
    settled_s: Interval
    never: float
    spread: Interval
    rmse: Interval
    theta: tuple[float, ...]


def summarise(outcome: Outcome, dt_s: float, times_s: tuple[float, ...] = TIMES_S) -> RunSummary:
    """Summarises all runs of an outcome."""
    samples = outcome.error.shape[1]
    settling = outcome.settling(SETTLED)
    return RunSummary(
        error_at={
            t: median_interval(outcome.error[:, min(round(t / dt_s), samples) - 1]) for t in times_s
        },
        settled_s=median_interval(settling * dt_s),
        never=float(np.mean(settling >= samples)),
        spread=median_interval(outcome.spread),
        rmse=median_interval(outcome.rmse),
        theta=tuple(float(value) for value in np.median(outcome.theta, axis=0)),
    )


@dataclass(frozen=True)
class ChangeSummary:
    """Summary of one contender after a change of the plant, and of its reset.

    Attributes
    ----------
    without, with_reset
        samples after the change until the error stays below 5 %; the rest of the record if it
        never does.
    never_without, never_with
        shares of the runs that never settle, 0 to 1.
    fired, false_alarms
        shares of the runs in which the reset fired after the change, and before it.
    delay
        samples from the change to the reset, over the runs in which it fired; None if it never
        fired.
    """

    without: Interval
    with_reset: Interval
    never_without: float
    never_with: float
    fired: float
    false_alarms: float
    delay: Interval | None


def summarise_change(changed: Changed) -> dict[str, ChangeSummary]:
    """Summarises the runs around a change, by name of the contender."""
    summaries = {}
    for name, (without, with_reset) in changed.outcomes.items():
        left = without.error.shape[1] - changed.at
        settling = [o.settling(SETTLED, changed.at) for o in (without, with_reset)]
        delays = [
            int(times[times >= changed.at][0]) - changed.at
            for times in with_reset.resets
            if (times >= changed.at).any()
        ]
        summaries[name] = ChangeSummary(
            without=median_interval(settling[0]),
            with_reset=median_interval(settling[1]),
            never_without=float(np.mean(settling[0] >= left)),
            never_with=float(np.mean(settling[1] >= left)),
            fired=len(delays) / len(with_reset.resets),
            false_alarms=float(
                np.mean([bool((times < changed.at).any()) for times in with_reset.resets])
            ),
            delay=median_interval(delays) if delays else None,
        )
    return summaries

# SPDX-License-Identifier: MIT
"""Prepares the curves of a held-out run for a plot: fewer samples, and breaks between windows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..base.arrays import FloatArray
from ..diagnosis.result import HeldOutRun
from .plotting import kept_samples


def curves_of(
    run: HeldOutRun, name: str, kinds: Sequence[str], *, scale: float, most: int
) -> dict[str, FloatArray]:
    """Returns the samples to draw, with a break at the end of each window.

    The simulation starts anew in each window; a line across the end would suggest that it goes on.

    Parameters
    ----------
    run
        held-out run of N samples.
    name
        name of the output.
    kinds
        kinds of simulation: "nominal", "calibrated", "augmented".
    scale
        factor from SI to the unit of the plot.
    most
        approximate number of samples to keep of the N samples.

    Returns
    -------
    `time` in s, `measured`, each kind, and its `KIND_error` (simulated minus measured), all of one
    length. Simulations and errors are NaN outside of windows and at the breaks.
    """
    measured = run.measured[name]
    simulated = {kind: getattr(run, kind)[name] for kind in kinds if name in getattr(run, kind)}
    inside = run.window >= 0
    errors = {kind: np.where(inside, made - measured, np.nan) for kind, made in simulated.items()}
    starts = np.flatnonzero(np.diff(run.window)) + 1
    kept = kept_samples([measured, *errors.values()], most, always=np.union1d(starts - 1, starts))
    breaks = np.searchsorted(kept, starts)

    def broken(values: FloatArray, *, gap: bool) -> FloatArray:
        drawn = values[kept]
        return np.insert(drawn, breaks, np.nan if gap else drawn[breaks])

    columns = {
        "time": broken(run.time_s, gap=False),
        "measured": broken(scale * measured, gap=False),
    }
    for kind, made in simulated.items():
        columns[kind] = broken(scale * np.where(inside, made, np.nan), gap=True)
        columns[f"{kind}_error"] = broken(scale * errors[kind], gap=True)
    return columns

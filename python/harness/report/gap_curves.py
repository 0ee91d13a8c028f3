# SPDX-License-Identifier: MIT
"""Curves of a held-out run as they are drawn: thinned, and broken between windows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.gap.schema import HeldOutRun
from ehsid.harness.report.thinning import kept_samples


def curves_of(
    run: HeldOutRun, name: str, kinds: Sequence[str], *, scale: float, most: int
) -> dict[str, FloatArray]:
    """Samples to draw, with a break where a window ends: there the simulation starts anew.

    Parameters
    ----------
    run
        of N samples.
    name
        of the output.
    kinds
        of simulation: "nominal", "calibrated", "augmented".
    scale
        from SI to what is drawn.
    most
        about so many samples of the N.

    Returns
    -------
    `time`, `measured`, each kind, and its `KIND_error` (simulated minus measured), all of one
    length; NaN outside of windows and at the breaks.
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

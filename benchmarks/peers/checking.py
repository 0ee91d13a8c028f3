# SPDX-License-Identifier: MIT
"""Do all recursions find the same parameters? The truth is batch least squares in float64."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from python_peers import PythonPeer
from results import CPP, PYTHON, Answer, Name
from series import Series, batch, tolerance

from ehsid.harness.base.numbers import FloatArray


@dataclass(frozen=True, eq=False)
class Found:
    """Parameters that a recursion found on a series, and what it minimised."""

    name: Name
    series: Series
    theta: FloatArray
    """Shape (n,); NaN where a parameter is no number."""
    factor: float
    variance0: float
    kept: bool = False
    """As in `data.batch`."""


def has_own_weighting(name: Name) -> bool:
    """Whether a row does not take the forgetting factor: our policies other than `Constant`."""
    return name.ours and not name.text.endswith("Constant")


def name_of(row: dict[str, object]) -> Name:
    """The name of a row of the program."""
    return Name(str(row["name"]), str(row["scalar"]), CPP, bool(row["ours"]))


def from_program(
    rows: Iterable[dict[str, object]], series: Series, factor: float, count: int
) -> list[Found]:
    """What the program found after `count` samples."""
    found = []
    for row in rows:
        theta = row["theta"]
        assert isinstance(theta, dict)
        values = np.array([np.nan if one is None else one for one in theta[str(count)]])
        variance0 = float(str(row["variance0"]))
        found.append(Found(name_of(row), series, values, factor, variance0, row["kept"] is True))
    return found


def from_python(
    peers: Sequence[PythonPeer], series: Series, factor: float, variance0: float
) -> list[Found]:
    """What the recursions that are called from Python found; those not installed are left out."""
    found = []
    for peer in peers:
        if not peer.missing:
            name = Name(peer.name, "double", PYTHON, peer.ours)
            own = factor if peer.forgets else 1.0
            start = variance0 if peer.variance0 is None else peer.variance0
            theta = peer.estimate(series, own, variance0)
            found.append(Found(name, series, theta, own, start))
    return found


def judge(found: Iterable[Found]) -> list[Answer]:
    """One answer for each recursion, over all series that it ran on."""
    shares: dict[Name, list[tuple[float, float]]] = {}
    for one in found:
        phi, y = one.series.regressors()
        truth = batch(phi, y, one.factor, one.variance0, kept=one.kept)
        deviation = float(np.max(np.abs(one.theta - truth)) / np.max(np.abs(truth)))
        share = deviation / tolerance(phi, one.factor, one.name.scalar)
        shares.setdefault(one.name, []).append((deviation, share))
    return [
        Answer(name, *(float(worst) for worst in np.max(both, axis=0)), has_own_weighting(name))
        for name, both in shares.items()
    ]

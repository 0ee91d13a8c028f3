# SPDX-License-Identifier: MIT
"""Recursions that are called from Python, under one roof: ours, numpy, and libraries."""

from __future__ import annotations

import importlib
import importlib.metadata
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from series import Series

import ehsid
from ehsid.harness.base.numbers import FloatArray


class Stepped(Protocol):
    """A recursion that takes one sample after the other."""

    def update(self, phi: FloatArray, y: float) -> None:
        """One update with phi of shape (n,)."""

    @property
    def theta(self) -> FloatArray:
        """The parameters, shape (n,)."""


# Makes a recursion for n parameters with a forgetting factor and P0 = variance0 I.
Start = Callable[[int, float, float], Stepped]
# Runs over all samples of a series in one call; the same arguments; gives the last parameters.
Run = Callable[[Series, float, float], FloatArray]


@dataclass(frozen=True)
class PythonPeer:
    """One row of the comparison."""

    name: str
    """As the tables show it."""
    package: str = ""
    """Distribution that it needs, or "" for none beyond our own."""
    start: Start | None = None
    run: Run | None = None
    """One of them is given: a recursion that takes single samples, or one that takes all at once.
    """
    ours: bool = False
    """Whether it is our own."""
    forgets: bool = True
    """Whether it has a forgetting factor; otherwise it is compared with the factor one."""
    variance0: float | None = None
    """Its own P0, or None if it takes one."""
    note: str = ""
    """What a reader must know about the way it is used."""

    @property
    def missing(self) -> str:
        """How to install it, or "" if it is installed."""
        if self.package:
            try:
                importlib.metadata.version(self.package)
            except importlib.metadata.PackageNotFoundError:
                return f"python -m pip install {self.package}"
        return ""

    def estimate(self, series: Series, factor: float, variance0: float) -> FloatArray:
        """The parameters after all samples."""
        if self.run is not None:
            return self.run(series, factor, variance0)
        assert self.start is not None
        phi, y = series.regressors()
        recursion = self.start(series.parameters, factor, variance0)
        for row, value in zip(phi, y.tolist(), strict=True):
            recursion.update(row, value)
        return recursion.theta


class NumpyTextbook:
    """Eqs. (12)-(14) with numpy, K (phi' P)."""

    def __init__(self, n: int, factor: float, variance0: float) -> None:
        self.theta = np.zeros(n)
        self.P = variance0 * np.eye(n)
        self.factor = factor

    def update(self, phi: FloatArray, y: float) -> None:
        """One sample."""
        row = phi @ self.P
        K = self.P @ phi / (self.factor + row @ phi)
        self.theta = self.theta + K * (y - phi @ self.theta)
        self.P = (self.P - np.outer(K, row)) / self.factor


class OurRecursion:
    """`ehsid.Rls`, one call a sample."""

    def __init__(self, n: int, factor: float, variance0: float) -> None:
        forgetting = ehsid.Constant(lambda_=factor)
        self.recursion = ehsid.Rls(n, forgetting=forgetting, variance0=np.full(n, variance0))

    def update(self, phi: FloatArray, y: float) -> None:
        """One sample."""
        self.recursion.update(phi, y)

    @property
    def theta(self) -> FloatArray:
        """The parameters."""
        return np.asarray(self.recursion.theta_hat)


def our_run(series: Series, factor: float, variance0: float) -> FloatArray:
    """`ehsid.ArxEstimator.run`, all samples in one call."""
    estimator = ehsid.ArxEstimator(
        series.na,
        series.nb,
        1,
        forgetting=ehsid.Constant(lambda_=factor),
        variance0=np.full(series.parameters, variance0),
        dtype="float64",
    )
    estimator.run(series.u, series.y)
    return np.asarray(estimator.theta_hat)


class Padasip:
    """`FilterRLS` of padasip, whose forgetting factor is called mu."""

    def __init__(self, n: int, factor: float, variance0: float) -> None:
        filters: Any = importlib.import_module("padasip.filters")
        self.filter = filters.FilterRLS(n=n, mu=factor, eps=1.0 / variance0, w="zeros")

    def update(self, phi: FloatArray, y: float) -> None:
        """One sample."""
        self.filter.adapt(y, phi)

    @property
    def theta(self) -> FloatArray:
        """The parameters."""
        return np.asarray(self.filter.w)


class FilterPy:
    """`KalmanFilter` of filterpy with a constant state, H = phi' and a fading memory."""

    def __init__(self, n: int, factor: float, variance0: float) -> None:
        with warnings.catch_warnings():  # of what it imports
            warnings.simplefilter("ignore")
            kalman: Any = importlib.import_module("filterpy.kalman")
        self.filter = kalman.KalmanFilter(dim_x=n, dim_z=1)
        self.filter.P = variance0 * np.eye(n)
        self.filter.Q = np.zeros((n, n))
        self.filter.alpha = 1.0 / np.sqrt(factor)

    def update(self, phi: FloatArray, y: float) -> None:
        """One sample: P / factor is its time update."""
        self.filter.predict()
        self.filter.update(y, H=phi[np.newaxis])

    @property
    def theta(self) -> FloatArray:
        """The parameters."""
        return np.asarray(self.filter.x).ravel()


def statsmodels_run(series: Series, factor: float, variance0: float) -> FloatArray:
    """`RecursiveLS` of statsmodels: all samples, no forgetting, a diffuse start."""
    recursive: Any = importlib.import_module("statsmodels.regression.recursive_ls")
    phi, y = series.regressors()
    return np.asarray(recursive.RecursiveLS(y, phi).fit().params)


PEERS = (
    PythonPeer("ehsid.ArxEstimator.run, Constant", run=our_run, ours=True),
    PythonPeer("ehsid.Rls.update, Constant", start=OurRecursion, ours=True),
    PythonPeer("numpy, K (phi' P)", start=NumpyTextbook),
    PythonPeer("padasip FilterRLS", "padasip", start=Padasip),
    PythonPeer(
        "filterpy KalmanFilter",
        "filterpy",
        start=FilterPy,
        note="is used as a Kalman filter with a constant state, H = phi' and a fading memory. Its "
        "own least squares are for polynomials of time only",
    ),
    PythonPeer(
        "statsmodels RecursiveLS",
        "statsmodels",
        run=statsmodels_run,
        forgets=False,
        variance0=np.inf,
        note="takes all samples at once and does not forget. It is compared at lambda = 1",
    ),
)

# Names by which a recursive least squares of python-control would be called.
RECURSIVE = ("rls", "recursive", "leastsquares", "least_squares")


def control_note() -> str:
    """What python-control has for the purpose."""
    try:
        control: Any = importlib.import_module("control")
    except ImportError:
        return "not installed: python -m pip install control"
    found = [name for name in dir(control) if any(word in name.lower() for word in RECURSIVE)]
    version = importlib.metadata.version("control")
    if found:
        return f"version {version} has {', '.join(found)}, which this comparison does not call yet"
    return f"version {version} has no recursive least squares"

# SPDX-License-Identifier: MIT
"""Every forgetting policy, compiled and as the numpy reference writes it."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy_reference as reference
from hypothesis import strategies as st

import ehsid


class Pair(NamedTuple):
    """The same policy twice: `written(n)` is the reference for n parameters."""

    compiled: ehsid.Forgetting
    written: Callable[[int], reference.Policy]


def constant(factor: float = 0.99) -> Pair:
    return Pair(ehsid.Constant(factor), lambda n: reference.Constant(factor))


def exponential(rate: float = 0.99, initial: float = 0.95) -> Pair:
    return Pair(ehsid.Exponential(rate, initial), lambda n: reference.Exponential(rate, initial))


def error_driven(memory: float = 100.0, least: float = 0.5, noise: float = 0.0) -> Pair:
    compiled = ehsid.ErrorDriven(memory, least, noise)
    return Pair(compiled, lambda n: reference.ErrorDriven(memory, least, noise))


def f_ratio(eta: float = 2.0, critical: float = 3.3) -> Pair:
    return Pair(ehsid.FRatio(eta, critical), lambda n: reference.FRatio(eta, critical))


def directional(factor: float = 0.94, epsilon: float = 1e-4) -> Pair:
    compiled = ehsid.Directional(factor, epsilon)
    return Pair(compiled, lambda n: reference.Directional(factor, epsilon))


def random_walk(drift: float = 1e-4) -> Pair:
    return Pair(ehsid.RandomWalk(drift), lambda n: reference.RandomWalk(np.full(n, drift)))


# The defaults of the headers.
PAIRS = {
    "constant": constant(),
    "exponential": exponential(),
    "error_driven": error_driven(),
    "f_ratio": f_ratio(),
    "directional": directional(),
    "random_walk": random_walk(),
}
NAMES = tuple(PAIRS)

# Any parameters within which the textbook form itself keeps nine digits over a few hundred samples:
# a factor of 0.7 for ten samples on end already costs it 0.7^-10 = 35 times the rounding.
ANY = st.one_of(
    st.builds(constant, st.floats(0.9, 1.0)),
    st.builds(exponential, st.floats(0.5, 1.0), st.floats(0.9, 1.0)),
    st.builds(error_driven, st.floats(20.0, 1e4), st.floats(0.7, 1.0), st.floats(0.1, 10.0)),
    st.builds(error_driven, st.floats(20.0, 1e4), st.floats(0.7, 1.0)),
    st.builds(f_ratio, st.floats(0.0, 0.2), st.floats(1.0, 5.0)),
    st.builds(directional, st.floats(0.7, 1.0), st.floats(1e-6, 1.0)),
    st.builds(random_walk, st.floats(0.0, 1e-2)),
)

# Neither guard ever acts.
UNGUARDED = ehsid.RlsOptions(information_margin=0.0, covariance_ceiling=1e30)


def bits(estimator: ehsid.Rls | ehsid.ServoEstimator) -> dict[str, bytes]:
    """The estimate, for comparison to the last bit: all but a history of past samples."""
    names = ("theta_hat", "standard_deviation", "gain", "P", "innovation")
    names += ("forgetting_factor", "residual_variance")
    return {name: np.asarray(getattr(estimator, name)).tobytes() for name in names}


def same_bits(one: ehsid.Trajectory, other: ehsid.Trajectory) -> bool:
    """Are two runs the same to the last bit?"""
    names = ("theta", "standard_deviation", "innovation", "forgetting_factor")
    names += ("residual_variance", "status")
    return all(getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in names)

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


def pair(compiled: ehsid.Forgetting) -> Pair:
    """The policy, and the class of the reference that has its name, with the same settings."""

    def written(n: int) -> reference.Policy:
        settings = [getattr(compiled, setting.name) for setting in compiled.info.settings]
        policy: reference.Policy = getattr(reference, type(compiled).__name__)(*settings)
        return policy

    return Pair(compiled, written)


# The defaults of the headers.
PAIRS = {info.id: pair(info.policy()) for info in ehsid.policies()}
NAMES = tuple(PAIRS)

# Any parameters within which the textbook form itself keeps nine digits over a few hundred samples:
# a factor of 0.7 for ten samples on end already costs it 0.7^-10 = 35 times the rounding.
ANY = st.one_of(
    st.builds(ehsid.Constant, st.floats(0.9, 1.0)),
    st.builds(ehsid.Exponential, st.floats(0.5, 1.0), st.floats(0.9, 1.0)),
    st.builds(ehsid.ErrorDriven, st.floats(20.0, 1e4), st.floats(0.7, 1.0), st.floats(0.1, 10.0)),
    st.builds(ehsid.ErrorDriven, st.floats(20.0, 1e4), st.floats(0.7, 1.0)),
    st.builds(ehsid.FRatio, st.floats(0.0, 0.2), st.floats(1.0, 5.0)),
).map(pair)

# Neither guard ever acts.
UNGUARDED = ehsid.RlsOptions(information_margin=0.0, covariance_ceiling=1e30)


def bits(estimator: ehsid.Rls | ehsid.ArxEstimator) -> dict[str, bytes]:
    """The estimate, for comparison to the last bit: all but a history of past samples."""
    names = ("theta_hat", "standard_deviation", "gain", "P", "innovation")
    names += ("forgetting_factor", "residual_variance")
    return {name: np.asarray(getattr(estimator, name)).tobytes() for name in names}


def same_bits(one: ehsid.Trajectory, other: ehsid.Trajectory) -> bool:
    """Are two runs the same to the last bit?"""
    names = ("theta", "standard_deviation", "innovation", "forgetting_factor")
    names += ("residual_variance", "status")
    return all(getattr(one, name).tobytes() == getattr(other, name).tobytes() for name in names)

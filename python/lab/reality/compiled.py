# SPDX-License-Identifier: MIT
"""Compilation of numerical functions by numba, kept on disk from run to run."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar, cast

try:
    import numba
except ImportError as error:  # an optional dependency: see pyproject.toml, extra "lab"
    raise ImportError(
        "the generator of blind records needs numba: python -m pip install 'ehsid[lab]'"
    ) from error

F = TypeVar("F", bound=Callable[..., object])


def compiled(function: F) -> F:
    """Returns the function compiled by numba, which keeps its cache on disk beside the source."""
    return cast(F, numba.njit(cache=True)(function))

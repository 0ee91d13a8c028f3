# SPDX-License-Identifier: MIT
"""Forgetting policies by the names that users write, and the recursions that take them."""

from __future__ import annotations

from types import MappingProxyType
from typing import NamedTuple

import ehsid

POLICIES = MappingProxyType({info.id.replace("_", "-"): info for info in ehsid.policies()})


class Method(NamedTuple):
    """A recursion: its name in words, and the noise that it is right with."""

    words: str
    noise: str


# See docs/which_estimator.md.
METHODS = MappingProxyType(
    {
        "rls": Method("least squares", "white noise in the equation of the model"),
        "riv": Method("instrumental variables", "noise of the position sensor"),
    }
)


def policies_of(method: str) -> tuple[str, ...]:
    """Returns the names of the policies that a recursion takes."""
    return tuple(POLICIES) if method == "rls" else ("constant", "exponential")

# SPDX-License-Identifier: MIT
"""Pre-images on the command path: u' with effect(u') = u, both as a fraction of rated command."""

from __future__ import annotations

import numpy as np

from ehsid.harness.arrays import FloatArray
from ehsid.harness.simulation.injection.notes import (
    Note,
    Step,
)


def before_dead_band(command: FloatArray, overlap: float) -> Step:
    """The inverse of u' - overlap sgn(u') where |u'| > overlap, else 0: u' = u + overlap sgn(u).

    At u = 0 every u' within the band will do. It is 0: the middle, which stays inside of a band
    that is found a little too small, and needs no memory.
    """
    signs = np.sign(command)
    jumps = int(np.count_nonzero(np.diff(signs[signs != 0.0])))
    return Step(
        command + overlap * signs,
        [
            Note(
                f"the command changes its sign {jumps} times and then jumps by "
                f"{2.0 * overlap:g} of rated"
            )
        ],
    )


def before_bias(command: FloatArray, offset: float) -> Step:
    """By the inverse of u' + offset: u - offset."""
    return Step(command - offset, [])


def before_gain(command: FloatArray, factor: float) -> Step:
    """By the inverse of factor u': u / factor."""
    return Step(command / factor, [])


def before_play(command: FloatArray, half_width: float) -> Step:
    """Of w_k = min(max(w_{k-1}, u'_k - h), u'_k + h), w_{-1} = 0: u' with w = u.

    Where u rises it is pushed from below, u' = u + h; where u falls, u' = u - h; where u rests
    every u' within h will do, and u' rests too. Before the first move it is u itself, 0.
    """
    move = np.sign(np.diff(command, prepend=0.0))
    last = np.maximum.accumulate(np.where(move != 0.0, np.arange(move.size), 0))
    side = move[last]
    turns = int(np.count_nonzero(np.diff(move[move != 0.0])))
    return Step(
        command + half_width * side,
        [
            Note(
                f"the command turns {turns} times, however little, and then jumps by "
                f"{2.0 * half_width:g} of rated"
            )
        ],
    )

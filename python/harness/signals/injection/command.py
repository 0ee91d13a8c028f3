# SPDX-License-Identifier: MIT
"""Pre-images of effects on the command path: u' with effect(u') = u, in units of rated command."""

from __future__ import annotations

import numpy as np

from ...base.arrays import FloatArray
from .notes import Note, Step


def before_dead_band(command: FloatArray, extending: float, retracting: float) -> Step:
    """Returns the pre-image of a dead band: u' = u + extending or u - retracting, by the sign of u.

    The dead band passes u' - extending above that overlap, u' + retracting below the negative of
    the other, else 0. At u = 0 every u' within the band is a pre-image. The function takes the
    middle of the band: it needs no memory, and it stays inside the band even if a diagnosis
    estimates the band a little too small.
    """
    signs = np.sign(command)
    jumps = int(np.count_nonzero(np.diff(signs[signs != 0.0])))
    middle, half_width = 0.5 * (extending - retracting), 0.5 * (extending + retracting)
    return Step(
        command + (middle + half_width * signs),
        [
            Note(
                f"the command changes its sign {jumps} times and then jumps by "
                f"{2.0 * half_width:g} of rated"
            )
        ],
    )


def before_bias(command: FloatArray, offset: float) -> Step:
    """Returns the pre-image of a bias u' + offset: u' = u - offset."""
    return Step(command - offset, [])


def before_gain(command: FloatArray, factor: float) -> Step:
    """Returns the pre-image of a gain, factor u': u' = u / factor."""
    return Step(command / factor, [])


def before_play(command: FloatArray, half_width: float) -> Step:
    """Returns the pre-image of play with half width h: u' for which w = u.

    The play is w_k = min(max(w_{k-1}, u'_k - h), u'_k + h), w_{-1} = 0. Where u rises,
    u' = u + h, because the play pushes w from below. Where u falls, u' = u - h. Where u rests,
    every u' within h of u is a pre-image, and u' rests, too. Before the first move u' = u = 0.
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

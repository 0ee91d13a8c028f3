# SPDX-License-Identifier: MIT
"""How much of its time a diagnosis has behind it, as far as this can be known.

The stages of a diagnosis take very different times, and some of them take place only where the
records ask for them. The time that is expected is counted in units of the stage that tries each
effect alone: all other stages make fits of the same kind, so that they take a multiple of it on any
machine and for any record. Which of them are to come follows, in the mean, from the errors above
the noise floor: benchmarks/time_to_go.py measures how well.
"""

from __future__ import annotations

from types import MappingProxyType

from ehsid.harness.gap.schema import Stage
from ehsid.harness.parallel import Progress

# Sizes of the stages in units of "alone"; means of 20 diagnoses. "together" is the first round.
SIZES: MappingProxyType[Stage, float] = MappingProxyType(
    {
        "values": 0.17,
        "alone": 1.0,
        "at length": 0.25,
        "together": 1.7,
        "deciding": 0.05,
        "laws": 1.1,
        "where": 0.7,
    }
)
LATER_ROUND = 1.4
# A second search, on all records together, has more to simulate than the first one.
JOINT = 1.7

# All errors are ln of the held-out errors over the noise floor.
AT_FLOOR = 0.5  # of the rig with its values fitted: no effect is looked for any further
EXPLAINED = 0.1  # of the best set: no further effect is looked for
UNEXPLAINED = 1.3  # of the best set: a law that the catalogue lacks is looked for
HARD = 3.5  # of the rig with its values fitted: more than one effect may be at work
OTHER_DATA = 2.0  # of the best set on records that were not fitted: all are then fitted together


class Pace:
    """Tells the expected share of the time that is over; it never falls."""

    def __init__(self, progress: Progress | None, *, may_be_joint: bool) -> None:
        """Begins.

        Parameters
        ----------
        progress
            called with the share of the expected time that is over, 0 to 1.
        may_be_joint
            whether a second search may follow, which fits the held-out records too.
        """
        self._progress = progress
        self._may_be_joint = may_be_joint
        self._scale = 1.0
        self._done = 0.0  # units before the present stage
        self._size = 0.0  # of the present stage
        self._left = 0.0  # units behind the present stage
        self._share = 0.0
        self._rounds = 0

    def begin(self, stage: Stage, calibrated: float, best: float) -> None:
        """Begins a stage.

        Parameters
        ----------
        calibrated, best
            ln of the held-out errors over the noise floor, of the rig with its values fitted and of
            the set that is ahead.
        """
        if stage == "values" and self._size:  # the second search
            self._scale, self._may_be_joint, self._rounds = JOINT, False, 0
        self._done += self._size
        self._rounds = self._rounds + 1 if stage == "together" else self._rounds
        self._size = self._size_of(stage)
        self._left = self._scale * self._after(stage, calibrated, best)
        self.within(0.0)

    def within(self, share: float) -> None:
        """Takes the share of the present stage that is done, 0 to 1."""
        done = self._done + share * self._size
        left = self._left + (1.0 - share) * self._size
        if done + left > 0.0:
            self._share = max(self._share, done / (done + left))
        if self._progress is not None:
            self._progress(self._share)

    def _size_of(self, stage: Stage) -> float:
        size = LATER_ROUND if stage == "together" and self._rounds > 1 else SIZES[stage]
        return self._scale * size

    def _after(self, stage: Stage, calibrated: float, best: float) -> float:
        """Returns the units that are expected behind a stage."""
        if stage == "where":
            return 0.0
        where = SIZES["where"] if calibrated > AT_FLOOR else 0.0
        if stage == "laws":
            return where
        laws = SIZES["laws"] if best > UNEXPLAINED else 0.0
        if stage == "deciding":
            joint = self._may_be_joint and best > OTHER_DATA
            return where + laws + (JOINT * 2.0 if joint else 0.0)
        if stage == "together":
            again = calibrated > HARD and best > UNEXPLAINED and self._rounds == 1
            return where + laws + (LATER_ROUND if again else 0.0)
        if stage == "at length":
            return _behind_at_length(calibrated, best)
        behind = _behind_alone(calibrated)
        return behind if stage == "alone" else behind + SIZES["alone"]


def _behind_alone(calibrated: float) -> float:
    """Returns the units behind "alone", as expected before any effect was tried."""
    if calibrated < AT_FLOOR:
        return 0.4
    if calibrated < HARD:
        return 1.6
    return 4.6


def _behind_at_length(calibrated: float, best: float) -> float:
    """Returns the units behind "at length", once the best single effect is known."""
    if calibrated < AT_FLOOR:
        return 0.1
    if best < EXPLAINED:
        return 0.85
    if best < OTHER_DATA:
        return 2.6
    return 4.7 if calibrated > HARD else 2.3

# SPDX-License-Identifier: MIT
"""Faults of a line: what can happen to a frame on its way between host and target."""

from __future__ import annotations

import random
import threading
from collections.abc import Callable
from dataclasses import dataclass

TO_TARGET, TO_HOST = "to target", "to host"
FAULTS = ("drop", "repeat", "flip", "cut", "unended", "noise", "hold")


@dataclass
class Passing:
    """What becomes of a frame.

    Attributes
    ----------
    data
        bytes that go on in its place.
    hold_s
        how long its direction stands still before, s.
    """

    data: bytes
    hold_s: float = 0.0


# Of a direction, the number of the frame in it, and its bytes without zeros.
Hook = Callable[[str, int, bytes], Passing]


def undisturbed(direction: str, number: int, frame: bytes) -> Passing:
    """Lets a frame pass as it is."""
    del direction, number
    return Passing(frame + b"\0")


def fault(kind: str, frame: bytes, rng: random.Random, hold_s: float) -> Passing:
    """Returns the frame with a fault.

    Parameters
    ----------
    kind
        drop: it is lost; repeat: it comes two or three times; flip: one bit is wrong; cut: its end
        is missing; unended: the zero behind it is missing, so that it joins the next one; noise:
        other bytes come before it; hold: it comes late.
    frame
        bytes of the frame without zeros.
    rng
        decides which bit, and how much.
    hold_s
        delay of "hold", s.
    """
    match kind:
        case "drop":
            return Passing(b"")
        case "repeat":
            return Passing((frame + b"\0") * rng.randint(2, 3))
        case "flip":
            damaged = bytearray(frame)
            damaged[rng.randrange(len(frame))] ^= 1 << rng.randrange(8)  # may make a zero
            return Passing(bytes(damaged) + b"\0")
        case "cut":
            return Passing(frame[: rng.randrange(len(frame))] + b"\0")
        case "unended":
            return Passing(frame)
        case "noise":
            return Passing(rng.randbytes(rng.randint(1, 600)) + b"\0" + frame + b"\0")
        case "hold":
            return Passing(frame + b"\0", hold_s)
    raise ValueError(f"{kind}: there is no such fault: expected one of {', '.join(FAULTS)}")


class OnRequest:
    """A hook that puts a fault into the next frame of a direction whenever it is asked to.

    Attributes
    ----------
    made
        number of faults that were put in.
    """

    def __init__(self, hold_s: float) -> None:
        self.made = 0
        self._hold_s = hold_s
        self._wanted: dict[str, list[str]] = {TO_TARGET: [], TO_HOST: []}
        self._rng = random.Random(0)
        self._lock = threading.Lock()

    def ask(self, kind: str, direction: str) -> None:
        """Puts a fault into the next frame in a direction that has none yet."""
        if kind not in FAULTS or direction not in self._wanted:
            raise ValueError(
                f"{kind}, {direction}: there is no such fault: expected one of "
                f"{', '.join(FAULTS)}, and {' or '.join(self._wanted)}"
            )
        with self._lock:
            self._wanted[direction].append(kind)

    def __call__(self, direction: str, number: int, frame: bytes) -> Passing:
        """Returns what becomes of a frame."""
        with self._lock:
            wanted = self._wanted[direction]
            if not wanted:
                return undisturbed(direction, number, frame)
            self.made += 1
            return fault(wanted.pop(0), frame, self._rng, self._hold_s)

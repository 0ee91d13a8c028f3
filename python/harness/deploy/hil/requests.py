# SPDX-License-Identifier: MIT
"""Requests of the host to the target, but for `Configuration`, which has its own module."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import ClassVar

from ehsid.harness.deploy.hil.layout import Body, Whole
from ehsid.harness.deploy.hil.messages import VERSION, Kind


@dataclass(frozen=True)
class Hello:
    """Request for the identity of the target; the target goes to the state idle."""

    kind: ClassVar[Kind] = Kind.HELLO

    def body(self) -> bytes:
        """Returns the body of `hello`: the protocol version of this host."""
        return struct.pack("<H", VERSION)


@dataclass(frozen=True)
class Start:
    """Begins a run with sample number `first`, 0 to 2^32 - 1."""

    kind: ClassVar[Kind] = Kind.START

    first: int

    def body(self) -> bytes:
        """Returns the body of `start`; raises ValueError if the number does not fit its type."""
        body = Body()
        body.whole("first", self.first, Whole.U32)
        return bytes(body)


@dataclass(frozen=True)
class Sample:
    """Measurements at t_k; values that are not finite are allowed, because a sensor may give them.

    Attributes
    ----------
    number
        k, one more than the number of the sample before.
    position_m, reference_m
        measured position and reference position, m.
    reference_velocity_m_s
        speed of the reference, m/s.
    direct_v
        added to the command of the position controller, V; without position control it is the
        whole command.
    """

    kind: ClassVar[Kind] = Kind.SAMPLE

    number: int
    position_m: float
    reference_m: float = 0.0
    reference_velocity_m_s: float = 0.0
    direct_v: float = 0.0

    def body(self) -> bytes:
        """Returns the body of `sample`; raises ValueError if a number does not fit its type."""
        body = Body()
        body.whole("number", self.number, Whole.U32)
        for name in ("position_m", "reference_m", "reference_velocity_m_s", "direct_v"):
            body.real(name, getattr(self, name), finite=False)
        return bytes(body)


@dataclass(frozen=True)
class Resume:
    """Opens the valve again after the watchdog has closed it."""

    kind: ClassVar[Kind] = Kind.RESUME

    def body(self) -> bytes:
        """Returns the body of `resume`, which is empty."""
        return b""


@dataclass(frozen=True)
class Stop:
    """Closes the valve."""

    kind: ClassVar[Kind] = Kind.STOP

    def body(self) -> bytes:
        """Returns the body of `stop`, which is empty."""
        return b""

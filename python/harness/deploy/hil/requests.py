# SPDX-License-Identifier: MIT
"""What the host asks of the target, but for `Configuration`, which has a module of its own."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import ClassVar

from ehsid.harness.deploy.hil.layout import Body, Whole
from ehsid.harness.deploy.hil.messages import VERSION, Kind


@dataclass(frozen=True)
class Hello:
    """Who is there? Leads to idle."""

    kind: ClassVar[Kind] = Kind.HELLO

    def body(self) -> bytes:
        """The version spoken here."""
        return struct.pack("<H", VERSION)


@dataclass(frozen=True)
class Start:
    """Begins a run with sample number `first`, 0 to 2^32 - 1."""

    kind: ClassVar[Kind] = Kind.START

    first: int

    def body(self) -> bytes:
        """The body of `start`; ValueError where the number does not fit."""
        body = Body()
        body.whole("first", self.first, Whole.U32)
        return bytes(body)


@dataclass(frozen=True)
class Sample:
    """What was measured at t_k. Not finite is allowed: a sensor may say so.

    Attributes
    ----------
    number
        k, one more than that of the sample before.
    position_m, reference_m
        m.
    reference_velocity_m_s
        m/s.
    direct_v
        command where the target does not control the position, V.
    """

    kind: ClassVar[Kind] = Kind.SAMPLE

    number: int
    position_m: float
    reference_m: float = 0.0
    reference_velocity_m_s: float = 0.0
    direct_v: float = 0.0

    def body(self) -> bytes:
        """The body of `sample`; ValueError where a number is beyond its type."""
        body = Body()
        body.whole("number", self.number, Whole.U32)
        for name in ("position_m", "reference_m", "reference_velocity_m_s", "direct_v"):
            body.real(name, getattr(self, name), finite=False)
        return bytes(body)


@dataclass(frozen=True)
class Resume:
    """Opens the valve again after the watchdog."""

    kind: ClassVar[Kind] = Kind.RESUME

    def body(self) -> bytes:
        """Nothing."""
        return b""


@dataclass(frozen=True)
class Stop:
    """Closes the valve."""

    kind: ClassVar[Kind] = Kind.STOP

    def body(self) -> bytes:
        """Nothing."""
        return b""

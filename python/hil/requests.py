# SPDX-License-Identifier: MIT
"""Requests of the host to the target, but for `Configuration`, which has its own module.

What a user can request during a run: another start of the estimator, and the end of the run.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from ehsid.harness.firmware.configuration import EstimatorConfiguration

from . import messages
from .frames import Message


class _Request:
    """A request whose attributes are the fields of its message."""

    message: ClassVar[Message]
    finite: ClassVar[bool] = True

    def body(self) -> bytes:
        """Returns the body; raises ValueError if a number does not fit its type."""
        return self.message.pack(vars(self), finite=self.finite)


@dataclass(frozen=True)
class Hello(_Request):
    """Request for the identity of the target; the target goes to the state idle."""

    message: ClassVar[Message] = messages.HELLO

    version: int = messages.VERSION


@dataclass(frozen=True)
class Start(_Request):
    """Begins a run with sample `number`, 0 to 2^32 - 1."""

    message: ClassVar[Message] = messages.START

    number: int


@dataclass(frozen=True)
class Sample(_Request):
    """Measurements at t_k, with the fields of `messages.SAMPLE`.

    Values that are not finite are allowed, because a sensor may give them. Without position control
    `direct_v` is the whole command.
    """

    message: ClassVar[Message] = messages.SAMPLE
    finite: ClassVar[bool] = False

    number: int
    position_m: float
    reference_m: float = 0.0
    reference_velocity_m_s: float = 0.0
    direct_v: float = 0.0


@dataclass(frozen=True)
class Resume(_Request):
    """Opens the valve again after the watchdog has closed it."""

    message: ClassVar[Message] = messages.RESUME


@dataclass(frozen=True)
class Stop(_Request):
    """Closes the valve."""

    message: ClassVar[Message] = messages.STOP


class Stopped(Exception):  # noqa: N818 -- the user's request
    """Raised by a `Steer`: the run ends before this sample, with the samples so far as result."""


# Called with the number of each sample before it is sent. Returns the settings with which the
# estimator of the target begins anew at this sample; None lets it go on.
Steer = Callable[[int], EstimatorConfiguration | None]

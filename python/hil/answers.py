# SPDX-License-Identifier: MIT
"""Packets from the target: answers to requests, and packets that it sends without a request.

The fields are those of the tables in `messages`, which have their units and meanings.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Self

import ehsid

from . import messages
from .frames import BadFrame, HilError, Message, Packet
from .messages import TRACKED, VERSION, Flags, Kind, Reason, State

_STATUSES = {int(status) for status in ehsid.Status}
_REASONS = {int(reason) for reason in ehsid.TrustReason}


class _Answer:
    """An answer whose attributes are the fields of its message."""

    message: ClassVar[Message]

    @classmethod
    def parse(cls, body: bytes) -> Self:
        """Reads the body of the answer; raises BadFrame if it is not valid."""
        values, _ = cls.message.unpack(body)
        return cls(**values)


@dataclass(frozen=True)
class Identity:
    """Identity of the target that answers."""

    version: int
    """Version of the protocol."""
    firmware: tuple[int, int, int]
    """Version of the firmware: major, minor, patch."""
    policies: frozenset[int]
    """Numbers of the forgetting policies in the firmware."""
    parameters: frozenset[int]
    """Numbers of parameters of the estimators in the firmware."""
    board: str
    """Name of the board."""

    @classmethod
    def parse(cls, body: bytes) -> Self:
        """Reads the body of `identity`.

        Raises
        ------
        BadFrame
            the body has a wrong length.
        HilError
            the target has another version of the protocol, whose layout this host does not know.
        """
        if len(body) >= 2 and (version := int.from_bytes(body[:2], "little")) != VERSION:
            older = "the firmware" if version < VERSION else "this host (pip install -U ehsid)"
            raise HilError(
                f"the target speaks version {version} of the line, this host version {VERSION}: "
                f"bring {older} up to date; both are made from one release"
            )
        values, _ = messages.IDENTITY.unpack(body)
        return cls(
            values["version"],
            (values["major"], values["minor"], values["patch"]),
            _bits(values["policies"]),
            _bits(values["parameters"]),
            _printable(values["board"].rstrip(b"\0").decode("ascii", "replace")),
        )


@dataclass(frozen=True)
class Done(_Answer):
    """The target has carried out a request and is now in this state."""

    message: ClassVar[Message] = messages.DONE

    state: State


@dataclass(frozen=True)
class Result:
    """Answer of the target to a sample: command, state of the controller, estimate.

    The flags stand as `converged`, `gain_estimated`, `limited` and `residuals_white`: whether the
    estimate has converged, the gain comes from it, the command is at its limit, its residuals pass
    the test for white residuals. Firmware of earlier versions never says that they do not.
    `theta` has n numbers.
    """

    number: int
    command_v: float
    gain_v_m: float
    velocity_gain_m_s_v: float
    status: int
    converged: bool
    gain_estimated: bool
    limited: bool
    residuals_white: bool
    resets: int
    innovation_m: float
    forgetting_factor: float
    fit_percent: float
    excitation: float
    residual_variance_m2: float
    step_cycles: int
    bad_frames: int
    repeated: int
    trips: int
    theta: tuple[float, ...]

    @classmethod
    def parse(cls, body: bytes) -> Self:
        """Reads the body of `result`.

        Raises
        ------
        BadFrame
            the body has a wrong length.
        HilError
            a number is not finite, or the estimator has no such status. The check sum was right, so
            the target means it, and would answer the same again.
        """
        values, theta_bytes = messages.RESULT.unpack(body)
        n, flags = values.pop("n"), values.pop("flags")
        if len(theta_bytes) != 4 * n:
            raise BadFrame(f"{len(theta_bytes)} bytes for theta of {n} numbers")
        theta = struct.unpack(f"<{n}f", theta_bytes)
        _check({**values, **{f"theta[{i}]": number for i, number in enumerate(theta)}})
        return cls(
            **values,
            converged=bool(flags & Flags.CONVERGED),
            gain_estimated=bool(flags & Flags.GAIN_FROM_ESTIMATE),
            limited=bool(flags & Flags.AT_LIMIT),
            residuals_white=not flags & Flags.RESIDUALS_NOT_WHITE,
            theta=theta,
        )


@dataclass(frozen=True)
class ServoResult:
    """Answer of a target with a ServoEstimator to a sample.

    The values of the servo are NaN before there are any; a reason is an `ehsid.TrustReason`.
    """

    number: int
    command_v: float
    gain_v_m: float
    velocity_gain_m_s_v: float
    velocity_gain_half_width: float
    velocity_gain_reason: int
    omega_n_rad_s: float
    omega_n_half_width: float
    omega_n_reason: int
    xi: float
    xi_half_width: float
    xi_reason: int
    status: int
    gain_estimated: bool
    limited: bool
    step_cycles: int
    bad_frames: int
    repeated: int
    trips: int

    @property
    def tracked(self) -> list[tuple[float, float, int]]:
        """Value, half width and reason of K, omega_n and xi."""
        return [(getattr(self, a), getattr(self, b), getattr(self, c)) for a, b, c in TRACKED]

    @classmethod
    def parse(cls, body: bytes) -> Self:
        """Reads the body of `servo_result`; raises as `Result.parse` does."""
        values, _ = messages.SERVO_RESULT.unpack(body)
        flags, known = values.pop("flags"), dict(values)
        for value, half_width, reason in TRACKED:
            if math.isnan(values[value]) and math.isnan(values[half_width]):
                del known[value], known[half_width]
            if values[reason] not in _REASONS:
                raise _wrong(reason, values[reason], "one of those of the estimator")
        _check(known)
        return cls(
            **values,
            gain_estimated=bool(flags & Flags.GAIN_FROM_ESTIMATE),
            limited=bool(flags & Flags.AT_LIMIT),
        )


SampleAnswer = Result | ServoResult


@dataclass(frozen=True)
class Refused(_Answer):
    """The target refused a request and has changed nothing."""

    message: ClassVar[Message] = messages.REFUSED

    reason: Reason
    state: State
    status: int
    expected: int


@dataclass(frozen=True)
class Safe(_Answer):
    """The watchdog has closed the valve; the target sends this without a request."""

    message: ClassVar[Message] = messages.SAFE

    trips: int
    expected: int
    valve_command_v: float


Answer = Identity | Done | Result | ServoResult | Refused | Safe
_ANSWERS: dict[int, type[Answer]] = {
    Kind.IDENTITY: Identity,
    Kind.DONE: Done,
    Kind.RESULT: Result,
    Kind.SERVO_RESULT: ServoResult,
    Kind.REFUSED: Refused,
    Kind.SAFE: Safe,
}


def parse_answer(packet: Packet) -> Answer:
    """Reads the answer of the target from a packet.

    Raises
    ------
    BadFrame
        the packet is not an answer of this version.
    HilError
        the packet is an identity of another version of the protocol.
    """
    if packet.kind not in _ANSWERS:
        raise BadFrame(f"no answer has kind 0x{packet.kind:02X}")
    return _ANSWERS[packet.kind].parse(packet.body)


def _bits(word: int) -> frozenset[int]:
    return frozenset(bit for bit in range(word.bit_length()) if word >> bit & 1)


def _printable(text: str) -> str:
    """Returns the text with '?' for control characters, which could rewrite the user's terminal."""
    return "".join(c if c.isprintable() else "?" for c in text)


def _check(values: Mapping[str, float]) -> None:
    """Checks the numbers of an answer to a sample."""
    for name, value in values.items():
        if not math.isfinite(value):
            raise _wrong(name, value, "a finite number")
    if values["status"] not in _STATUSES:
        raise _wrong("status", values["status"], "a status of the estimator")


def _wrong(name: str, value: float, expected: str) -> HilError:
    return HilError(
        f"the target answered a sample with {name} = {value:g}: expected {expected}; is the "
        "firmware of examples/firmware/servo on it, of the same release as this host?"
    )

# SPDX-License-Identifier: MIT
"""Packets from the target: answers to requests, and packets that it sends without a request."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from ehsid.harness.deploy.hil.errors import BadFrame, HilError
from ehsid.harness.deploy.hil.frames import Packet
from ehsid.harness.deploy.hil.messages import VERSION, Kind, Reason, State


@dataclass(frozen=True)
class Identity:
    """Identity of the target that answers.

    Attributes
    ----------
    version
        version of the protocol.
    firmware
        version of the firmware: major, minor, patch.
    policies
        numbers of the forgetting policies in the firmware.
    parameters
        numbers of parameters of the estimators in the firmware.
    board
        name of the board.
    """

    LAYOUT: ClassVar = struct.Struct("<H3BBH12s")

    version: int
    firmware: tuple[int, int, int]
    policies: frozenset[int]
    parameters: frozenset[int]
    board: str

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
        version, *firmware, policies, parameters, board = _unpack(cls.LAYOUT, body)
        return cls(
            version,
            (firmware[0], firmware[1], firmware[2]),
            frozenset(i for i in range(8) if policies >> i & 1),
            frozenset(n for n in range(16) if parameters >> n & 1),
            board.rstrip(b"\0").decode("ascii", "replace"),
        )


@dataclass(frozen=True)
class Done:
    """The target has carried out a request and is now in this state."""

    LAYOUT: ClassVar = struct.Struct("<B")

    state: State

    @classmethod
    def parse(cls, body: bytes) -> Self:
        """Reads the body of `done`; raises BadFrame if it is not valid."""
        (state,) = _unpack(cls.LAYOUT, body)
        return cls(_state(state))


@dataclass(frozen=True)
class Result:
    """Answer of the target to a sample: command, state of the controller, estimate.

    Attributes
    ----------
    number
        k of the sample.
    command_v
        command that acts from t_k to t_{k+1}, V.
    gain_v_m
        gain of the controller, V/m.
    velocity_gain_m_s_v
        velocity gain of the plant, computed from theta, m/s/V; 0 if theta gives none.
    status
        `ehsid_status` of this sample, see `status_name`.
    converged, gain_estimated, limited
        whether the estimate has converged, the gain comes from it, the command is at its limit.
    resets
        changes of the plant since the start.
    innovation_m
        innovation epsilon(k), m.
    forgetting_factor
        lambda(k).
    fit_percent
        fit of the one-step-ahead prediction, %.
    excitation
        share of recent samples that carried information, 0 to 1.
    residual_variance_m2
        residual variance sigma^2, m^2.
    step_cycles
        cycles of the processor clock from the sample to the command and the estimate.
    bad_frames, repeated, trips
        counts since power-up, each up to 65535: damaged frames received; answers given again; times
        the watchdog closed the valve.
    theta
        estimate, n numbers in the units of the signals.
    """

    LAYOUT: ClassVar = struct.Struct("<I3f2BH5fI3HB")

    number: int
    command_v: float
    gain_v_m: float
    velocity_gain_m_s_v: float
    status: int
    converged: bool
    gain_estimated: bool
    limited: bool
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
        """Reads the body of `result`; raises BadFrame if it is not valid."""
        *fixed, n = _unpack(cls.LAYOUT, body[: cls.LAYOUT.size])
        theta = body[cls.LAYOUT.size :]
        if len(theta) != 4 * n:
            raise BadFrame(f"{len(theta)} bytes for theta of {n} numbers")
        flags = [bool(fixed[5] >> bit & 1) for bit in range(3)]
        values: list[Any] = [*fixed[:5], *flags, *fixed[6:], struct.unpack(f"<{n}f", theta)]
        return cls(*values)


@dataclass(frozen=True)
class Refused:
    """The target refused a request and has changed nothing.

    Attributes
    ----------
    reason, state
        reason of the refusal, and the state of the target.
    status
        `ehsid_status` of the refused configuration, else 0.
    expected
        number of the sample that the target waits for.
    """

    LAYOUT: ClassVar = struct.Struct("<3BI")

    reason: Reason
    state: State
    status: int
    expected: int

    @classmethod
    def parse(cls, body: bytes) -> Self:
        """Reads the body of `refused`; raises BadFrame if it is not valid."""
        reason, state, status, expected = _unpack(cls.LAYOUT, body)
        if reason not in set(Reason):
            raise BadFrame(f"refused for reason {reason}, which there is not")
        return cls(Reason(reason), _state(state), status, expected)


@dataclass(frozen=True)
class Safe:
    """The watchdog has closed the valve; the target sends this without a request.

    Attributes
    ----------
    trips
        number of times the watchdog has closed the valve since power-up.
    expected
        number of the sample that the target waits for.
    valve_command_v
        command at the valve, V.
    """

    LAYOUT: ClassVar = struct.Struct("<HIf")

    trips: int
    expected: int
    valve_command_v: float

    @classmethod
    def parse(cls, body: bytes) -> Self:
        """Reads the body of `safe`; raises BadFrame if it is not valid."""
        return cls(*_unpack(cls.LAYOUT, body))


Answer = Identity | Done | Result | Refused | Safe
_ANSWERS: dict[int, type[Answer]] = {
    Kind.IDENTITY: Identity,
    Kind.DONE: Done,
    Kind.RESULT: Result,
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


def _unpack(layout: struct.Struct, body: bytes) -> tuple[Any, ...]:
    if len(body) != layout.size:
        raise BadFrame(f"a body of {len(body)} bytes where {layout.size} belong")
    return layout.unpack(body)


def _state(number: int) -> State:
    if number not in set(State):
        raise BadFrame(f"state {number}, which there is not")
    return State(number)

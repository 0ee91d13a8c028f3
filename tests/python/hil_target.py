# SPDX-License-Identifier: MIT
"""A target of docs/hil_protocol.md, written from the document with a trivial sum for the estimator.

It shares the framing with the host, which has tests of its own, and no layout of any body.
"""

import math
import socket
import struct
import threading
from dataclasses import dataclass, field

from ehsid.hil.frames import BadFrame, Packet, decode, encode

IDLE, READY, RUNNING, SAFE = range(4)
POLICIES, PARAMETERS = 0b00_1001, 1 << 4 | 1 << 6 | 1 << 7  # 0 constant, 3 F-ratio
BOARD = b"fake".ljust(12, b"\0")


@dataclass
class Target:
    """The state machine; frames in, frames out. `carried_out` and `trips` are for assertions."""

    version: int = 3
    most_lost: int = 1000  # 0 before there were lost cycles
    carried_out: list[int] = field(default_factory=list)
    configurations: list[bytes] = field(default_factory=list)
    trips: int = 0
    state: int = IDLE
    expected: int = 0
    total: float = 0.0  # of all positions since `configure`: a sample taken twice changes it
    last: tuple[int, int] | None = None
    answer: bytes = b""
    bad_frames: int = 0
    repeated: int = 0

    def reset(self) -> bytes:
        """As power-up; what the tests look at is kept."""
        again = (self.version, self.most_lost, self.carried_out, self.configurations)
        self.__init__(*again)  # type: ignore[misc]
        return self.identity(0)

    def trip(self) -> bytes:
        """As if no valid request had come for too long."""
        if self.state != RUNNING:
            return b""
        self.state, self.trips = SAFE, self.trips + 1
        return encode(0x86, 0, struct.pack("<HIf", self.trips, self.expected, 0.0))

    def take(self, frame: bytes) -> bytes:
        """What is sent for a frame; nothing for one that is damaged or late."""
        try:
            packet = decode(frame)
        except BadFrame:
            self.bad_frames += 1
            return b""
        behind = self.last is not None and (packet.sequence - self.last[1]) % 65536 >= 32768
        if packet.kind & 0x80 or (behind and packet.kind != 1):
            self.bad_frames += 1
            return b""
        if packet.kind != 1 and self.last == (packet.kind, packet.sequence):
            self.repeated += 1
            return self.answer
        self.last = (packet.kind, packet.sequence)
        self.answer = self.carry_out(packet)
        return self.answer

    def carry_out(self, packet: Packet) -> bytes:
        body = packet.body
        match packet.kind, len(body), self.state:
            case 1, 2, _:
                self.state = IDLE
                return self.identity(packet.sequence)
            case 2, size, 0 | 1 if size >= 141:
                if body[0] == 0 and struct.unpack_from("<f", body, 21) == (0.0,):  # lambda
                    return self.refused(packet, 4, 8)
                self.configurations.append(body)
                self.state, self.total = READY, 0.0
            case 3, 4, 1:
                (self.expected,) = struct.unpack("<I", body)
                self.state = RUNNING
            case 4, 20, 2:
                return self.sample(packet)
            case 5, 0, 3:
                self.state = RUNNING
            case 6, 0, 1 | 2 | 3:
                self.state = READY
            case 2 | 3 | 4 | 5 | 6, _, _:
                return self.refused(packet, 1)
            case _:
                return self.refused(packet, 3)
        return encode(0x82, packet.sequence, bytes([self.state]))

    def sample(self, packet: Packet) -> bytes:
        number, position, _, _, direct = struct.unpack("<I4f", packet.body)
        if self.lost_before(number) is None:
            return self.refused(packet, 2)
        self.expected = number + 1
        self.carried_out.append(number)
        finite = math.isfinite(position)
        self.total += position if finite else 0.0
        return encode(
            0x84,
            packet.sequence,
            struct.pack("<I3fBBH", number, direct, 20.0, 0.05, 0 if finite else 5, 0b101, 2)
            + struct.pack("<5f", self.total, 0.99, 98.5, 0.5, 1e-6)
            + struct.pack("<I3H", 1234, self.bad_frames, self.repeated, self.trips)
            + struct.pack("<B3f", 3, 1.0, 2.0, number),
        )

    def lost_before(self, number: int) -> int | None:
        """How many cycles were lost before this sample; None where its number is out of order."""
        lost = (number - self.expected) % 2**32
        return lost if lost <= self.most_lost else None

    def identity(self, sequence: int) -> bytes:
        head = struct.pack("<H3B", self.version, 1, 2, 3)
        return encode(0x81, sequence, head + struct.pack("<BH", POLICIES, PARAMETERS) + BOARD)

    def refused(self, packet: Packet, reason: int, status: int = 0) -> bytes:
        body = struct.pack("<3BI", reason, self.state, status, self.expected)
        return encode(0x85, packet.sequence, body)


class FakeDevice:
    """A `Target` in a thread, at one end of a pair of sockets; see `relay.Device`."""

    def __init__(self, target: Target) -> None:
        self.target = target
        self.socket, self._own = socket.socketpair()
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._send(target.reset())
        self._thread.start()

    def fileno(self) -> int:
        return self.socket.fileno()

    def read(self) -> bytes:
        return self.socket.recv(4096)

    def write(self, data: bytes) -> None:
        self.socket.sendall(data)

    def reset(self) -> None:
        with self._lock:
            self._send(self.target.reset())

    def trip(self) -> None:
        with self._lock:
            self._send(self.target.trip())

    def close(self) -> None:
        self.socket.close()
        self._thread.join(5.0)
        self._own.close()

    def _send(self, data: bytes) -> None:
        if data:
            self._own.sendall(data)

    def _received(self) -> bytes:
        try:
            return self._own.recv(4096)
        except ConnectionResetError:
            return b""

    def _serve(self) -> None:
        begun = b""
        # A host that has gone with bytes unread resets the connection.
        while data := self._received():
            *frames, begun = (begun + data).split(b"\0")
            for frame in filter(None, frames):
                with self._lock:
                    self._send(self.target.take(frame))

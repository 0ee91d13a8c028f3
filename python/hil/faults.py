# SPDX-License-Identifier: MIT
"""Faults of a line: what can happen to a frame on its way between host and target.

A line with faults: a relay between host and target that disturbs the frames on their way.

Frames keep their order in each direction, as on any serial line.
"""

from __future__ import annotations

import random
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from typing import Protocol

TO_TARGET, TO_HOST = "to target", "to host"
FAULTS = ("drop", "repeat", "flip", "cut", "unended", "noise", "hold")


@dataclass
class Passing:
    """What becomes of a frame."""

    data: bytes
    """Bytes that go on in its place."""
    hold_s: float = 0.0
    """How long its direction stands still before, s."""


# Of a direction, the number of the frame in it, and its bytes without zeros.
Hook = Callable[[str, int, bytes], Passing]


def undisturbed(_direction: str, _number: int, frame: bytes) -> Passing:
    """Lets a frame pass as it is."""
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


class DeviceGone(Exception):  # noqa: N818 -- the other end has hung up
    """The target has closed its end of the line."""


class Device(Protocol):
    """A target behind the relay; `read` raises `DeviceGone` where there will be nothing more."""

    def fileno(self) -> int:
        """Returns the descriptor to wait for."""

    def read(self) -> bytes:
        """Returns the bytes that are there."""

    def write(self, data: bytes) -> None:
        """Sends bytes."""

    def close(self) -> None:
        """Ends the connection."""


Waited = socket.socket | Device  # that `select` waits for


class _Direction:
    """Frames on their way."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.number = 0  # of the next frame since the hook was set
        self._begun = b""
        self._waiting: deque[tuple[float, bytes]] = deque()  # when it may go, what

    def take(self, data: bytes, hook: Hook) -> None:
        *frames, self._begun = (self._begun + data).split(b"\0")
        for frame in frames:
            passing = Passing(b"\0")  # between two zeros: nothing to disturb
            if frame:
                passing = hook(self.name, self.number, frame)
                self.number += 1
            before = self._waiting[-1][0] if self._waiting else 0.0
            due = max(before, time.monotonic() + passing.hold_s)
            self._waiting.append((due, passing.data))

    def due(self) -> bytes:
        """Returns what may go by now."""
        gone = b""
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            gone += self._waiting.popleft()[1]
        return gone

    def wait_s(self) -> float | None:
        """Returns the time until the next frame may go, s; None if there is none."""
        return max(0.0, self._waiting[0][0] - time.monotonic()) if self._waiting else None


class Relay:
    """Listens for one host after the other, and passes frames on to the device and back.

    Attributes
    ----------
    device
        the target.
    port
        line for the host, for `open_line`.
    """

    def __init__(self, device: Device) -> None:
        self.device = device
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = f"socket://127.0.0.1:{self._listening.getsockname()[1]}"
        self._hook: Hook = undisturbed
        self._lock = threading.Lock()
        self._directions = (_Direction(TO_TARGET), _Direction(TO_HOST))
        self._end, self._ended = socket.socketpair()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def disturb(self, hook: Hook) -> None:
        """Passes all frames through a hook from the next one on; their numbers start anew."""
        with self._lock:
            self._hook = hook
            for direction in self._directions:
                direction.number = 0

    def hang_up(self) -> None:
        """Ends the connection of the host that is there."""
        self._end.send(b"x")

    def close(self) -> None:
        """Ends the relay and the connection of the device."""
        self._end.close()
        self._thread.join(5.0)
        for end in (self._ended, self._listening, self.device):
            end.close()

    def _run(self) -> None:
        with suppress(DeviceGone, ConnectionError):  # the host then sees that the line is closed
            self._serve()

    def _serve(self) -> None:
        """Waits for hosts; frames of a device that nobody listens to pass the hook and are lost."""
        while True:
            ends: list[Waited] = [self._ended, self._listening, self.device]
            ready, _, _ = select.select(ends, [], [])
            if self._ended in ready and not self._ended.recv(1):
                return
            if self._listening in ready:
                host, _ = self._listening.accept()
                host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                with host:
                    if not self._serve_host(host):
                        return
            elif self.device in ready:
                back = self._directions[1]
                with self._lock:
                    back.take(self.device.read(), self._hook)
                back.due()

    def _serve_host(self, host: socket.socket) -> bool:
        """Serves a host until it goes; returns False where the relay is to end."""
        there, back = self._directions
        while True:
            waits = [wait for d in self._directions if (wait := d.wait_s()) is not None]
            ends: list[Waited] = [self._ended, host, self.device]
            ready, _, _ = select.select(ends, [], [], min(waits, default=None))
            if self._ended in ready:
                return bool(self._ended.recv(1))
            with self._lock:
                if host in ready:
                    try:
                        data = host.recv(4096)
                    except ConnectionError:
                        data = b""
                    if not data:
                        return True
                    there.take(data, self._hook)
                if self.device in ready:
                    back.take(self.device.read(), self._hook)
            self.device.write(there.due())
            with suppress(ConnectionError):
                host.sendall(back.due())


@contextmanager
def relayed(device: Device) -> Iterator[Relay]:
    """Runs a relay in front of a device as long as the context lasts."""
    relay = Relay(device)
    try:
        yield relay
    finally:
        relay.close()

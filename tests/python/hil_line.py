# SPDX-License-Identifier: MIT
"""A line that goes wrong: a relay between host and target that drops, repeats, damages, delays.

Frames keep their order in each direction, as on any serial line.
"""

import random
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Protocol

TO_TARGET, TO_HOST = "to target", "to host"


class Device(Protocol):
    """A target behind the relay."""

    def fileno(self) -> int: ...
    def read(self) -> bytes: ...
    def write(self, data: bytes) -> None: ...
    def reset(self) -> None: ...
    def close(self) -> None: ...


@dataclass
class Passing:
    """What becomes of a frame: these bytes, after this direction has stood still for so long."""

    data: bytes
    hold_s: float = 0.0


# Of a direction, the number of the frame in it since `disturb`, and its bytes without zeros.
Hook = Callable[[str, int, bytes], Passing]


def undisturbed(direction: str, number: int, frame: bytes) -> Passing:
    return Passing(frame + b"\0")


FAULTS = ("drop", "repeat", "flip", "cut", "unended", "noise", "hold")


def fault(kind: str, frame: bytes, rng: random.Random, hold_s: float) -> Passing:
    """The frame with this fault."""
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
    raise ValueError(kind)


@dataclass
class Seeded:
    """Each frame has one of these faults with this probability; the same for the same seed."""

    seed: int
    kinds: Sequence[str] = FAULTS
    probability: float = 0.2
    hold_s: float = 0.06
    made: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._rng = random.Random(self.seed)

    def __call__(self, direction: str, number: int, frame: bytes) -> Passing:
        if self._rng.random() >= self.probability:
            return undisturbed(direction, number, frame)
        kind = self._rng.choice(list(self.kinds))
        self.made.append(f"{kind} {direction}")
        return fault(kind, frame, self._rng, self.hold_s)


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
        """What may go by now."""
        gone = b""
        while self._waiting and self._waiting[0][0] <= time.monotonic():
            gone += self._waiting.popleft()[1]
        return gone

    def wait_s(self) -> float | None:
        return max(0.0, self._waiting[0][0] - time.monotonic()) if self._waiting else None


class Relay:
    """Listens for one host after the other, and passes frames on to the device and back."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = f"socket://127.0.0.1:{self._listening.getsockname()[1]}"
        self._hook: Hook = undisturbed
        self._lock = threading.Lock()
        self._directions = (_Direction(TO_TARGET), _Direction(TO_HOST))
        self._end, self._ended = socket.socketpair()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def disturb(self, hook: Hook) -> None:
        """From the next frame on; numbers in both directions start anew."""
        with self._lock:
            self._hook = hook
            for direction in self._directions:
                direction.number = 0

    def hang_up(self) -> None:
        """Ends the connection of the host that is there."""
        self._end.send(b"x")

    def close(self) -> None:
        self._end.close()
        self._thread.join(5.0)
        for end in (self._ended, self._listening, self.device):
            end.close()

    def _serve(self) -> None:
        """Waits for hosts; frames of a device that nobody listens to pass the hook and are lost."""
        while True:
            ready, _, _ = select.select([self._ended, self._listening, self.device], [], [])
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
        """Until the host goes; False where the relay is to end."""
        there, back = self._directions
        while True:
            waits = [wait for d in self._directions if (wait := d.wait_s()) is not None]
            ready, _, _ = select.select(
                [self._ended, host, self.device], [], [], min(waits, default=None)
            )
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
    relay = Relay(device)
    try:
        yield relay
    finally:
        relay.close()

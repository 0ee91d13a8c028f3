# SPDX-License-Identifier: MIT
"""A session with the servo on the emulated board and on the host: both must answer the same bytes.

    python play_session.py HOST-PROGRAM QEMU MACHINE IMAGE

Every request is sent at once, without waiting for answers. What the line carries is written here
from docs/hil_protocol.md with Python's own CRC. Of the answers only `step_cycles` may differ, and
the name of the board. Standard library only.
"""

from __future__ import annotations

import binascii
import math
import random
import re
import struct
import subprocess
import sys
import threading
from pathlib import Path

C_HEADER = Path(__file__).parents[2] / "cpp" / "include" / "ehsid" / "c_api.h"
POLICIES = len(re.findall(r"^  DO\(", C_HEADER.read_text(encoding="utf-8"), flags=re.MULTILINE))
TIMEOUT_S = 60.0
SAMPLES = 120
SERVO_SAMPLES = 1500
STEP_CYCLES = {0x84: slice(3 + 40, 3 + 44), 0x87: slice(3 + 41, 3 + 45)}
POSITION_CONTROL, SEED, FOLLOW, OFFSET, RESET = 4, 8, 16, 1, 2


def stuffed(packet: bytes) -> bytes:
    """COBS, block by block; a packet here is shorter than 254 bytes without a zero."""
    blocks = packet.split(b"\0")
    assert all(len(block) < 254 for block in blocks)
    return b"".join(bytes([len(block) + 1]) + block for block in blocks)


def unstuffed(frame: bytes) -> bytes:
    packet = bytearray()
    while frame:
        code = frame[0]
        packet += frame[1:code] + (b"\0" if code < 255 else b"")
        frame = frame[code:]
    return bytes(packet[:-1])


def crc(data: bytes) -> bytes:
    return struct.pack("<H", binascii.crc_hqx(data, 0xFFFF))


class Requests:
    """Everything that is sent."""

    def __init__(self) -> None:
        self.line = b""
        self.answers = 1  # identity at power-up
        self._sequence = 0xFFF0

    def ask(self, kind: int, body: bytes = b"") -> bytes:
        self._sequence = (self._sequence + 1) % 0x10000
        packet = struct.pack("<BH", kind, self._sequence) + body
        return self.send(packet + crc(packet))

    def send(self, packet: bytes, answered: bool = True) -> bytes:
        self.line += stuffed(packet) + b"\0"
        self.answers += answered
        return packet


def configuration(policy: int, flags: int) -> bytes:
    n = 7 if flags & OFFSET else 6
    body = struct.pack("<5B4f", policy, 3, 3, 1, flags, 5.0, 0.25, 0.5, -0.01)
    body += struct.pack("<8f", 0.99, 0.98, 0.9, 60, 0.8, 0, 2, 1.5)
    body += struct.pack("<2f", -1, 1e6)
    body += struct.pack("<4fif", 5, 60, 8, 1.5, 20, 1e-5)
    body += struct.pack("<2fi2f", 0.05, 0.1, 20, 1e6, 1e4)
    body += struct.pack("<8fI", 0.01, 40, 2, 6, 2, 10, 200, 0.05, 60_000)
    if flags & SEED:
        theta = [-2.2, 1.7, -0.5, 4e-4, -6e-4, 3e-4, 0.0][:n]
        upper = [0.01 * i for i in range(n * (n - 1) // 2)]
        body += struct.pack(f"<{2 * n + len(upper) + 1}f", *theta, *[100.0] * n, *upper, 1e-8)
    return body


def servo_configuration() -> bytes:
    body = struct.pack("<2B2f", 2, POSITION_CONTROL | FOLLOW, 0.05, 0.3)
    return body + struct.pack("<8fI", 0.01, 40, 2, 6, 2, 10, 200, 0.05, 60_000)


def servo_run(requests: Requests, chance: random.Random) -> None:
    """A ServoEstimator until it trusts K, and behind a hole, a glitch and a hold."""
    requests.ask(0x01, struct.pack("<H", 3))
    requests.ask(0x07, servo_configuration()[:-1])  # too short
    requests.ask(0x07, servo_configuration())
    requests.ask(0x03, struct.pack("<I", 2000))
    position = velocity = acceleration = 0.0
    reference = 0.1
    for k in range(SERVO_SAMPLES):
        if k % 40 == 0 and not 800 <= k < 1000:
            reference = chance.choice((0.1, -0.1, 0.05))
        # The target's command is not known here: this is of a controller like it.
        command = max(-6.0, min(6.0, 40 * (reference - position)))
        measured = {700: math.nan, 720: 1e30}.get(k, position + chance.uniform(-1e-5, 1e-5))
        number = 2000 + k + 3 * (k >= 1100)  # three cycles are lost
        requests.ask(0x04, struct.pack("<I4f", number, measured, reference, 0.0, 0.0))
        for _ in range(10):
            acceleration += 1e-3 * (625 * (0.05 * command - velocity) - 20 * acceleration)
            velocity += 1e-3 * acceleration
            position += 1e-3 * velocity
    requests.ask(0x06)


def session() -> Requests:
    """Every policy in both sizes; what is refused, asked again, damaged; numbers out of range."""
    chance = random.Random(1)
    requests = Requests()
    requests.ask(0x04, bytes(20))  # not in this state
    for policy in range(POLICIES):
        for flags in (POSITION_CONTROL | FOLLOW | RESET, OFFSET | SEED | FOLLOW | POSITION_CONTROL):
            requests.ask(0x01, struct.pack("<H", 3))
            requests.ask(0x02, configuration(9, flags))  # no such policy
            requests.ask(0x02, configuration(policy, flags))
            requests.ask(0x03, struct.pack("<I", 1000))
            y, u = [0.0] * 3, [0.0] * 3
            for k in range(SAMPLES):
                # The target's command is not known here: these are of a controller like it.
                reference = 0.1 if chance.random() < 0.5 else -0.1
                u = [max(-6.0, min(6.0, 40 * (reference - y[0]))), *u[:2]]
                measured = {40: math.nan, 60: 1e30, 61: math.inf, 62: 1e-42}.get(k, y[0])
                values = (measured, reference, 0.0, math.nan if k == 80 else 0.0)
                number = 1000 + k + 7 * (k >= 100)  # seven cycles are lost
                asked = requests.ask(0x04, struct.pack("<I4f", number, *values))
                if k % 7 == 0:
                    requests.send(asked)
                    requests.send(asked[:9] + bytes([asked[9] ^ 4]) + asked[10:], answered=False)
                a_y = 2.239 * y[0] - 1.782 * y[1] + 0.543 * y[2]
                y = [a_y + 385e-6 * u[0] - 581e-6 * u[1] + 295e-6 * u[2], *y[:2]]
            requests.ask(0x04, bytes(20))  # out of order
            requests.ask(0x06)
            requests.ask(0x7F)  # no such request
    servo_run(requests, chance)
    return requests


def play(command: list[str], requests: Requests) -> list[bytes]:
    """The packets that the program answers with; it is ended as soon as there are enough."""
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0)
    assert process.stdin is not None
    assert process.stdout is not None
    guard = threading.Timer(TIMEOUT_S, process.kill)
    guard.start()
    # Written beside the reading: both pipes are smaller than the session.
    writer = threading.Thread(target=process.stdin.write, args=(requests.line,))
    writer.start()
    received = b""
    while len(frames := [f for f in received.split(b"\0")[:-1] if f]) < requests.answers:
        chunk = process.stdout.read(65536)
        if not chunk:
            break
        received += chunk
    guard.cancel()
    process.kill()
    process.wait()
    writer.join()
    packets = [unstuffed(frame) for frame in frames]
    for packet in packets:
        assert packet[-2:] == crc(packet[:-2]), f"{command[0]}: damaged: {packet.hex()}"
    return packets


def comparable(packet: bytes) -> bytes:
    """Without CRC, and without what is the machine's own."""
    body = bytearray(packet[:-2])
    if body[0] in STEP_CYCLES:
        body[STEP_CYCLES[body[0]]] = bytes(4)
    if body[0] == 0x81:
        body[-12:] = bytes(12)
    return bytes(body)


def main() -> int:
    host, qemu, machine, image = sys.argv[1:]
    requests = session()
    board = [qemu, "-machine", machine, "-display", "none", "-monitor", "none"]
    target = play([*board, "-serial", "stdio", "-kernel", image], requests)
    expected = play([host], requests)
    if not len(target) == len(expected) == requests.answers:
        wanted = f"{requests.answers} answers wanted"
        print(f"FAILED {wanted}, {len(target)} on {machine}, {len(expected)} on the host")
        return 1
    for i, (made, right) in enumerate(zip(target, expected, strict=True)):
        if comparable(made) != comparable(right):
            print(f"FAILED answer {i}\n{machine}: {made.hex()}\nhost: {right.hex()}")
            return 1
    kinds = [packet[0] for packet in target]
    followed = sum(packet[0] == 0x84 and packet[3 + 17] & 2 for packet in target)
    results = kinds.count(0x84)
    runs = 2 * POLICIES
    # Else the session has shown little.
    if results < runs * SAMPLES or kinds.count(0x85) != 2 + runs * 3 or not followed:
        print(f"FAILED {results} results, {kinds.count(0x85)} refusals, {followed} gains followed")
        return 1
    observed = [packet for packet in target if packet[0] == 0x87]
    trusted = sum(packet[3 + 22] == 0 for packet in observed)
    if len(observed) != SERVO_SAMPLES or not 0 < trusted < SERVO_SAMPLES:
        print(f"FAILED {len(observed)} results of the servo, K trusted in {trusted}")
        return 1
    if target[0][-14:-2].rstrip(b"\0") != machine.encode():
        print(f"FAILED {machine} calls itself {target[0][-14:-2]!r}")
        return 1
    print(f"PASS {len(target)} answers of {machine}, as on the host")
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Bad frames to the host, and bad frames to the firmware.

tests/servo/bad_frames.cpp sends the latter; a test of ctest compares the answers.
"""

from __future__ import annotations

import struct
from collections.abc import Callable

from bad_input.case import Case, Outcome
from bad_input.tables import cases_of
from sources import ROOT

from ehsid.harness.firmware import EstimatorConfiguration, ServoSettings
from ehsid.harness.models.identification import ArxOrders
from ehsid.hil import frames
from ehsid.hil.answers import parse_answer
from ehsid.hil.configuration import Configuration, ControllerSettings
from ehsid.hil.frames import BadFrame, HilError, Packet, decode, encode
from ehsid.hil.session import Session

TITLE = "Frames on the serial line"
ABOUT = (
    "A damaged frame is dropped and counted, and the request is sent again, because no line is "
    "perfect. A run ends only if no answer comes in time, or if the target gives a wrong answer "
    "that it would give again. The first rows are frames that the host receives. Then follow "
    "targets that misbehave, and frames that the firmware of `examples/firmware/servo` receives."
)
IDENTITY = struct.pack("<H3BBH", 3, 1, 2, 3, 0b1001, 1 << 6) + b"board".ljust(12, b"\0")
RESULT = struct.pack("<I3fBBH", 0, 0.0, 20.0, 0.05, 0, 0, 0) + struct.pack("<5f", 0, 1, 99, 1, 0)
RESULT += struct.pack("<I3H", 0, 0, 0, 0) + struct.pack("<B2f", 2, 0.5, 0.5)
# A ServoEstimator that knows K, omega_n and xi.
SERVO_RESULT = struct.pack("<I2f2B", 0, 0.0, 20.0, 0, 0)
SERVO_RESULT += struct.pack("<2fB", 0.05, 0.01, 0) * 3 + struct.pack("<I3H", 0, 0, 0, 0)


def call(wrong: str, shown: str, kind: type[Exception], run: Callable[[], object]) -> Case:
    """A call that must raise an exception of this kind."""

    def outcome() -> Outcome:
        try:
            run()
        except kind as error:
            return Outcome(type(error).__name__, str(error))
        return Outcome("nothing", "")

    return Case(wrong, shown, outcome, kind.__name__, {})


def frame(wrong: str, content: bytes) -> Case:
    """Bytes between two zeros, which the host takes for a frame."""
    shown = (
        content.hex(" ")
        if len(content) < 20
        else f"{content[:4].hex(' ')} ... ({len(content)} bytes)"
    )
    return call(wrong, shown, BadFrame, lambda: decode(content))


def answer(
    wrong: str, shown: str, kind: int, body: bytes, error: type[Exception] = BadFrame
) -> Case:
    """A packet with a right check sum, which the host takes for an answer."""
    return call(wrong, shown, error, lambda: parse_answer(Packet(kind, 1, body)))


class Scripted:
    """A line whose other end answers each request with these packets: kind and body, or bytes."""

    name = "/dev/ttyACM0"

    def __init__(self, *answers: tuple[int, bytes] | bytes) -> None:
        self._answers = answers
        self._waiting: list[bytes] = []

    def send(self, data: bytes) -> None:
        sequence = decode(data.strip(b"\0")).sequence
        self._waiting = [
            one if isinstance(one, bytes) else encode(one[0], sequence, one[1]).strip(b"\0")
            for one in self._answers
        ]

    def receive(self, timeout_s: float) -> bytes | None:
        return self._waiting.pop(0) if self._waiting else None


def target(wrong: str, shown: str, *answers: tuple[int, bytes] | bytes) -> Case:
    """A target that answers `hello` in this way."""

    def run() -> None:
        line = Scripted(*answers)
        Session(line, timeout_s=2.5, attempts=2).hello()  # type: ignore[arg-type]

    return call(wrong, shown, HilError, run)


def servo(wrong: str, *answers: tuple[int, bytes] | bytes) -> Case:
    """A target that answers the configuration of a ServoEstimator in this way."""

    def run() -> None:
        controller = ControllerSettings(0.01, 50.0, 20.0, 10.0, 30.0, 10.0, 90.0, 0.02)
        estimator = EstimatorConfiguration(ArxOrders(3, 3))
        made = Configuration(estimator, controller, 200, ServoSettings(0.01))
        Session(Scripted(*answers)).configure(made)  # type: ignore[arg-type]

    return call(wrong, "configure(servo)", HilError, run)


def refusal(reason: int, state: int = 1, status: int = 0) -> tuple[int, bytes]:
    return 0x85, struct.pack("<3BI", reason, state, status, 5)


GOOD = encode(0x81, 1, IDENTITY).strip(b"\0")
CASES = (
    frame("nothing between two zeros", b""),
    frame("one byte", b"\x01"),
    frame("a block that ends too early", b"\x05ab"),
    frame("a zero inside", b"\x03a\0"),
    frame("a frame longer than any", b"\x55" * 600),
    frame("a packet longer than any", frames.cobs_encode(bytes(513))),
    frame("a bit flipped on the way", bytes([GOOD[0], GOOD[1] ^ 4]) + GOOD[2:]),
    frame("text of a boot loader", b"U-Boot 2024.01"),
    answer("an answer of no kind", "kind 0x77", 0x77, b""),
    answer("a request for an answer", "kind 0x01", 0x01, b"\1\0"),
    answer("an identity cut short", "identity of 10 bytes", 0x81, IDENTITY[:10]),
    answer("an identity that is too long", "identity of 25 bytes", 0x81, IDENTITY + b"12345"),
    answer(
        "an older protocol", "identity of version 0", 0x81, b"\0\0" + IDENTITY[2:], error=HilError
    ),
    answer(
        "a newer protocol", "identity of version 9", 0x81, b"\x09\0" + IDENTITY[2:], error=HilError
    ),
    answer("a result cut short", "result of 20 bytes", 0x84, RESULT[:20]),
    answer("fewer parameters than announced", "result with 1 of 2", 0x84, RESULT[:-4]),
    answer(
        "an estimate that is not a number",
        "result with theta[1] = NaN",
        0x84,
        RESULT[:-4] + struct.pack("<f", float("nan")),
        error=HilError,
    ),
    answer(
        "an infinite command",
        "result with command_v = inf",
        0x84,
        RESULT[:4] + struct.pack("<f", float("inf")) + RESULT[8:],
        error=HilError,
    ),
    answer(
        "a status that does not exist",
        "result with status = 77",
        0x84,
        RESULT[:16] + b"\x4d" + RESULT[17:],
        error=HilError,
    ),
    answer("a result of a servo cut short", "servo_result", 0x87, SERVO_RESULT[:20]),
    answer(
        "an interval that is not a number",
        "servo_result with omega_n_half_width = NaN",
        0x87,
        SERVO_RESULT[:27] + struct.pack("<f", float("nan")) + SERVO_RESULT[31:],
        error=HilError,
    ),
    answer(
        "a reason for no trust that does not exist",
        "servo_result with velocity_gain_reason = 99",
        0x87,
        SERVO_RESULT[:22] + b"\x63" + SERVO_RESULT[23:],
        error=HilError,
    ),
    answer("a state that does not exist", "done with state 9", 0x82, b"\x09"),
    answer("a reason that does not exist", "refused with reason 200", *refusal(200)),
    target("a target that says nothing", "hello()"),
    target("a target that sends rubbish", "hello()", b"\x05ab"),
    target("a flood of bad frames", "hello()", *([b"\x05ab"] * 50)),
    target("a refusal of an unknown request", "hello()", refusal(3)),
    target("a refusal in the wrong state", "hello()", refusal(1, 2)),
    target("a refusal of the settings", "hello()", refusal(4, 0, 8)),
    servo("a target that does not know ServoEstimator", refusal(3)),
    *cases_of(
        ROOT / "tests" / "servo" / "bad_frames.txt",
        lambda text: Outcome("answer of the firmware", text),
    ),
)

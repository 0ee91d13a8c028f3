# SPDX-License-Identifier: MIT
"""Converts packets to frames with a check sum and without zero bytes, see docs/hil_protocol.md.

Errors of the serial line and of the target.

Consistent overhead byte stuffing: no zero byte inside a frame, so that a zero ends it.

S. Cheshire, M. Baker, "Consistent overhead byte stuffing", IEEE/ACM Transactions on Networking
7(2), 1999. A frame is a row of blocks. A block begins with its code c, 1 to 255, and c - 1 bytes
that are not zero follow. A block stands for these bytes and one zero behind them, except that no
zero follows a block whose code is 255, nor the last block.

Layout of a message on the line: fields one behind the other, little-endian, without padding.
"""

from __future__ import annotations

import binascii
import functools
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Any, Literal


class HilError(ValueError):
    """The run cannot continue; the message says what was observed and how to correct it."""


class TargetReset(HilError):  # noqa: N818 -- an event, which a run gets over
    """The target was reset during a run; `hello`, `configure` and `start` bring it back."""


class BadFrame(ValueError):  # noqa: N818 -- usual on a line: dropped, counted, asked again
    """The received bytes are not a valid packet; the message says why."""


_FULL = 255
_LONGEST = _FULL - 1  # bytes that a block can hold behind its code


def cobs_encode(packet: bytes) -> bytes:
    """Encode a packet of any length.

    Returns
    -------
    bytes
        The frame, without a zero byte. It is at least 1 and at most 1 + len(packet) // 254 bytes
        longer than the packet.
    """
    frame = bytearray()
    parts = packet.split(b"\0")
    for place, part in enumerate(parts):
        last = place == len(parts) - 1
        while len(part) > _LONGEST or (len(part) == _LONGEST and not last):
            frame += bytes([_FULL]) + part[:_LONGEST]
            part = part[_LONGEST:]
        frame += bytes([len(part) + 1]) + part
    return bytes(frame)


def cobs_decode(frame: bytes) -> bytes:
    """Decode a frame, given without the zeros that separate frames.

    Raises
    ------
    BadFrame
        The frame has a zero byte inside, or ends inside a block.
    """
    if b"\0" in frame:
        raise BadFrame("not COBS: there is a zero byte inside the frame")
    packet = bytearray()
    start = 0
    while start < len(frame):
        code = frame[start]
        end = start + code
        if end > len(frame):
            raise BadFrame(
                f"not COBS: the block at byte {start} needs {code} bytes, "
                f"and the frame has {len(frame) - start} left"
            )
        packet += frame[start + 1 : end]
        if code != _FULL and end < len(frame):
            packet.append(0)
        start = end
    return bytes(packet)


MAX_PACKET = 512
MAX_FRAME = MAX_PACKET + -(-MAX_PACKET // 254)  # COBS: one byte more for each 254 begun
_HEAD = struct.Struct("<BH")
_CRC = struct.Struct("<H")
MAX_BODY = MAX_PACKET - _HEAD.size - _CRC.size


@dataclass(frozen=True)
class Packet:
    """Content of a frame."""

    kind: int
    """Kind of the packet, 0 to 255, see `ehsid.hil.Kind`."""
    sequence: int
    """Sequence number, 0 to 65535; an answer has the number of its request, an unrequested packet
    has 0."""
    body: bytes
    """At most 507 bytes."""


def check_sum(data: bytes) -> int:
    """Returns the CRC-16/IBM-3740 of data: polynomial 0x1021, start 0xFFFF, not reflected."""
    return binascii.crc_hqx(data, 0xFFFF)


def encode(kind: int, sequence: int, body: bytes) -> bytes:
    """Returns the bytes to send for a packet: a zero, the frame, a zero.

    The first zero ends an incomplete frame that may be on the line.

    Raises
    ------
    ValueError
        the body is too long for a packet.
    """
    if len(body) > MAX_BODY:
        raise ValueError(f"a body of {len(body)} bytes; a packet takes at most {MAX_BODY}")
    packet = _HEAD.pack(kind, sequence) + body
    return b"\0" + cobs_encode(packet + _CRC.pack(check_sum(packet))) + b"\0"


def decode(frame: bytes) -> Packet:
    """Returns the packet of a frame that is given without the zeros around it.

    Raises
    ------
    BadFrame
        the frame is not valid COBS, is too long or too short, or has a wrong check sum.
    """
    if len(frame) > MAX_FRAME:
        raise BadFrame(f"longer than {MAX_FRAME} bytes")
    data = cobs_decode(frame)
    if len(data) > MAX_PACKET:  # possible for a frame of the largest size whose codes imply zeros
        raise BadFrame(f"a packet of {len(data)} bytes; at most {MAX_PACKET}")
    if len(data) < _HEAD.size + _CRC.size:
        raise BadFrame(f"a packet of {len(data)} bytes; at least {_HEAD.size + _CRC.size}")
    packet, (claimed,) = data[: -_CRC.size], _CRC.unpack(data[-_CRC.size :])
    if check_sum(packet) != claimed:
        raise BadFrame(f"check sum 0x{check_sum(packet):04X}, the frame says 0x{claimed:04X}")
    kind, sequence = _HEAD.unpack_from(packet)
    return Packet(kind, sequence, packet[_HEAD.size :])


Values = type[IntEnum] | type[IntFlag]
Type = Literal["u8", "u16", "u32", "i32", "f32", "ascii"]
_CODES = {"u8": "B", "u16": "H", "u32": "I", "i32": "i", "f32": "f", "ascii": "s"}
_RANGES = {
    "u8": (0, 2**8 - 1),
    "u16": (0, 2**16 - 1),
    "u32": (0, 2**32 - 1),
    "i32": (-(2**31), 2**31 - 1),
}


@dataclass(frozen=True)
class Field:
    """A field of a message."""

    name: str
    type: Type
    unit: str = ""
    meaning: str = ""
    """As the tables in docs/hil_protocol.md have them; the unit is "" for a number without one."""
    count: int | str = 1
    """Number of numbers or letters: a number, or text where it depends on other fields. Such fields
    stand at the end of a message."""
    group: str = ""
    """Of `configure`: the settings that the field belongs to."""
    values: Values | None = None
    """The values or flags that the field can have; None where it is a plain number."""


@dataclass(frozen=True)
class Message:
    """A message: its kind, the first byte of its packet, and the fields of its body."""

    kind: int
    fields: tuple[Field, ...] = ()
    states: str = ""
    """Of a request: the states in which the target carries it out."""

    @functools.cached_property
    def fixed(self) -> tuple[Field, ...]:
        """The fields that every message of this kind has."""
        return tuple(field for field in self.fields if isinstance(field.count, int))

    @functools.cached_property
    def layout(self) -> struct.Struct:
        """Layout of the fixed fields."""
        codes = (
            f"{field.count if field.type == 'ascii' else ''}{_CODES[field.type]}"
            for field in self.fixed
        )
        return struct.Struct("<" + "".join(codes))

    def pack(self, values: Mapping[str, Any], *, finite: bool = True) -> bytes:
        """Returns the bytes of the fixed fields; real numbers are rounded once to float32.

        Raises
        ------
        ValueError
            a number is outside the range of its type, or is not finite although `finite` is true.
        """
        for field in self.fixed:
            check(field.name, values[field.name], field.type, finite=finite)
        return self.layout.pack(*(values[field.name] for field in self.fixed))

    def unpack(self, body: bytes) -> tuple[dict[str, Any], bytes]:
        """Returns the values of the fixed fields by name, and the bytes behind them.

        Raises
        ------
        BadFrame
            the body is shorter than the fixed fields, or longer although there are no others, or a
            field has none of its values.
        """
        size = self.layout.size
        if len(body) < size or (len(body) > size and len(self.fixed) == len(self.fields)):
            raise BadFrame(f"a body of {len(body)} bytes where {size} belong")
        values: dict[str, Any] = {}
        for field, value in zip(self.fixed, self.layout.unpack(body[:size]), strict=True):
            try:
                values[field.name] = value if field.values is None else field.values(value)
            except ValueError:
                raise BadFrame(f"{field.name} {value}, which there is not") from None
        return values, body[size:]


def check(name: str, value: float, type_: Type, *, finite: bool = True) -> None:
    """Checks that the line can carry a number; the message of the error has its name.

    Raises
    ------
    ValueError
        the number is outside the range of its type, or is not finite although `finite` is true.
    """
    if type_ != "f32":
        least, most = _RANGES[type_]
        if not least <= value <= most:
            raise ValueError(f"{name} = {value}: expected a whole number from {least} to {most}")
        return
    if finite and not math.isfinite(value):
        raise ValueError(f"{name} = {value}: expected a finite number")
    try:
        struct.pack("<f", value)
    except OverflowError as error:
        raise ValueError(f"{name} = {value}: beyond float32 (3.4e38)") from error

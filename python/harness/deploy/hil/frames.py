# SPDX-License-Identifier: MIT
"""Packets as frames: a check sum, and no zero inside, see docs/hil_protocol.md."""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass

from ehsid.harness.deploy.hil import cobs
from ehsid.harness.deploy.hil.errors import BadFrame

MAX_PACKET = 512
MAX_FRAME = MAX_PACKET + -(-MAX_PACKET // 254)  # COBS: one byte more for each 254 begun
_HEAD = struct.Struct("<BH")
_CRC = struct.Struct("<H")
MAX_BODY = MAX_PACKET - _HEAD.size - _CRC.size


@dataclass(frozen=True)
class Packet:
    """What a frame carries.

    Attributes
    ----------
    kind
        0 to 255, see `ehsid.harness.deploy.hil.Kind`.
    sequence
        0 to 65535; an answer has that of its request, 0 what comes unasked.
    body
        at most 507 bytes.
    """

    kind: int
    sequence: int
    body: bytes


def check_sum(data: bytes) -> int:
    """CRC-16/IBM-3740: polynomial 0x1021, start 0xFFFF, not reflected."""
    return binascii.crc_hqx(data, 0xFFFF)


def encode(kind: int, sequence: int, body: bytes) -> bytes:
    """The bytes for the line: a zero, which ends what stood there before, the frame, a zero.

    Raises
    ------
    ValueError
        the body is longer than a packet takes.
    """
    if len(body) > MAX_BODY:
        raise ValueError(f"a body of {len(body)} bytes; a packet takes at most {MAX_BODY}")
    packet = _HEAD.pack(kind, sequence) + body
    return b"\0" + cobs.encode(packet + _CRC.pack(check_sum(packet))) + b"\0"


def decode(frame: bytes) -> Packet:
    """The packet of a frame, given without the zeros round it.

    Raises
    ------
    BadFrame
        not COBS, too long, too short, or another check sum.
    """
    if len(frame) > MAX_FRAME:
        raise BadFrame(f"longer than {MAX_FRAME} bytes")
    data = cobs.decode(frame)
    if len(data) > MAX_PACKET:  # a frame of the largest size whose codes stand for zeros
        raise BadFrame(f"a packet of {len(data)} bytes; at most {MAX_PACKET}")
    if len(data) < _HEAD.size + _CRC.size:
        raise BadFrame(f"a packet of {len(data)} bytes; at least {_HEAD.size + _CRC.size}")
    packet, (claimed,) = data[: -_CRC.size], _CRC.unpack(data[-_CRC.size :])
    if check_sum(packet) != claimed:
        raise BadFrame(f"check sum 0x{check_sum(packet):04X}, the frame says 0x{claimed:04X}")
    kind, sequence = _HEAD.unpack_from(packet)
    return Packet(kind, sequence, packet[_HEAD.size :])

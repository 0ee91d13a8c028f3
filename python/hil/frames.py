# SPDX-License-Identifier: MIT
"""Converts packets to frames with a check sum and without zero bytes, see docs/hil_protocol.md."""

from __future__ import annotations

import binascii
import struct
from dataclasses import dataclass

from . import cobs
from .errors import BadFrame

MAX_PACKET = 512
MAX_FRAME = MAX_PACKET + -(-MAX_PACKET // 254)  # COBS: one byte more for each 254 begun
_HEAD = struct.Struct("<BH")
_CRC = struct.Struct("<H")
MAX_BODY = MAX_PACKET - _HEAD.size - _CRC.size


@dataclass(frozen=True)
class Packet:
    """Content of a frame.

    Attributes
    ----------
    kind
        kind of the packet, 0 to 255, see `ehsid.hil.Kind`.
    sequence
        sequence number, 0 to 65535; an answer has the number of its request, an unrequested packet
        has 0.
    body
        at most 507 bytes.
    """

    kind: int
    sequence: int
    body: bytes


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
    return b"\0" + cobs.encode(packet + _CRC.pack(check_sum(packet))) + b"\0"


def decode(frame: bytes) -> Packet:
    """Returns the packet of a frame that is given without the zeros around it.

    Raises
    ------
    BadFrame
        the frame is not valid COBS, is too long or too short, or has a wrong check sum.
    """
    if len(frame) > MAX_FRAME:
        raise BadFrame(f"longer than {MAX_FRAME} bytes")
    data = cobs.decode(frame)
    if len(data) > MAX_PACKET:  # possible for a frame of the largest size whose codes imply zeros
        raise BadFrame(f"a packet of {len(data)} bytes; at most {MAX_PACKET}")
    if len(data) < _HEAD.size + _CRC.size:
        raise BadFrame(f"a packet of {len(data)} bytes; at least {_HEAD.size + _CRC.size}")
    packet, (claimed,) = data[: -_CRC.size], _CRC.unpack(data[-_CRC.size :])
    if check_sum(packet) != claimed:
        raise BadFrame(f"check sum 0x{check_sum(packet):04X}, the frame says 0x{claimed:04X}")
    kind, sequence = _HEAD.unpack_from(packet)
    return Packet(kind, sequence, packet[_HEAD.size :])

# SPDX-License-Identifier: MIT
"""Consistent overhead byte stuffing: no zero byte inside a frame, so that a zero ends it.

S. Cheshire, M. Baker, "Consistent overhead byte stuffing", IEEE/ACM Transactions on Networking
7(2), 1999. A frame is a row of blocks. A block begins with its code c, 1 to 255, and c - 1 bytes
that are not zero follow. A block stands for these bytes and one zero behind them, except that no
zero follows a block whose code is 255, nor the last block.
"""

from __future__ import annotations

from .errors import BadFrame

_FULL = 255
_LONGEST = _FULL - 1  # bytes that a block can hold behind its code


def encode(packet: bytes) -> bytes:
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


def decode(frame: bytes) -> bytes:
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

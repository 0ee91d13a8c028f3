# SPDX-License-Identifier: MIT
"""Frames of the line: what others publish of COBS and the CRC, and that damage is found."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.hil import frames
from ehsid.hil.frames import MAX_BODY, MAX_FRAME, BadFrame, Packet, check_sum, decode, encode

kinds, sequences = st.integers(0, 255), st.integers(0, 65535)
bodies = st.binary(max_size=MAX_BODY)

# https://en.wikipedia.org/wiki/Consistent_Overhead_Byte_Stuffing, all of its examples.
EXAMPLES = [
    ("00", "01 01"),
    ("00 00", "01 01 01"),
    ("00 11 00", "01 02 11 01"),
    ("11 22 00 33", "03 11 22 02 33"),
    ("11 22 33 44", "05 11 22 33 44"),
    ("11 00 00 00", "02 11 01 01 01"),
    (bytes(range(1, 255)).hex(), "ff" + bytes(range(1, 255)).hex()),
    (bytes(range(255)).hex(), "01 ff" + bytes(range(1, 255)).hex()),
    (bytes(range(1, 256)).hex(), "ff" + bytes(range(1, 255)).hex() + "02 ff"),
    (bytes(range(2, 256)).hex() + "00", "ff" + bytes(range(2, 256)).hex() + "01 01"),
    (bytes(range(3, 256)).hex() + "00 01", "fe" + bytes(range(3, 256)).hex() + "02 01"),
]


def crc(data: bytes) -> int:
    """CRC-16/IBM-3740 bit by bit, from its definition."""
    register = 0xFFFF
    for byte in data:
        register ^= byte << 8
        for _ in range(8):
            register = (register << 1) ^ (0x1021 if register & 0x8000 else 0)
        register &= 0xFFFF
    return register


@pytest.mark.parametrize(("plain", "stuffed"), EXAMPLES)
def test_cobs_is_the_published_one(plain: str, stuffed: str) -> None:
    assert frames.cobs_encode(bytes.fromhex(plain)) == bytes.fromhex(stuffed)
    assert frames.cobs_decode(bytes.fromhex(stuffed)) == bytes.fromhex(plain)


# A run of 254 bytes that are not zero fills a block; lengths around it are the hard cases.
runs = st.lists(
    st.tuples(st.sampled_from([0, 1, 2, 253, 254, 255, 508, 509]), st.booleans()), max_size=6
)


@given(runs)
def test_cobs_comes_back_and_is_longer_by_one_byte_for_each_254(
    parts: list[tuple[int, bool]],
) -> None:
    packet = b"".join(b"\x07" * length + b"\0" * zero for length, zero in parts)
    frame = frames.cobs_encode(packet)
    assert 0 not in frame
    assert len(packet) < len(frame) <= len(packet) + len(packet) // 254 + 1
    assert frames.cobs_decode(frame) == packet


def test_check_value_of_the_crc() -> None:
    assert check_sum(b"123456789") == 0x29B1  # as every catalogue of CRCs gives it


@given(st.binary())
def test_crc_is_its_definition(data: bytes) -> None:
    assert check_sum(data) == crc(data)


def test_a_frame_by_hand() -> None:
    # hello, sequence 2, version 1: the packet, its CRC, and every zero replaced by a distance.
    packet = bytes.fromhex("01 0200 0100")
    low, high = crc(packet).to_bytes(2, "little")
    assert encode(1, 2, b"\1\0") == bytes([0, 3, 1, 2, 2, 1, 3, low, high, 0])


@given(kinds, sequences, bodies)
def test_frames_come_back(kind: int, sequence: int, body: bytes) -> None:
    frame = encode(kind, sequence, body)
    assert frame[0] == frame[-1] == 0
    assert 0 not in frame[1:-1]
    assert len(frame) - 2 <= MAX_FRAME
    assert decode(frame[1:-1]) == Packet(kind, sequence, body)


def test_a_body_that_is_too_long_is_refused() -> None:
    assert len(decode(encode(1, 1, b"\1" * 507)[1:-1]).body) == 507  # with 5 bytes round it 512
    with pytest.raises(ValueError, match=r"508 bytes; a packet takes at most 507"):
        encode(1, 1, b"\1" * 508)


@given(kinds, sequences, bodies, st.data())
def test_every_bit_that_is_flipped_in_a_packet_is_found(
    kind: int, sequence: int, body: bytes, data: st.DataObject
) -> None:
    packet = bytearray(frames.cobs_decode(encode(kind, sequence, body)[1:-1]))
    bit = data.draw(st.integers(0, 8 * len(packet) - 1))
    packet[bit // 8] ^= 1 << bit % 8
    with pytest.raises(BadFrame, match="check sum"):
        decode(frames.cobs_encode(bytes(packet)))


def test_every_bit_that_is_flipped_on_the_line_is_found() -> None:
    """One bit may move a zero and so damage more than the CRC is sure to find: fixed frames."""
    rng = random.Random(1)
    for size in (0, 1, 20, 79):
        frame = encode(0x84, rng.randrange(65536), rng.randbytes(size))[1:-1]
        for bit in range(8 * len(frame)):
            damaged = bytearray(frame)
            damaged[bit // 8] ^= 1 << bit % 8
            for part in filter(None, damaged.split(b"\0")):
                with pytest.raises(BadFrame):
                    decode(bytes(part))


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (b"", "0 bytes; at least 5"),
        (b"\x05abcd", "4 bytes; at least 5"),
        (b"\x20abc", "the block at byte 0 needs 32 bytes, and the frame has 4 left"),
        (b"\x02a\x03b", "the block at byte 2 needs 3 bytes, and the frame has 2 left"),
        (b"\x03a\0b", "not COBS: there is a zero byte inside"),
        (b"\x01" * 516, "longer than 515"),
        (b"\x01" * 515, "514 bytes; at most 512"),
    ],
)
def test_what_is_no_frame_says_why(frame: bytes, said: str) -> None:
    with pytest.raises(BadFrame, match=said):
        decode(frame)


@given(st.binary(max_size=600))
def test_noise_is_a_bad_frame_and_nothing_worse(noise: bytes) -> None:
    try:
        packet = decode(noise)
    except BadFrame:
        return
    # One in 65536 has the right sum by chance; it must then be what it says.
    assert encode(packet.kind, packet.sequence, packet.body)[1:-1] == noise

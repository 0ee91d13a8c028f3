# SPDX-License-Identifier: MIT
"""Layout of numbers on the line: little-endian, float32, no padding."""

from __future__ import annotations

import math
import struct
from enum import StrEnum


class Whole(StrEnum):
    """Integer types of the protocol, with their codes in `struct`."""

    U8 = "B"
    U16 = "H"
    U32 = "I"
    I32 = "i"


_RANGES = {
    Whole.U8: (0, 2**8 - 1),
    Whole.U16: (0, 2**16 - 1),
    Whole.U32: (0, 2**32 - 1),
    Whole.I32: (-(2**31), 2**31 - 1),
}


class Body:
    """Body of a request, to which numbers are appended; each has a name for error messages.

    >>> body = Body()
    >>> body.whole("number", 7, Whole.U32)
    >>> body.real("position_m", 0.01)
    >>> bytes(body).hex()
    '070000000ad7233c'
    """

    def __init__(self) -> None:
        self._bytes = bytearray()

    def whole(self, name: str, value: int, kind: Whole) -> None:
        """Appends a whole number.

        Raises
        ------
        ValueError
            the number is outside the range of `kind`.
        """
        least, most = _RANGES[kind]
        if not least <= value <= most:
            raise ValueError(f"{name} = {value}: expected a whole number from {least} to {most}")
        self._bytes += struct.pack(f"<{kind}", value)

    def real(self, name: str, value: float, *, finite: bool = True) -> None:
        """Appends a number, rounded once to float32.

        Raises
        ------
        ValueError
            the number is beyond float32, or is not finite although `finite` is true.
        """
        if finite and not math.isfinite(value):
            raise ValueError(f"{name} = {value}: expected a finite number")
        try:
            self._bytes += struct.pack("<f", value)
        except OverflowError as error:
            raise ValueError(f"{name} = {value}: beyond float32 (3.4e38)") from error

    def __bytes__(self) -> bytes:
        return bytes(self._bytes)

# SPDX-License-Identifier: MIT
"""Checks the elements of a MAT file of version 5 to 7 before scipy reads them.

The reader of scipy looks up data types by codes from the file without a check, so that a damaged
file can end the process. The layout is that of "MAT-File Format", The MathWorks, "Level 5".
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable

HEADER_BYTES = 128
# Number of bytes of a value by data type code: miINT8 to miUINT32, miSINGLE, miDOUBLE, miINT64,
# miUINT64, and text as UTF-8, UTF-16 and UTF-32.
WIDTH = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
MATRIX, COMPRESSED = 14, 15
UINT32, INT32 = 6, 5
# Classes from CHAR_CLASS to LAST_NUMERIC_CLASS hold only numbers or text. Cells, structures and
# objects hold arrays.
CHAR_CLASS, SPARSE_CLASS, LAST_NUMERIC_CLASS = 4, 5, 15
COMPLEX_FLAG = 0x800
MAX_DEPTH = 30
PIECE_BYTES = 2**20  # of decompressed data, between two looks at the limit
# What an element and a number take in the memory of this process, about.
ELEMENT_BYTES, VALUE_BYTES = 200, 8

Element = tuple[int, memoryview]


class DamagedError(ValueError):
    """The elements are not consistent; the message names the rule that they break."""


def check_elements(data: bytes, check_size: Callable[[int], None]) -> None:
    """Checks codes, sizes and check sums of a file of version 5 to 7; does not check other files.

    `check_size` is called with the number of bytes that the content takes in memory, as far as it
    is known; it raises an error where these are too many, before they are taken.

    Raises
    ------
    DamagedError
        a data type is unknown, an element ends after its container, dimensions do not agree with
        the data, or compressed data are damaged.
    """
    if len(data) < HEADER_BYTES or 0 in data[:4]:
        return  # a file of version 4, or not a MAT file
    if data[126:128] not in (b"IM", b"MI"):
        raise DamagedError("no mark of the byte order in its header")
    order = "<" if data[126:128] == b"IM" else ">"
    if struct.unpack_from(order + "H", data, 124)[0] >> 8 != 1:
        return  # version 7.3
    _Checker(order, check_size).check(memoryview(data)[HEADER_BYTES:])


class _Checker:
    """Checks the elements of one file and counts the memory that its content takes."""

    def __init__(self, order: str, check_size: Callable[[int], None]) -> None:
        self._order = order
        self._check_size = check_size
        self._size = 0

    def check(self, data: memoryview) -> None:
        for code, content in self._elements(data):
            if code == COMPRESSED:
                inner = self._elements(self._decompressed(content))
                if len(inner) != 1:
                    raise DamagedError(f"{len(inner)} variables in one compressed element")
                code, content = inner[0]
            if code != MATRIX:
                raise DamagedError(f"a variable of data type {code}")
            self._check_matrix(content, 1)

    def _add(self, size: int) -> None:
        self._size += size
        self._check_size(self._size)

    def _decompressed(self, content: memoryview) -> memoryview:
        pieces = []
        stream = zlib.decompressobj()
        rest: bytes | memoryview = content
        try:
            while not stream.eof:
                piece = stream.decompress(rest, PIECE_BYTES)
                rest = stream.unconsumed_tail
                if not piece and not stream.eof:
                    raise DamagedError("the data end while decompressing")
                self._add(len(piece))
                pieces.append(piece)
        except zlib.error as error:
            raise DamagedError(str(error)) from None
        return memoryview(b"".join(pieces))

    def _elements(self, data: memoryview) -> list[Element]:
        """Returns data type code and content of each element.

        Elements start at multiples of 8 bytes, but no padding follows compressed ones.
        """
        elements: list[Element] = []
        position = 0
        while position < len(data):
            if len(data) - position < 8:
                raise DamagedError("it ends within an element")
            code, size = struct.unpack_from(self._order + "II", data, position)
            start = position + 8
            if code > 0xFFFF:  # a small element: the tag itself holds up to four bytes of content
                code, size, start = code & 0xFFFF, code >> 16, position + 4
                if size > 4:
                    raise DamagedError(f"a small element of {size} bytes")
            if code not in WIDTH and code not in (MATRIX, COMPRESSED):
                raise DamagedError(f"unknown data type {code}")
            if start + size > len(data):
                raise DamagedError("an element is longer than what holds it")
            self._add(ELEMENT_BYTES)
            elements.append((code, data[start : start + size]))
            position = start + size
            if code != COMPRESSED:
                position += -position % 8
        return elements

    def _check_matrix(self, content: memoryview, depth: int) -> None:
        if not content:
            return  # an empty array in a cell or a structure
        if depth > MAX_DEPTH:
            raise DamagedError("arrays within arrays without end")
        parts = self._elements(content)
        if parts[0][0] != UINT32 or len(parts[0][1]) != 8:
            raise DamagedError("an array without flags")
        flags = struct.unpack(self._order + "II", parts[0][1])[0]
        array_class = flags & 0xFF
        if array_class > LAST_NUMERIC_CLASS:
            self._check_inner(parts, depth)  # functions and objects have another layout
            return
        if (
            len(parts) < 3
            or parts[1][0] not in (INT32, UINT32)
            or len(parts[1][1]) % 4
            or not parts[1][1]
        ):
            raise DamagedError("an array without dimensions and name")
        if parts[2][0] not in WIDTH:
            raise DamagedError("an array whose name is an array")
        dimensions = struct.unpack(f"{self._order}{len(parts[1][1]) // 4}i", parts[1][1])
        if min(dimensions) < 0:
            raise DamagedError("a negative dimension")
        if array_class >= CHAR_CLASS:
            expected_parts = (3 if array_class == SPARSE_CLASS else 1) + bool(flags & COMPLEX_FLAG)
            if len(parts) - 3 != expected_parts:
                raise DamagedError(
                    f"an array in {len(parts) - 3} parts instead of {expected_parts}"
                )
            self._check_numbers(parts[3:], array_class, math.prod(dimensions))
        else:
            self._check_inner(parts[3:], depth)

    def _check_numbers(self, parts: list[Element], array_class: int, expected: int) -> None:
        for code, content in parts:
            if code not in WIDTH:
                raise DamagedError("an array of numbers that holds arrays")
            # The size is not checked for text, which may have fewer bytes than letters, and for
            # sparse matrices, whose number of values does not follow from the dimensions.
            if array_class > SPARSE_CLASS and len(content) != expected * WIDTH[code]:
                raise DamagedError(f"{len(content)} bytes for {expected} numbers")
        if array_class != SPARSE_CLASS:
            self._add(expected * len(parts) * VALUE_BYTES)

    def _check_inner(self, parts: list[Element], depth: int) -> None:
        for code, content in parts:
            if code == MATRIX:
                self._check_matrix(content, depth + 1)

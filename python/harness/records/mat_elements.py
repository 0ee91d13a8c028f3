# SPDX-License-Identifier: MIT
"""The elements of a MAT file of version 5 to 7, checked before scipy reads them.

scipy's reader is not hardened: it looks up data types by codes that it takes from the file, and a
damaged file ends the process. The layout is that of "MAT-File Format", The MathWorks, "Level 5".
"""

from __future__ import annotations

import math
import struct
import zlib

HEADER_BYTES = 128
# Data type code -> bytes of a number: miINT8 to miUINT32, miSINGLE, miDOUBLE, miINT64, miUINT64,
# and text as UTF-8, 16, 32.
WIDTH = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
MATRIX, COMPRESSED = 14, 15
UINT32, INT32 = 6, 5
# Classes of arrays that hold numbers or text only; cells, structures and objects hold arrays.
CHAR_CLASS, SPARSE_CLASS, LAST_NUMERIC_CLASS = 4, 5, 15
COMPLEX_FLAG = 0x800
DEEPEST = 30

Element = tuple[int, bytes]


class DamagedError(ValueError):
    """The elements do not fit together; the message says what does not."""


def check_elements(data: bytes) -> None:
    """Check codes, sizes and check sums of a file of version 5 to 7; others are let pass.

    Raises
    ------
    DamagedError
        an unknown data type, an element that ends after its container, dimensions that do not
        agree with the data, or compressed data that are damaged.
    """
    if len(data) < HEADER_BYTES or 0 in data[:4]:
        return  # version 4, or none at all
    if data[126:128] not in (b"IM", b"MI"):
        raise DamagedError("no mark of the byte order in its header")
    order = "<" if data[126:128] == b"IM" else ">"
    if struct.unpack_from(order + "H", data, 124)[0] >> 8 != 1:
        return  # version 7.3
    for code, content in _elements(data[HEADER_BYTES:], order):
        if code == COMPRESSED:
            try:
                inner = _elements(zlib.decompress(content), order)
            except zlib.error as error:
                raise DamagedError(str(error)) from None
            if len(inner) != 1:
                raise DamagedError(f"{len(inner)} variables in one compressed element")
            code, content = inner[0]
        if code != MATRIX:
            raise DamagedError(f"a variable of data type {code}")
        _check_matrix(content, order, 1)


def _elements(data: bytes, order: str) -> list[Element]:
    """Data type codes and contents, one after the other; each starts at a multiple of 8 bytes."""
    found: list[Element] = []
    position = 0
    while position < len(data):
        if len(data) - position < 8:
            raise DamagedError("it ends within an element")
        code, size = struct.unpack_from(order + "II", data, position)
        start = position + 8
        if code > 0xFFFF:  # up to four bytes of content stand in the tag itself
            code, size, start = code & 0xFFFF, code >> 16, position + 4
            if size > 4:
                raise DamagedError(f"a small element of {size} bytes")
        if code not in WIDTH and code not in (MATRIX, COMPRESSED):
            raise DamagedError(f"unknown data type {code}")
        if start + size > len(data):
            raise DamagedError("an element is longer than what holds it")
        found.append((code, data[start : start + size]))
        position = start + size
        if code != COMPRESSED:
            position += -position % 8
    return found


def _check_matrix(content: bytes, order: str, depth: int) -> None:
    if not content:
        return  # an empty array within a cell or a structure
    if depth > DEEPEST:
        raise DamagedError("arrays within arrays without end")
    parts = _elements(content, order)
    if parts[0][0] != UINT32 or len(parts[0][1]) != 8:
        raise DamagedError("an array without flags")
    flags = struct.unpack(order + "II", parts[0][1])[0]
    array_class = flags & 0xFF
    if array_class > LAST_NUMERIC_CLASS:
        _check_inner(parts, order, depth)  # functions and objects: of another layout
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
    dimensions = struct.unpack(f"{order}{len(parts[1][1]) // 4}i", parts[1][1])
    if min(dimensions) < 0:
        raise DamagedError("a negative dimension")
    if array_class >= CHAR_CLASS:
        wanted = (3 if array_class == SPARSE_CLASS else 1) + bool(flags & COMPLEX_FLAG)
        if len(parts) - 3 != wanted:
            raise DamagedError(f"an array in {len(parts) - 3} parts instead of {wanted}")
        _check_numbers(parts[3:], array_class, math.prod(dimensions))
    else:
        _check_inner(parts[3:], order, depth)


def _check_numbers(parts: list[Element], array_class: int, expected: int) -> None:
    for code, content in parts:
        if code not in WIDTH:
            raise DamagedError("an array of numbers that holds arrays")
        # Text may have fewer bytes than letters, a sparse matrix tells its numbers otherwise.
        if array_class > SPARSE_CLASS and len(content) != expected * WIDTH[code]:
            raise DamagedError(f"{len(content)} bytes for {expected} numbers")


def _check_inner(parts: list[Element], order: str, depth: int) -> None:
    for code, content in parts:
        if code == MATRIX:
            _check_matrix(content, order, depth + 1)

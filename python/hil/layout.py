# SPDX-License-Identifier: MIT
"""Layout of a message on the line: fields one behind the other, little-endian, without padding."""

from __future__ import annotations

import functools
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import Any, Literal

from .errors import BadFrame

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
    """A field of a message.

    Attributes
    ----------
    name, type, unit, meaning
        as the tables in docs/hil_protocol.md have them; the unit is "" for a number without one.
    count
        number of numbers or letters: a number, or text where it depends on other fields. Such
        fields stand at the end of a message.
    group
        of `configure`: the settings that the field belongs to.
    values
        the values or flags that the field can have; None where it is a plain number.
    """

    name: str
    type: Type
    unit: str = ""
    meaning: str = ""
    count: int | str = 1
    group: str = ""
    values: Values | None = None


@dataclass(frozen=True)
class Message:
    """A message: its kind, the first byte of its packet, and the fields of its body.

    Attributes
    ----------
    states
        of a request: the states in which the target carries it out.
    """

    kind: int
    fields: tuple[Field, ...] = ()
    states: str = ""

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

# SPDX-License-Identifier: MIT
"""What the values in a log mean: numbers in any notation, and numbers for no value.

Numbers such as -9999 and 9.9E37 stand for no value, and are told apart from true extremes. A true
extreme is reached: a position at its end stop and a sensor at its limit have neighbours among the
other values. A number that stands for no value lies alone, far outside of all others. A command may
step to its full scale, and so may a signal that is no channel: of them only numbers are taken for
no value that no full scale has.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..base.numbers import FloatArray
from ..catalogue.channels import CHANNELS, COMMAND, TIME
from .errors import RecordError

CORRECT_CELL = "correct the cell, or name the columns to use"

EMPTY = frozenset({"", "-", "--", "---", "n/a", "na", "nan", "null", "none", "#n/a", "nil"})
_DIGITS_AND_MARKS = dict.fromkeys(map(ord, "0123456789.,+-eE\n"))

# A number with a prefix of the SI, a unit, or both behind it: "-5.7m", "3k", "12.5 mV".
WITH_PREFIX = re.compile(
    r"([+-]?(?:\d+[.,]?\d*|[.,]\d+))\s?(?=\S)([fpnuµμmkKMGT]|[Mm]eg)?(?:V|A|m|s|Hz|N|Pa|bar)?"
)
POWERS = {"f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "k": 3, "K": 3, "M": 6, "G": 9, "T": 12}


@dataclass(frozen=True)
class Marks:
    """How the numbers of a column are written."""

    decimal: str
    """"." or ","."""
    thousands: str | None = None
    """The mark between groups of three digits, or None."""
    doubtful: str | None = None
    """A number that can be read in two ways, or None."""

    def plain(self, text: str) -> str:
        """Returns numbers with a decimal point; with a mark of neither use they are none."""
        if self.thousands is not None:
            text = text.replace(self.thousands, "")
        # A point would pass for the decimal one.
        return text.replace(".", "?").replace(",", ".") if self.decimal == "," else text


class Cells:
    """The cells of a column of text, without blanks around them; "" is an empty one.

    They are kept in blocks with a cell on each line: single texts would take six times the memory.
    """

    def __init__(self) -> None:
        self._blocks: list[str] = []

    def append(self, cells: Sequence[str]) -> None:
        """Appends cells; words for an empty one become empty."""
        block = "\n".join(cells)
        if block.translate(_DIGITS_AND_MARKS) or "-\n" in f"{block}\n":
            stripped = map(str.strip, cells)
            block = "\n".join("" if cell.lower() in EMPTY else cell for cell in stripped)
        self._blocks.append(block)

    def __iter__(self) -> Iterator[str]:
        for block in self._blocks:
            yield from block.split("\n")

    def __len__(self) -> int:
        return sum(block.count("\n") + 1 for block in self._blocks)

    def numbers(self, marks: Marks) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
        """Returns the numbers, NaN where there is none, and where text is no number."""
        values, unread = zip(*(numbers_in(block, marks) for block in self._blocks), strict=True)
        return np.concatenate(values), np.concatenate(unread)


def marks_of(cells: Iterable[str], usual: str) -> Marks:
    """Returns the marks of a column in a file whose decimal mark is usually `usual`.

    "1.000" beside "999" or "1,5" is a thousand; where all cells are like "1.234", it may be both.
    """
    other = "." if usual == "," else ","
    text = [*filter(None, cells)]
    if marked := [cell for cell in text if other in cell]:
        rest = [cell for cell in text if other not in cell]
        if _all(marked, rf"[1-9]\d{{0,2}}(?:\{other}\d{{3}})+(?:\{usual}\d*)?"):
            sure = any(cell.count(other) > 1 or usual in cell for cell in marked)
            fewer = [cell for cell in rest if re.search(r"\d", cell)]
            if (sure or fewer) and _all(fewer, rf"\d{{1,3}}(?:\{usual}\d*)?"):
                return Marks(usual, other)
            return Marks(usual, doubtful=marked[0])
        if not any(usual in cell for cell in text) and _all(
            marked, rf"(?:\d+\{other}\d*|\{other}\d+)(?:[eEdD][+-]?\d+)?"
        ):
            return Marks(other)
        return Marks(usual)
    marked = [cell for cell in text if usual in cell]
    if marked and _all(marked, rf"[1-9]\d{{0,2}}(?:\{usual}\d{{3}})+"):
        rest = [cell for cell in text if usual not in cell]
        if _all(rest, r"\d{1,3}") and any(re.search(r"\d{3}", cell) for cell in rest):
            return Marks(other, usual)
    return Marks(usual)


def _all(cells: Iterable[str], pattern: str) -> bool:
    return all(map(re.compile(rf"[+-]?{pattern}", re.ASCII).fullmatch, cells))


def numbers_in(text: str, marks: Marks) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Returns the numbers in cells, one on a line, and where there is text that is no number.

    They are NaN where a cell is empty or no number.
    """
    cells = marks.plain(text).split("\n")
    numbers = plain_numbers(cells)
    if numbers is not None:
        return numbers, np.zeros(len(cells), np.bool_)
    each = [plain_numbers([re.sub(r"[dD]([+-]?[0-9]+)$", r"e\1", cell)]) for cell in cells]
    unread = np.array([one is None for one in each])
    return np.array([np.nan if one is None else one[0] for one in each]), unread


def plain_numbers(cells: Sequence[str]) -> FloatArray | None:
    """Returns the numbers in cells, NaN for an empty one; None where there is anything else."""
    text = "".join(cells)
    if text.isascii() and "_" not in text:  # Python also accepts 1_000 and Arabic digits
        with suppress(ValueError):
            return np.array([float(cell or "nan") for cell in cells])
    return None


def no_number(
    path: Path, row: int, column: str, cell: str, mend: str, decimal: str = "."
) -> RecordError:
    """Returns the error for a cell that is no number; `mend` is for one without a prefix."""
    return RecordError(
        path,
        f"the text '{shown(cell)}' is not a number",
        row=row,
        column=column,
        expected=f"a number such as 0{decimal}125 or 1.2e-3",
        mend=_plain_number_mend(cell) or mend,
    )


def shown(cell: str) -> str:
    """Returns a cell as messages have it: not longer than 40 letters."""
    text = cell.strip()
    return text if len(text) <= 40 else text[:37] + "..."


def _plain_number_mend(cell: str) -> str | None:
    """Returns the remedy for a cell such as "-5.7m"; None for any other text.

    The letter is not read: "M" is a million to most programs and a thousandth to LTspice, and "m"
    may be the unit.
    """
    match = WITH_PREFIX.fullmatch(cell.strip())
    if match is None:
        return None
    power = POWERS.get((match[2] or "").replace("µ", "u").replace("μ", "u")[:1])
    shown = f" (if '{match[2]}' is a prefix, {match[1]}e{power})" if power else ""
    return (
        f"export the column as plain numbers{shown}, and put a unit into the name of the column, "
        "such as 'Stroke [mm]'"
    )


# No quantity of a machine is so large; instruments say 9.9E37, and netCDF 9.96921e36.
NO_QUANTITY = 1e20
NINES = frozenset(sign * (10.0**digits - 1.0) for digits in range(3, 11) for sign in (1, -1))
# The ends of integers, and what netCDF puts beside them.
FULL = frozenset(
    float(number)
    for bits in (15, 16, 31, 32, 63, 64)
    for number in (2**bits - 1, -(2**bits), 1 - 2**bits)
)
# Distance to the nearest other value, in spans of all others: of a number that is known to stand
# for no value, of any other, and of any in a signal that may be switched.
FAR_KNOWN, FAR, FAR_SWITCHED = 1.0, 5.0, 100.0
# With fewer other values there is no telling what lies outside of them.
LEAST_VALUES = 20
# So many different values has a signal that is measured, and not switched between levels.
LEAST_DIFFERENT = 10
# A larger command is none in V, mV, mA or percent; it may be in counts.
LARGEST_COMMAND = 20_000.0
SWITCHED = (COMMAND, "spool")


@dataclass(frozen=True)
class Sentinels:
    """The numbers in the values of a signal that stand for no value, and the span of the others."""

    numbers: tuple[float, ...]
    lowest: float
    highest: float

    def without(self, values: FloatArray) -> FloatArray:
        """Returns the values with NaN in their place."""
        return np.where(np.isin(values, self.numbers), np.nan, values)

    def remark(self, name: str, values: FloatArray) -> str:
        """Returns a sentence on what is taken for no value."""
        rows = int(np.count_nonzero(np.isin(values, self.numbers)))
        numbers = " or ".join(f"{number:.9g}" for number in self.numbers)
        return (
            f"'{name}' is {numbers} in {rows} of {values.size} rows, far outside of its other "
            f"values ({self.lowest:.4g} to {self.highest:.4g}): taken as no value"
        )


def sentinels_of(values: FloatArray, channel: str) -> Sentinels | None:
    """Returns what in the values of a channel, shape (n,), stands for no value; None if nothing."""
    left = values[np.isfinite(values)]
    numbers: list[float] = []
    while left.size:
        # Both ends at once, as each would hide the other.
        ends = [float(left.min()), float(left.max())]
        huge = [end for end in ends if abs(end) >= NO_QUANTITY]
        others = left[~np.isin(left, huge or ends)]
        found = [end for end in huge or ends if _is_none(end, left, others, channel)]
        if not found:
            break
        numbers += found
        left = left[~np.isin(left, found)]
    if not numbers or not left.size:
        return None
    return Sentinels(tuple(numbers), float(left.min()), float(left.max()))


def has_sentinels(columns: Mapping[str, FloatArray]) -> bool:
    """Whether a column, named by its channel, has numbers that stand for no value."""
    return any(sentinels_of(one, name) for name, one in columns.items() if name != TIME)


def _is_none(number: float, left: FloatArray, others: FloatArray, channel: str) -> bool:
    if others.size < LEAST_VALUES:
        return False
    largest = float(np.max(np.abs(others)))
    distance, span = float(np.min(np.abs(others - number))), float(np.ptp(others))
    repeats = int(np.count_nonzero(left == number)) > 1
    if abs(number) >= NO_QUANTITY:
        return largest < NO_QUANTITY and (repeats or abs(number) < 1e40)
    nines = number in NINES
    if channel in SWITCHED or channel not in CHANNELS:
        # No full scale is -9999, but that of a pulse width may be 999.
        far = FAR if nines and number < -1000.0 else FAR_SWITCHED
        if distance <= far * span or not _differ(others, 2 if nines else LEAST_DIFFERENT):
            return False
        # A command in counts is whole, and may step to the end of its integer.
        counts = bool((others == np.round(others)).all())
        return nines or (
            repeats
            and not counts
            and abs(number) > LARGEST_COMMAND
            and abs(number) >= FAR * largest
        )
    if nines or number in FULL:
        return distance > FAR_KNOWN * span and distance > 0.0
    return (
        repeats
        and distance > FAR * span
        and abs(number) >= FAR * largest
        and _differ(others, LEAST_DIFFERENT)
    )


def _differ(values: FloatArray, count: int) -> bool:
    return bool(np.unique(values).size >= count)

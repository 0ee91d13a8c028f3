# SPDX-License-Identifier: MIT
"""Splits the bytes of a CSV file into header and body; reports the errors in the file."""

from __future__ import annotations

import csv
import gzip
import re
import zlib
from collections import Counter
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

from .errors import RecordError
from .limits import BYTES, COLUMNS, LINE, SAMPLES

GZIP_MAGIC = b"\x1f\x8b"
UTF8_BOM = b"\xef\xbb\xbf"
UTF16_BOMS = (b"\xff\xfe", b"\xfe\xff")
# A number with a prefix of the SI, a unit, or both behind it: "-5.7m", "3k", "12.5 mV".
WITH_PREFIX = re.compile(
    r"([+-]?(?:\d+[.,]?\d*|[.,]\d+))\s?(?=\S)([fpnuµμmkKMGT]|[Mm]eg)?(?:V|A|m|s|Hz|N|Pa|bar)?"
)
POWERS = {"f": -15, "p": -12, "n": -9, "u": -6, "m": -3, "k": 3, "K": 3, "M": 6, "G": 9, "T": 12}
# So many rows with the same number of decimals are taken for a fixed form of numbers.
ROWS_OF_ONE_FORM = 50
EXPECTED_CSV = "comma-separated UTF-8 text with column names in row 1 and a decimal point"


def decompress(data: bytes, path: Path) -> bytes:
    """Returns the decompressed content of a gzip file.

    Raises
    ------
    RecordError
        the data are empty, not gzip, cut short, or damaged, or their content is beyond the limit.
    """
    if not data:
        raise RecordError(path, "the file is empty", expected="a gzip file", mend="export it again")
    if not data.startswith(GZIP_MAGIC):
        raise RecordError(
            path,
            "the name ends in .gz but the content is not gzip",
            expected="a gzip file",
            mend="rename it to .csv if it is plain text, or compress it again",
        )
    try:
        # One byte more than allowed tells; what comes behind it is never decompressed.
        with gzip.GzipFile(fileobj=BytesIO(data)) as file:
            content = file.read(BYTES.most + 1)
        BYTES.check(len(content), path, at_least=True)
        return content
    except EOFError:
        problem = "the compressed file is cut short"
    except (gzip.BadGzipFile, zlib.error) as error:
        problem = f"the compressed file is damaged ({error})"
    raise RecordError(
        path, problem, expected="a whole gzip file", mend="copy or compress the file again"
    )


def split_header(data: bytes, path: Path) -> tuple[list[str], bytes]:
    """Returns the column names and the bytes below them, without blank lines at the end.

    Raises
    ------
    RecordError
        the file is empty, is not text or not UTF-8, has a wrong delimiter, no usable column names,
        no data rows, ends within a number, or is beyond a limit.
    """
    data = _clean_text(data, path)
    check_size(data, path)
    first_line, _, body = data.partition(b"\n")
    names = _names(first_line.decode("utf-8").rstrip("\r"), body, path)
    if not body.endswith((b"\n", b"\r")):
        _check_end(body, path, row=data.count(b"\n") + 1)
    body = body.rstrip(b"\r\n\t ")
    if not body:
        raise RecordError(
            path,
            "there is a header but no data",
            row=1,
            expected="data rows below the header",
            mend="export the record again, with its data",
        )
    return names, body


def _check_end(body: bytes, path: Path, *, row: int) -> None:
    """Checks that a last line without a line end does not stop within its last number.

    This shows only where the last column has a usual number of decimals in the rows before.
    """
    *before, last = (line.rpartition(b",")[2] for line in body.rsplit(b"\n", ROWS_OF_ONE_FORM + 1))
    above = [cell.decode() for cell in before[-ROWS_OF_ONE_FORM:]]
    if is_cut(above, last.decode(), "."):
        usual = len(above[-1].strip().partition(".")[2])
        raise RecordError(
            path,
            f"the file ends within the number '{last.decode().strip()}': the numbers above have "
            f"{usual} decimals",
            row=row,
            expected="a line end behind the last row",
            mend="copy or export the file again; if the number is whole, end the file with a line "
            "end",
        )


def is_cut(above: Sequence[str], last: str, decimal: str) -> bool:
    """Whether a number has too few decimals beside all of those above it to be whole.

    Numbers of as many digits as they need may end in a zero that is not written, but hardly in
    three.
    """
    counts = {len(cell.strip().partition(decimal)[2]) for cell in above}
    if len(above) < ROWS_OF_ONE_FORM:
        return False
    least = min(counts) - (2 if len(counts) > 1 else 0)
    return len(last.strip().partition(decimal)[2]) < least


def _clean_text(data: bytes, path: Path) -> bytes:
    if not data.strip():
        raise RecordError(path, "the file is empty", expected=EXPECTED_CSV, mend="export it again")
    if data.startswith(GZIP_MAGIC):
        raise RecordError(
            path,
            "the file is compressed with gzip but its name does not say so",
            expected=EXPECTED_CSV,
            mend="rename it to end in .csv.gz",
        )
    data = data.removeprefix(UTF8_BOM)
    if data.startswith(UTF16_BOMS):
        raise RecordError(
            path,
            "the text is UTF-16",
            expected=EXPECTED_CSV,
            mend="save it as 'CSV UTF-8' in the program that wrote it",
        )
    if b"\x00" in data:
        row = data.count(b"\n", 0, data.index(b"\x00")) + 1
        raise RecordError(
            path,
            "the file holds zero bytes: it is binary, or UTF-16 text",
            row=row,
            expected=EXPECTED_CSV,
            mend="export it as CSV in UTF-8, or give it the extension of its real format",
        )
    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")  # classic Macintosh line ends
    try:
        data.decode("utf-8")
    except UnicodeDecodeError as error:
        row = data.count(b"\n", 0, error.start) + 1
        raise RecordError(
            path,
            f"byte 0x{data[error.start]:02x} is not UTF-8 text "
            "(Latin-1 or Windows-1252 text, or a binary file)",
            row=row,
            expected=EXPECTED_CSV,
            mend="save it as UTF-8, or keep to plain ASCII letters",
        ) from None
    return data


def check_size(data: bytes, path: Path) -> None:
    """Checks the number of lines and their lengths before any line is divided into cells."""
    SAMPLES.check(data.count(b"\n") - 1, path)
    longest, start = LINE.most, 0
    while len(data) - start > longest:
        # The last line end that is near enough: all lines before it are short enough.
        end = data.rfind(b"\n", start, start + longest + 1)
        if end < 0:
            row = data.count(b"\n", 0, start) + 1
            LINE.check(len(data) - start, path, row=row, at_least=True)
        start = end + 1


def _names(line: str, body: bytes, path: Path) -> list[str]:
    try:
        names = [name.strip() for name in next(csv.reader([line]), [])]
    except csv.Error as error:
        raise unreadable_line(path, 1, error) from None
    COLUMNS.check(len(names), path)
    if not any(names):
        raise RecordError(
            path, "the first row is blank", row=1, expected=EXPECTED_CSV, mend="remove that row"
        )
    if all(is_number(name) for name in names):
        raise RecordError(
            path,
            "the first row holds numbers, not names",
            row=1,
            expected=EXPECTED_CSV,
            mend="add a header row such as time_s,command_v,position_m",
        )
    if any(delimiter in line for delimiter in ";\t|") or (len(names) == 1 and " " in names[0]):
        raise _wrong_delimiter(line, body, path)
    for position, name in enumerate(names, start=1):
        if not name:
            raise RecordError(
                path,
                f"column {position} of {len(names)} has no name",
                row=1,
                expected="a name for every column",
                mend="name the column, or remove the surplus comma",
            )
    repeated = [name for name, count in Counter(names).items() if count > 1]
    if repeated:
        raise RecordError(
            path,
            f"the column name occurs {names.count(repeated[0])} times",
            row=1,
            column=repeated[0],
            expected="every column name once",
            mend="rename or remove the repeated column",
        )
    return names


def unreadable_line(path: Path, row: int, error: csv.Error) -> RecordError:
    """Returns the error for a line that is not CSV, such as one with a stray carriage return."""
    return RecordError(
        path,
        f"the row cannot be divided into cells ({str(error).split(' - ')[0]})",
        row=row,
        expected=EXPECTED_CSV,
        mend="look for stray control characters and mixed line ends",
    )


def _wrong_delimiter(line: str, body: bytes, path: Path) -> RecordError:
    delimiter = max(";\t| ", key=line.count)
    shown = {"\t": "tabs", " ": "spaces"}.get(delimiter, f"'{delimiter}'")
    problem = f"the columns are separated by {shown}"
    mend = "export it with commas between the columns"
    if b"," in body.partition(b"\n")[0]:
        problem += " and the numbers have a decimal comma"
        mend += " and a decimal point in the numbers"
    return RecordError(path, problem, row=1, expected=EXPECTED_CSV, mend=mend)


def plain_number_mend(cell: str) -> str | None:
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


def is_number(text: str) -> bool:
    """Whether a cell is a number, "nan" included."""
    try:
        float(text)
    except ValueError:
        return False
    return True

# SPDX-License-Identifier: MIT
"""Seal of a check: digests of all its files, so that no change of them can remain unnoticed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import msgspec

import ehsid
from ehsid.harness.base.encoding import from_json, json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.base.manifest import sha256_of

from .settings import Settings

SEAL = "seal.json"
ANSWERS = "answers.json"
CASES, TRANSFER, RESULTS = "cases", "transfer", "results"


@dataclass(frozen=True)
class Seal:
    """Digests of the files of a check, and how the check was made.

    Attributes
    ----------
    answers_sha256
        SHA-256 of `answers.json`.
    files
        SHA-256 of all files in `cases` and `transfer`, by path below the check's folder.
    settings
        settings with which the cases were made.
    ehsid_version
        version of ehsid that made them.
    """

    answers_sha256: str
    files: dict[str, str]
    settings: Settings
    ehsid_version: str


def _sealed_files(out: Path) -> Iterator[Path]:
    for name in (CASES, TRANSFER):
        yield from sorted(path for path in (out / name).rglob("*") if path.is_file())


def write_seal(out: Path, settings: Settings) -> Seal:
    """Writes the seal of the answers, cases and transfer records in the folder, and returns it."""
    seal = Seal(
        sha256_of(out / ANSWERS),
        {path.relative_to(out).as_posix(): sha256_of(path) for path in _sealed_files(out)},
        settings,
        ehsid.__version__,
    )
    write_text(out / SEAL, json_text(seal, indent=1))
    return seal


def read_seal(out: Path) -> Seal:
    """Reads the seal of a check.

    Raises
    ------
    ValueError
        there is no seal, or it cannot be read.
    """
    path = out / SEAL
    try:
        return from_json(path.read_bytes(), Seal)
    except FileNotFoundError:
        raise ValueError(
            f"{path}: there is no such file: expected a check; name a folder that ehsid gap-check "
            "has made"
        ) from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a seal: {error}; make the check anew elsewhere") from None


def verify(out: Path) -> Seal:
    """Compares every file with the seal, and returns the seal.

    Raises
    ------
    ValueError
        a file has changed, is missing or was added; the message names it.
    """
    seal = read_seal(out)
    mend = "restore it, or make the check anew in another folder"
    digests = {ANSWERS: seal.answers_sha256, **seal.files}
    for name, digest in digests.items():
        path = out / name
        if not path.is_file():
            raise ValueError(f"{path}: sealed, and now missing; {mend}")
        if sha256_of(path) != digest:
            raise ValueError(f"{path}: changed since it was sealed; {mend}")
    for path in _sealed_files(out):
        if path.relative_to(out).as_posix() not in seal.files:
            raise ValueError(f"{path}: added since the check was sealed; move it away")
    return seal

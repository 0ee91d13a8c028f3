# SPDX-License-Identifier: MIT
"""Seal of a check: digests of all its files, so that no change of them can remain unnoticed.

Settings of a check: how many cases it has, of which grades, with which sensors.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

import ehsid
from ehsid.harness.base.encoding import from_json, json_text
from ehsid.harness.base.exchange import sha256_of
from ehsid.harness.base.files import write_text

SENSORS = ("position", "pressures", "pressures+supply", "pressures+supply+spool")
GRADES = ("plain", "hard", "confusable", "slow", "wide")
# Sets of excitations of the grade `wide`. Constants that are fitted on one set can be judged on the
# other.
EXCITATIONS = ("all", "training", "validation")

# Number of case seeds that belong to one check; no case seed belongs to two checks.
SEEDS = 100_000
LEAST_SECONDS, MOST_SECONDS = 2.0, 120.0


@dataclass(frozen=True)
class Settings:
    """Settings that determine the cases, together with the version of ehsid."""

    seed: int = 1
    """1 or more; checks with different seeds have no case in common."""
    count: int = 40
    """Number of cases, 1 to `SEEDS`."""
    grades: tuple[str, ...] = GRADES
    """Taken by the cases in turn, so each grade has an equal share. The score reports each grade
    separately; equal shares make the widest confidence interval as narrow as possible."""
    sensors: str | None = None
    """Sensors of all cases; None: a mix."""
    seconds: float | None = None
    """Length of each record, s; None: drawn for each case, 8 to 20 s (slow ones: 30 to 60 s)."""
    exclude_truth: bool = False
    """Whether each case has one effect of the catalogue that the diagnosis must leave out."""
    excitations: str = "all"
    """Set of which the excitations are drawn; other sets than "all" need grade `wide` alone."""

    def __post_init__(self) -> None:
        problem = self._problem()
        if problem:
            raise ValueError(problem)

    def _problem(self) -> str | None:
        if self.seed < 1:
            return f"--seed {self.seed}: expected 1 or more"
        if not 1 <= self.count <= SEEDS:
            return f"--count {self.count}: expected 1 to {SEEDS}"
        for grade in self.grades:
            if grade not in GRADES:
                return f"--grade '{grade}': expected one of {', '.join(GRADES)}"
        if not self.grades or len(set(self.grades)) < len(self.grades):
            return "--grade: name each grade once"
        if self.sensors is not None and self.sensors not in SENSORS:
            return f"--sensors '{self.sensors}': expected one of {', '.join(SENSORS)}"
        if self.seconds is not None and not LEAST_SECONDS <= self.seconds <= MOST_SECONDS:
            return (
                f"--seconds {self.seconds:g}: expected {LEAST_SECONDS:g} to {MOST_SECONDS:g}; "
                "without it lengths of 8 to 20 s are drawn"
            )
        if self.excitations not in EXCITATIONS:
            return f"--excitations '{self.excitations}': expected one of {', '.join(EXCITATIONS)}"
        if self.excitations != "all" and self.grades != ("wide",):
            return f"--excitations {self.excitations}: only grade 'wide' has sets; add --grade wide"
        return None

    def with_given(self, given: Mapping[str, Any]) -> Settings:
        """Returns these settings, with those of the given values that are not None."""
        return replace(self, **{name: value for name, value in given.items() if value is not None})

    def plain(self) -> dict[str, Any]:
        """Returns the settings as plain data for a JSON file."""
        return asdict(self) | {"grades": list(self.grades)}

    def differences(self, other: Settings) -> list[str]:
        """Describes each setting that differs from the other's, such as "count 40, not 20"."""
        mine, others = self.plain(), other.plain()
        return [
            f"{name} {_word(mine[name])}, not {_word(others[name])}"
            for name in mine
            if mine[name] != others[name]
        ]


def _word(value: Any) -> str:
    if isinstance(value, list):
        return "+".join(value)
    return "drawn" if value is None else str(value).lower()


SEAL = "seal.json"
ANSWERS = "answers.json"
CASES, TRANSFER, RESULTS = "cases", "transfer", "results"


@dataclass(frozen=True)
class Seal:
    """Digests of the files of a check, and how the check was made."""

    answers_sha256: str
    """SHA-256 of `answers.json`."""
    files: dict[str, str]
    """SHA-256 of all files in `cases` and `transfer`, by path below the check's folder."""
    settings: Settings
    """Settings with which the cases were made."""
    ehsid_version: str
    """Version of ehsid that made them."""


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

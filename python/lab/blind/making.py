# SPDX-License-Identifier: MIT
"""Blind checks: cases of all grades and kinds, separate answers, and one seal for all files."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, cast

import msgspec
import numpy as np

import ehsid
from ehsid.harness.base.encoding import from_json, json_text
from ehsid.harness.base.exchange import FOLDER, sha256_of
from ehsid.harness.base.files import result_folder, write_text
from ehsid.harness.base.parallel import Progress, run_tasks

SENSORS = ("position", "pressures", "pressures+supply", "pressures+supply+spool")
GRADES = ("plain", "hard", "confusable", "slow", "wide", "abroad", "linkage", "field")
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
EDITED = "edited"  # records of machines whose effects were changed; older checks have none


@dataclass(frozen=True)
class Seal:
    """Digests of the files of a check, and how the check was made."""

    answers_sha256: str
    """SHA-256 of `answers.json`."""
    files: dict[str, str]
    """SHA-256 of all files in `cases`, `transfer` and `edited`, by path below the check."""
    settings: Settings
    """Settings with which the cases were made."""
    ehsid_version: str
    """Version of ehsid that made them."""


def _sealed_files(out: Path) -> Iterator[Path]:
    for name in (CASES, TRANSFER, EDITED):
        yield from sorted(path for path in (out / name).rglob("*") if path.is_file())


def write_seal(out: Path, settings: Settings) -> Seal:
    """Writes the seal of the answers, cases and withheld records in the folder, and returns it."""
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


# Name of the result in its folder.
RESULT = "gap-check-cases"
Making = Callable[[], tuple[str, dict[str, Any]]]


def make_check(out: Path, settings: Settings, progress: Progress | None = None) -> Seal:
    """Writes `cases`, `transfer`, `edited`, `answers.json` and `seal.json` into a new folder.

    All files are put in place together at the end. A folder without a seal is no check.

    Raises
    ------
    ValueError
        the folder has files already, or two cases have the same name.
    ImportError
        numba is not installed.
    """
    names = (f"{CASES}/*", f"{TRANSFER}/*", f"{EDITED}/*", ANSWERS, SEAL)
    with result_folder(out, RESULT, names) as folder:
        if any(path.name != FOLDER for path in out.iterdir()):
            raise ValueError(f"--out {out}: has files, but no {SEAL} of a check; name a new folder")
        answers = run_tasks(making_tasks(folder, settings), progress)
        if len(dict(answers)) < settings.count:
            raise ValueError(f"--seed {settings.seed}: two cases drew one name; take another seed")
        write_text(folder / ANSWERS, json.dumps(dict(sorted(answers)), indent=1) + "\n")
        return write_seal(folder, settings)


def making_tasks(folder: Path, settings: Settings) -> Sequence[Making]:
    """Returns a task for each case; a task writes the case and returns its name and answer."""
    # The package `reality` needs an optional dependency, so it is imported only here.
    from ..reality.batch import write_drawn_case
    from ..reality.case import Sensors
    from ..reality.effects import CATALOGUE
    from ..reality.excitation import ExcitationSet
    from ..reality.variants import Grade

    ids = [
        str(effect) for effect in np.random.default_rng(settings.seed).permutation(list(CATALOGUE))
    ]
    return [
        functools.partial(
            write_drawn_case,
            folder / CASES,
            SEEDS * settings.seed + i,
            cast(Grade, settings.grades[i % len(settings.grades)]),
            # The effects take turns, so each is left out about as often as any other.
            kind="one" if settings.exclude_truth else None,
            effects=[ids[i % len(ids)]] if settings.exclude_truth else None,
            sensors=cast(Sensors | None, settings.sensors),
            seconds=settings.seconds,
            transfer=folder / TRANSFER,
            among=cast(ExcitationSet, settings.excitations),
            edited=folder / EDITED,
        )
        for i in range(settings.count)
    ]


Kind = Literal["one", "two", "none", "params", "open"]


@dataclass(frozen=True)
class Answer:
    """The withheld truth of a case."""

    kind: Kind
    """"one" or "two" effects of the catalogue, "none", "params" (wrong values only), or "open" (an
    effect outside of the catalogue)."""
    grade: str
    plant: str
    sensors: str
    excitation: tuple[str, ...]
    """As the generator names them; excitation of the fitted and of the held-out record."""
    effects: Mapping[str, Mapping[str, float]]
    """Sizes by effect and parameter, SI."""
    subsystem: tuple[str, ...]
    """Subsystems of the effects."""
    true: Mapping[str, float] = field(default_factory=dict)
    """True values of the rig by full name, SI."""
    largest_command: tuple[float, ...] = ()
    """Largest command in each of the two records, as a share of rated command."""
    families: Mapping[str, str] = field(default_factory=dict)
    """Kinds of physics, measurement and excitation of a wide case by trait, to group results."""
    laws: tuple[tuple[str, str], ...] = ()
    """Equation and variable of the laws that the simulator lacks, where more than one may be found;
    effects of the catalogue in an "open" case are beside them."""
    logged_every: int = 1
    """The log has every so many commands of the controller; what it sent in between is unknown."""
    variants: Mapping[str, Any] = field(default_factory=dict)
    """Laws of a wide machine, see `reality.variants`."""

    @property
    def null_bias(self) -> float:
        """Offset of the null, a share of rated command, by a dead band whose ends differ; or 0."""
        overlap = self.effects.get("valve_dead_band", {}).get("overlap", 0.0)
        # The ends are overlap (1 + d) and -overlap (1 - d), so that their middle is d overlap.
        return -float(self.variants.get("lap_difference", 0.0)) * overlap


def read_answers(path: Path) -> dict[str, Answer]:
    """Reads the answers, by name of the case.

    Raises
    ------
    ValueError
        there is no such file, or it is not one of a check.
    """
    where = str(path)
    answers = {}
    try:
        raw = from_json(path.read_bytes(), dict[str, msgspec.Raw])
        for name in sorted(raw):
            where = f"{path}: case {name}"
            answers[name] = from_json(raw[name], Answer)
    except FileNotFoundError:
        raise ValueError(f"{path}: there is no such file; a check writes it") from None
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{where}: not an answer of a check: {error}; restore the file") from None
    return answers

# SPDX-License-Identifier: MIT
"""Making of a check: cases of all grades and kinds, separate answers, and one seal for all.

The withheld answers of a check, as `answers.json` has them.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, cast

import msgspec
import numpy as np

from ehsid.harness.base.encoding import from_json
from ehsid.harness.base.exchange import FOLDER
from ehsid.harness.base.files import result_folder, write_text
from ehsid.harness.base.parallel import Progress, run_tasks

from .seal import ANSWERS, CASES, SEAL, SEEDS, TRANSFER, Seal, Settings, write_seal

# Name of the result in its folder.
RESULT = "gap-check-cases"
Making = Callable[[], tuple[str, dict[str, Any]]]


def make_check(out: Path, settings: Settings, progress: Progress | None = None) -> Seal:
    """Writes `cases`, `transfer`, `answers.json` and `seal.json` into a new folder.

    All files are put in place together at the end. A folder without a seal is no check.

    Raises
    ------
    ValueError
        the folder has files already, or two cases have the same name.
    ImportError
        numba is not installed.
    """
    names = (f"{CASES}/*", f"{TRANSFER}/*", ANSWERS, SEAL)
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

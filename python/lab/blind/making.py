# SPDX-License-Identifier: MIT
"""Making of a check: cases of all grades and kinds, separate answers, and one seal for all."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from ehsid.harness.base.exchange import FOLDER
from ehsid.harness.base.files import result_folder, write_text
from ehsid.harness.base.parallel import Progress, run_tasks

from .seal import ANSWERS, CASES, SEAL, TRANSFER, Seal, write_seal
from .settings import SEEDS, Settings

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
    from ..reality.structure import Grade

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

# SPDX-License-Identifier: MIT
"""Making of a check: cases of all grades and kinds, separate answers, and one seal for all."""

from __future__ import annotations

import functools
import json
import shutil
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, cast

import numpy as np

from ehsid.harness.parallel import Progress, run_tasks
from ehsid.harness.validation.blind.seal import ANSWERS, CASES, SEAL, TRANSFER, Seal, write_seal
from ehsid.harness.validation.blind.settings import SEEDS, Settings

UNFINISHED = ".unfinished"
Making = Callable[[], tuple[str, dict[str, Any]]]


def make_check(out: Path, settings: Settings, progress: Progress | None = None) -> Seal:
    """Writes `cases`, `transfer`, `answers.json` and `seal.json` into a new folder.

    All files are made in a sub-folder and put in place at the end, the seal last. A folder without
    a seal is no check.

    Raises
    ------
    ValueError
        the folder has files already, or two cases have the same name.
    ImportError
        numba is not installed.
    """
    unfinished = out / UNFINISHED
    if out.exists() and any(path != unfinished for path in out.iterdir()):
        raise ValueError(f"--out {out}: has files, but no {SEAL} of a check; name a new folder")
    shutil.rmtree(unfinished, ignore_errors=True)
    tasks = makings(unfinished, settings)
    unfinished.mkdir(parents=True)
    try:
        answers = run_tasks(tasks, progress)
        if len(dict(answers)) < settings.count:
            raise ValueError(f"--seed {settings.seed}: two cases drew one name; take another seed")
        text = json.dumps(dict(sorted(answers)), indent=1) + "\n"
        (unfinished / ANSWERS).write_text(text, encoding="utf-8")
        seal = write_seal(unfinished, settings)
        for name in (CASES, TRANSFER, ANSWERS, SEAL):
            (unfinished / name).rename(out / name)
    finally:
        shutil.rmtree(unfinished, ignore_errors=True)
        with suppress(OSError):  # only an empty folder is removed: nothing was put in place
            out.rmdir()
    return seal


def makings(folder: Path, settings: Settings) -> Sequence[Making]:
    """Returns a task for each case; a task writes the case and returns its name and answer."""
    # The package `reality` needs an optional dependency, so it is imported only here.
    from ehsid.harness.validation.reality.batch import write_one
    from ehsid.harness.validation.reality.case import Sensors
    from ehsid.harness.validation.reality.effects import CATALOGUE
    from ehsid.harness.validation.reality.structure import Grade

    ids = [str(one) for one in np.random.default_rng(settings.seed).permutation(list(CATALOGUE))]
    return [
        functools.partial(
            write_one,
            folder / CASES,
            SEEDS * settings.seed + i,
            cast(Grade, settings.grades[i % len(settings.grades)]),
            # The effects take turns, so each is left out about as often as any other.
            kind="one" if settings.exclude_truth else None,
            effects=[ids[i % len(ids)]] if settings.exclude_truth else None,
            sensors=cast(Sensors | None, settings.sensors),
            seconds=settings.seconds,
            transfer=folder / TRANSFER,
        )
        for i in range(settings.count)
    ]

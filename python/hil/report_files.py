# SPDX-License-Identifier: MIT
"""The files of `ehsid hil`: samples, report and numbers."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Sequence
from pathlib import Path

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.show.page import Table
from ehsid.harness.show.rendering import write_page

from .answers import Identity
from .page import hil_page
from .recording import ESTIMATES, RECORD
from .result_file import HilFile, Provenance, Runs, hil_file

REPORTS = ("hil.html", "hil.json")
# First part of the name of the folder that holds the samples of a run that is not finished.
UNFINISHED = "unfinished"


def file_names(folders: Iterable[str]) -> list[str]:
    """Returns the names of all files of a result whose runs have these folders; "" is its own."""
    samples = [str(Path(folder, name)) for folder in folders for name in (RECORD, ESTIMATES)]
    return [*samples, *REPORTS]


def copy_samples(samples: Path, folder: Path) -> None:
    """Copies the files of all runs, each in the folder of its run, into another folder."""
    for path in sorted(samples.rglob("*.csv")):
        copy = folder / path.relative_to(samples)
        copy.parent.mkdir(exist_ok=True)
        shutil.copyfile(path, copy)


def write_reports(
    out: Path,
    identity: Identity,
    runs: Runs,
    provenance: Provenance,
    *,
    beside: Table | None = None,
    sources: Sequence[str] = (),
) -> HilFile:
    """Writes hil.html and hil.json; returns the content of the latter. See `hil_page`."""
    write_page(out / REPORTS[0], hil_page(identity, runs, beside=beside, sources=sources))
    file = hil_file(identity, runs, provenance)
    write_text(out / REPORTS[1], json_text(file))
    return file

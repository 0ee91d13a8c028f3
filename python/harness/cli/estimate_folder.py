# SPDX-License-Identifier: MIT
"""`ehsid estimate FOLDER`: estimates all records of a folder, and compares them."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from ..base.files import result_folder
from .console import Console, note, print_blocks, refuse
from .options import check_signals, show_origin
from .progress import progress_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from ..models.estimation import Estimates, Recursion
    from ..models.estimation.spread import Named
    from ..models.identification import IoData
    from ..records import Hints, Origin

# Records that are in memory at once, and run side by side: as many as the widest registers take.
BATCH = 16


def is_folder_of_records(path: Path) -> bool:
    """Whether the path is a folder, and not one that is a single log (a ROS 2 bag)."""
    return path.is_dir() and not (path / "metadata.yaml").is_file()


def estimate_folder(
    folder: Path,
    signals: tuple[str, str],
    recursion: Recursion,
    hints: Hints,
    out: Path | None,
    as_json: bool,
) -> None:
    """Estimates all records of a folder; `signals` are the names of their input and output.

    Raises
    ------
    ValueError
        an option cannot be used, the folder has no record, or `out` is the folder itself.
    """
    from ..records import RecordError
    from ..records.formats import FOLDER_ENDINGS, records_in
    from ..show.estimates_page import FILES, write_estimates

    check_signals(*signals)
    recursion.estimator()  # Settings that do not fit each other are refused once, not by each file.
    files = records_in(folder)
    if not files:
        endings = ", ".join(f".{ending}" for ending in FOLDER_ENDINGS)
        raise RecordError(
            folder,
            "this is a directory without records",
            expected=f"a record file, or a directory with some ({endings})",
            mend="name one of the files in it, or the directory of the records",
        )
    if out is not None and out.resolve() == folder.resolve():
        raise ValueError(
            f"--out {out}: is the folder of the records, of which the next run would take the "
            "results for records: expected another folder; name one"
        )
    with nullcontext() if out is None else result_folder(out, "estimates", FILES) as made:
        found = _estimates(files, signals, recursion, hints)
        if made is not None:
            write_estimates(found, made)
    if as_json:
        from ..base.encoding import json_text

        typer.echo(json_text(found), nl=False)
        return
    _print(found, Console())
    if out is not None:
        Console().print(f"\nreport: {out / FILES[0]}", soft_wrap=True)


def _estimates(
    files: Sequence[Path], signals: tuple[str, str], recursion: Recursion, hints: Hints
) -> Estimates:
    """Returns the estimates of all files that can be used; ends the program if none can."""
    from ..models.estimation import compare

    named: list[Named] = []
    failed: dict[str, str] = {}
    origins: list[tuple[str, Origin]] = []
    with progress_of(f"{len(files)} records") as progress:
        for start in range(0, len(files), BATCH):
            batch = files[start : start + BATCH]
            named += _batch(batch, signals, recursion, hints, failed, origins)
            progress((start + len(batch)) / len(files))
    _show_origins(origins)
    for message in failed.values():
        note(f"{message}; it is left out")
    if not named:
        refuse(f"{files[0].parent}: none of {len(files)} files could be used")
    return compare(named, failed)


def _batch(
    files: Sequence[Path],
    signals: tuple[str, str],
    recursion: Recursion,
    hints: Hints,
    failed: dict[str, str],
    origins: list[tuple[str, Origin]],
) -> list[Named]:
    """Estimates these files; adds messages and what was taken for what in logs, by name."""
    from ..models.estimation import estimate_all
    from ..models.estimation.spread import Named
    from ..models.identification import IdentificationError, IoData
    from ..records import read_record

    data: dict[Path, IoData] = {}
    reading: dict[Path, Origin] = {}
    for file in files:
        try:
            record = read_record(file, columns=list(signals), hints=hints)
            data[file] = IoData.from_record(record, *signals)
        except ValueError as error:
            failed[file.name] = str(error)
            continue
        if record.origin is not None:
            reading[file] = record.origin
            origins.append((file.name, record.origin))
    named = []
    for file, found in zip(data, estimate_all(list(data.values()), recursion), strict=True):
        if isinstance(found, IdentificationError):
            failed[file.name] = f"{file}: {found}"
        else:
            origin = reading.get(file)
            plain = None if origin is None else origin.to_dict()
            named.append(Named(file.name, data[file].dt_s, found, plain))
    return named


def _show_origins(origins: Sequence[tuple[str, Origin]]) -> None:
    """Shows on stderr what was taken for what: once for all logs that were read in the same way."""
    console = Console(stderr=True)
    alike: dict[Origin, list[str]] = {}
    for name, origin in origins:
        alike.setdefault(origin, []).append(name)
    for origin, names in alike.items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        show_origin(f"{names[0]}{more}", origin, console)


def _print(found: Estimates, console: Console) -> None:
    from ..show.estimates_page import coefficient_table, estimates_lead

    print_blocks([*estimates_lead(found), coefficient_table(found)], console)

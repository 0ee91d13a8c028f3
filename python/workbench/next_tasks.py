# SPDX-License-Identifier: MIT
"""The work of the step Next: the firmware header, and everything as one archive."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import msgspec

from ehsid.harness.base.encoding import json_text
from ehsid.harness.base.files import replacing, result_files, write_text
from ehsid.harness.catalogue.channels import COMMAND, POSITION
from ehsid.harness.records import read_record

from .session import SETTINGS, Session, SessionError

FIRMWARE, PACKAGE = "firmware", "package"
MADE = "header.json"
# Of a session, the archive has what cannot be made again in a moment.
PACKED = (
    *(SETTINGS, "rig*.toml", "logs/**/*", "records/**/*", "check/**/*"),
    *("model/**/*", "gap/**/*"),
    f"{FIRMWARE}/**/*",
)
PIECE = 2**20  # bytes


class HeaderMade(msgspec.Struct, frozen=True):
    """What a header was made of."""

    record: str
    """Id of the record."""
    told: str
    """Digest of how its log was read; see `Entry.told`."""
    file: str
    """Name of the header."""
    summary: str
    """What it holds, in one line."""


def header_task(folder: Path, *, report: Callable[[float], None]) -> None:
    """Makes a firmware header, as `ehsid export`."""
    import ehsid
    from ehsid.harness.firmware import FILE_NAMES, chosen_orders, header_of_record
    from ehsid.harness.models.identification import IoData

    from .model_tasks import recursion_of

    session = Session(folder)
    firmware, choice = session.settings.firmware, session.settings.model
    names = (choice.input_name, choice.output_name) if firmware.like_model else (COMMAND, POSITION)
    entry = session.entry(firmware.record)
    if entry is None:
        raise SessionError(
            f"{firmware.record}: there is no such record in this session; choose one"
        )
    path, file = session.record_of(entry), FILE_NAMES[firmware.c]
    (folder / FIRMWARE).mkdir(exist_ok=True)
    with result_files(folder / FIRMWARE / file, "export", inputs=[path]) as new:
        data = IoData.from_record(read_record(path, columns=[*names]), *names)
        report(0.1)
        forgetting: ehsid.Forgetting = ehsid.FRatio()
        reset = True
        if firmware.like_model:
            recursion = recursion_of(choice)
            orders, forgetting, reset = recursion.orders, recursion.forgetting, recursion.reset
        else:
            orders = chosen_orders(data)
        report(0.8)
        header = header_of_record(
            path, data, orders, forgetting=forgetting, reset=reset, name=firmware.name, c=firmware.c
        )
        write_text(new / file, header.text)
    made = HeaderMade(entry.id, entry.told(), file, header.summary)
    write_text(folder / FIRMWARE / MADE, json_text(made))
    report(1.0)


def package_task(folder: Path, *, report: Callable[[float], None]) -> None:
    """Packs the session into one archive, which opens again where it is unpacked."""
    files = packed_files(folder)
    whole = sum(path.stat().st_size for path in files) or 1
    target = folder / PACKAGE / f"{folder.name}.zip"
    target.parent.mkdir(exist_ok=True)
    done = 0
    with replacing(target) as unfinished, zipfile.ZipFile(unfinished, "w") as archive:
        for path in files:
            name = f"{folder.name}/{path.relative_to(folder).as_posix()}"
            about = zipfile.ZipInfo.from_file(path, name)
            # Parquet is compressed already.
            packed = path.suffix == ".parquet"
            about.compress_type = zipfile.ZIP_STORED if packed else zipfile.ZIP_DEFLATED
            with path.open("rb") as source, archive.open(about, "w") as into:
                while piece := source.read(PIECE):
                    into.write(piece)
                    done += len(piece)
                    report(done / whole)


def packed_files(folder: Path) -> list[Path]:
    """Returns the files of a session that belong into its archive, those behind links left out."""
    found = {path for pattern in PACKED for path in folder.glob(pattern)}
    whole = folder.resolve()
    return sorted(
        path
        for path in found
        if path.is_file() and path.resolve() == whole / path.relative_to(folder)
    )

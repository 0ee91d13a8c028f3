# SPDX-License-Identifier: MIT
"""The manifest of a result: which files belong to it, with their sizes and digests."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Literal

import msgspec

import ehsid

from .encoding import from_json


class FileEntry(msgspec.Struct, frozen=True):
    """Size in bytes and SHA-256 of a file, as it was written."""

    bytes: int
    sha256: str

    def describes(self, path: Path) -> bool:
        """Whether a file with exactly this content is at the path."""
        return (
            path.is_file() and path.stat().st_size == self.bytes and sha256_of(path) == self.sha256
        )


class Manifest(msgspec.Struct, frozen=True, kw_only=True):
    """What a result consists of.

    Attributes
    ----------
    result
        what the files are, such as "gap" for those of `ehsid gap`.
    ehsid_version
        version of ehsid that wrote them.
    files
        entries by path below the folder of the result, with "/" between its parts.
    """

    schema_version: Literal[1] = 1
    result: str
    ehsid_version: str = ehsid.__version__
    files: Mapping[str, FileEntry]

    def text(self) -> str:
        """Returns the manifest as JSON."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1).decode() + "\n"


def sha256_of(path: str | os.PathLike[str]) -> str:
    """Returns the SHA-256 of a file in hexadecimal digits."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def manifest_of(folder: Path, result: str) -> Manifest:
    """Returns a manifest of all files in a folder and below it, in alphabetic order."""
    files = {
        path.relative_to(folder).as_posix(): FileEntry(path.stat().st_size, sha256_of(path))
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    }
    return Manifest(result=result, files=files)


def read_manifest(path: Path, result: str) -> Manifest:
    """Reads a manifest; one without files where there is none yet.

    Raises
    ------
    ValueError
        the file is no manifest, or names a file outside of the folder of the result.
    """
    try:
        manifest = from_json(path.read_bytes(), Manifest)
        for name in manifest.files:
            parts = PurePosixPath(name)
            if parts.is_absolute() or ".." in parts.parts or not parts.parts:
                raise ValueError(f"'{name}' is not a path below the folder of the result")
    except FileNotFoundError:
        return Manifest(result=result, files={})
    except (msgspec.MsgspecError, ValueError) as error:
        raise ValueError(
            f"{path}: not a manifest of ehsid: {error}; remove it, and move away the results that "
            "it belonged to"
        ) from None
    return manifest

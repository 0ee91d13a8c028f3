# SPDX-License-Identifier: MIT
"""The exchange of an earlier result for a new one, which can be undone until it is complete.

The manifest of a result: which files belong to it, with their sizes and digests.
"""

from __future__ import annotations

import glob
import hashlib
import os
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
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
    """What a result consists of."""

    schema_version: Literal[1] = 1
    result: str
    """What the files are, such as "gap" for those of `ehsid gap`."""
    ehsid_version: str = ehsid.__version__
    """Version of ehsid that wrote them."""
    files: Mapping[str, FileEntry]
    """Entries by path below the folder of the result, with "/" between its parts."""

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


# Hidden folder of the manifests, in each folder with results.
FOLDER = ".ehsid"


class Exchange:
    """The files of a result in a folder, and the folder aside in which the new ones are made.

    Attributes
    ----------
    new, old
        folders of the new files, and of the earlier ones while they are exchanged.
    planned, part
        manifest of the new files, which exists only while they are exchanged; and a temporary name
        under which it is written.
    """

    def __init__(self, folder: Path, result: str) -> None:
        self.folder = folder
        self.result = result
        self.manifest = folder / FOLDER / f"{result}.json"
        self.aside = folder / FOLDER / f"{result}.unfinished"
        self.new, self.old = self.aside / "new", self.aside / "old"
        self.planned = self.aside / "manifest.json"
        self.part = self.aside / "manifest.part"

    def check_aside(self) -> None:
        """Raises ValueError if the folder aside has files that no run of ehsid has made."""
        known = {one.name for one in (self.new, self.old, self.planned, self.part)}
        if strange := {one.name for one in self.aside.iterdir()} - known:
            raise ValueError(
                f"{self.aside / min(strange)}: not a file of ehsid; move it away, the folder "
                f"{self.aside.name} is for unfinished results"
            )

    def begin(self) -> None:
        """Clears away what a killed run has left."""
        self.put_back()
        shutil.rmtree(self.new, ignore_errors=True)
        shutil.rmtree(self.old, ignore_errors=True)
        self.new.mkdir()
        self.part.write_bytes(bytes(4096))  # so that a full disk is noticed before the work
        self.part.unlink()

    def check(self, names: Iterable[str], inputs: Iterable[Path] = ()) -> None:
        """Raises ValueError if a file is in the way that is not of an earlier run, or an input."""
        before = read_manifest(self.manifest, self.result).files
        present = [
            Path(name).as_posix()
            for pattern in names
            for name in glob.glob(pattern, root_dir=self.folder)  # noqa: PTH207 -- Path.glob misses broken links
        ]
        # A file in the place of a folder: "figures" for "figures/01.png".
        parents = {one for name in names for one in Path(name).parents if one.name}
        reads = [one for one in inputs if exists(one)]
        for name in (*present, *before):
            path = self.folder / name
            for one in reads:
                if path.exists() and path.samefile(one):
                    raise ValueError(
                        f"{path}: this is an input of the command ({one}), and the results have a "
                        "file of this name; name another --out"
                    )
        for name in present:
            path = self.folder / name
            if name not in before:
                raise ValueError(
                    f"{path}: is there already and is not an earlier result of this command; move "
                    "it away or name another --out"
                )
            if not before[name].describes(path):
                raise ValueError(
                    f"{path}: has been changed since ehsid wrote it; move it away or name another "
                    "--out"
                )
        for one in parents:
            if os.path.lexists(self.folder / one) and not (self.folder / one).is_dir():
                raise ValueError(
                    f"{self.folder / one}: is a file, and the results have a folder of this name; "
                    "move it away or name another --out"
                )

    def plan(self) -> Manifest:
        """Returns the manifest of the new files; ValueError if one of them has no free place."""
        planned = manifest_of(self.new, self.result)
        self.check([glob.escape(name) for name in planned.files])
        return planned

    def finish(self, planned: Manifest) -> None:
        """Puts the new files in place; an error puts the earlier ones back."""
        before = read_manifest(self.manifest, self.result).files
        obsolete = [
            name
            for name in before
            if name not in planned.files and before[name].describes(self.folder / name)
        ]
        self.part.write_text(planned.text(), encoding="utf-8")
        self.part.replace(self.planned)
        try:
            for name in planned.files:
                if name in before and (self.folder / name).exists():
                    _keep_copy(self.folder / name, self.old / name)
                _move(self.new / name, self.folder / name)
            for name in obsolete:
                _move(self.folder / name, self.old / name)
            self.planned.replace(self.manifest)
        except BaseException:
            self.put_back()
            raise
        self._remove_empty_folders(obsolete)

    def put_back(self) -> None:
        """Puts the earlier files back if an exchange was broken off.

        This may itself be broken off at any point and begun anew.
        """
        if not self.planned.exists():
            return
        after = read_manifest(self.planned, self.result).files
        before = read_manifest(self.manifest, self.result).files
        for name in {*before, *after}:
            path = self.folder / name
            entries = [files[name] for files in (before, after) if name in files]
            if os.path.lexists(path) and not any(entry.describes(path) for entry in entries):
                raise ValueError(
                    f"{path}: a killed run of ehsid wrote it, and it has been changed since; move "
                    "it away"
                )
        for name in after:
            if name not in before and not (self.new / name).exists():
                (self.folder / name).unlink(missing_ok=True)
        for name in before:
            if (self.old / name).exists():
                _move(self.old / name, self.folder / name)
        self._remove_empty_folders(after)
        self.planned.unlink()

    def _remove_empty_folders(self, names: Iterable[str]) -> None:
        """Removes the folders below `folder` that had files of these names and have none now."""
        for name in names:
            for parent in list(Path(name).parents)[:-1]:
                with suppress(OSError):  # has files, or is not there
                    (self.folder / parent).rmdir()

    def end(self) -> None:
        """Removes the folder aside, unless it has files that still must be put back."""
        if not self.planned.exists():
            shutil.rmtree(self.aside, ignore_errors=True)


def exists(path: Path) -> bool:
    """Returns whether the path exists; False for one that no file can have."""
    with suppress(OSError, ValueError):  # a name that is too long, a zero byte in it
        return path.exists()
    return False


def _keep_copy(path: Path, copy: Path) -> None:
    """Gives a file a second name, so that it stays under the first one until it is replaced."""
    copy.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.link(path, copy)
    except OSError:  # a file system without hard links
        path.replace(copy)


def _move(path: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    path.replace(target)

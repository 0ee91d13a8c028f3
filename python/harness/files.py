# SPDX-License-Identifier: MIT
"""Files that appear whole or not at all: single ones, and all files of a result together.

`result_folder` is the one way in which commands write. It keeps its records in a hidden folder in
the folder of the results:

    .ehsid/NAME.json          manifest of a result: its files with sizes and digests
    .ehsid/NAME.unfinished/   while a run is under way: its new files, and the earlier ones while
                              the two are exchanged
"""

from __future__ import annotations

import errno
import glob
import os
import secrets
import shutil
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ehsid.harness.manifest import manifest_of, read_manifest

if sys.platform != "win32":
    import fcntl

# Hidden folder of the manifests, in each folder with results.
FOLDER = ".ehsid"
# Errors that say that nothing more can be written: full disk, quota, largest size of a file.
FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a name in the same folder to write to; when the block ends well it becomes `path`.

    An error in the block, or one of the file system, leaves what stood at `path` as it was and
    nothing beside it. Readers see the old file or the new one, never a part. Two writers do not
    disturb each other: the last one to end is the one that stays.

    Raises
    ------
    OSError
        the folder is not there, or the file system refuses the new name.
    """
    unfinished = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        yield unfinished
        unfinished.replace(path)
    except BaseException:
        with suppress(OSError, ValueError):  # ValueError: a zero byte in the path
            unfinished.unlink()
        raise


def write_text(path: Path, text: str) -> None:
    """Write a text file as UTF-8 with line feeds, whole or not at all.

    Raises
    ------
    OSError
        as `replacing`.
    """
    with replacing(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8", newline="\n")


@contextmanager
def result_folder(
    folder: Path, result: str, names: Sequence[str], inputs: Iterable[Path] = ()
) -> Iterator[Path]:
    """Yields an empty folder to write a result into; at the end its files are put into `folder`.

    Only files of the manifest, which an earlier run wrote and nobody has changed since, are
    replaced. Those of them that the new result does not have are removed. All other files of the
    folder stay as they are. After an error, an interrupt or on a full disk the folder is as before.

    No file system exchanges several files at once. The files are exchanged one by one, each whole,
    in alphabetic order of their names, the manifest last; for this moment a reader may see files of
    both results. After an error the earlier files are put back at once. After a kill in that moment
    the next run with the same `folder` and `result` puts them back before it begins
    (`is_incomplete` tells); after any other kill it only removes the unfinished files.

    Parameters
    ----------
    folder
        is made with the folders above it if it does not exist, and removed again after an error.
    result
        name of the result, such as that of the command; a folder may hold several results.
    names
        all names that files of the result may have, relative to the folder. The wildcards of the
        module `glob` are allowed.
    inputs
        files that the work reads; none of them is replaced. Those that do not exist are ignored.

    Raises
    ------
    ValueError
        before the block: the folder cannot be written to, another run is writing this result, or a
        file of one of the names is an input or is not of an earlier run; at the end: such a file
        has come meanwhile, or the file system refuses. If a file has come meanwhile, the new result
        is kept in a folder `FOLDER/RESULT_not_placed_NUMBER`. The messages name the file and the
        remedy.
    """
    with _opened(folder, result, names, inputs) as exchange:
        yield exchange.new
        exchange.finish()


@contextmanager
def result_files(
    path: Path, result: str, beside: Sequence[str] = (), inputs: Iterable[Path] = ()
) -> Iterator[Path]:
    """The same as `result_folder` for a file that the user names, and for files beside it.

    Parameters
    ----------
    path
        the file; its folder exists.
    result
        name of the command; the name of the file is added to it.
    beside
        names of other files of the result, in the same folder.
    inputs
        as in `result_folder`.

    Yields
    ------
    The folder to write the files into.

    Raises
    ------
    ValueError
        as `result_folder`; the path is a folder, or its folder does not exist.
    """
    if path.is_dir():
        raise ValueError(f"--out {path}: this is a folder; give the name of a file")
    if not path.parent.is_dir():
        raise ValueError(f"--out {path}: there is no folder {path.parent}; make it first")
    names = [glob.escape(name) for name in (path.name, *beside)]
    with result_folder(path.parent, f"{result}-{path.name}", names, inputs) as folder:
        yield folder


def check_result_folder(
    folder: Path, result: str, names: Sequence[str], inputs: Iterable[Path] = ()
) -> None:
    """Checks what `result_folder` checks before its block, and leaves the folder as it is.

    Raises
    ------
    ValueError
        as `result_folder`.
    """
    with _opened(folder, result, names, inputs):
        pass


def is_incomplete(folder: Path, result: str) -> bool:
    """Whether a run was killed while its files were exchanged, so that files of two runs mix."""
    return _Exchange(folder, result).planned.exists()


def free_folder(folder: Path, stem: str) -> Path:
    """Makes the folder STEM_1 below `folder`, or with the next number that is free."""
    folder.mkdir(parents=True, exist_ok=True)
    number = 1
    while True:
        made = folder / f"{stem}_{number}"
        try:
            made.mkdir()
        except FileExistsError:
            number += 1
        else:
            return made


class _Exchange:
    """The files of a result in a folder, and the folder aside in which the new ones are made.

    Attributes
    ----------
    new, old
        folders of the new files, and of the earlier ones while they are exchanged.
    planned
        manifest of the new files; exists only while they are exchanged.
    """

    def __init__(self, folder: Path, result: str) -> None:
        self.folder = folder
        self.result = result
        self.manifest = folder / FOLDER / f"{result}.json"
        self.aside = folder / FOLDER / f"{result}.unfinished"
        self.new, self.old = self.aside / "new", self.aside / "old"
        self.planned = self.aside / "manifest.json"

    def check_aside(self) -> None:
        """Raises ValueError if the folder aside has files that no run of ehsid has made."""
        known = {one.name for one in (self.new, self.old, self.planned)}
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

    def check(self, names: Iterable[str], inputs: Iterable[Path] = ()) -> None:
        """Raises ValueError if a file is in the way that is not of an earlier run, or an input."""
        before = read_manifest(self.manifest, self.result).files
        found = [
            Path(name).as_posix()
            for pattern in names
            for name in glob.glob(pattern, root_dir=self.folder)  # noqa: PTH207 -- Path.glob misses broken links
        ]
        # A file in the place of a folder: "figures" for "figures/01.png".
        above = {one for name in names for one in Path(name).parents if one.name}
        read = [one for one in inputs if one.exists()]
        for name in (*found, *before):
            path = self.folder / name
            for one in read:
                if path.exists() and path.samefile(one):
                    raise ValueError(
                        f"{path}: this is an input of the command ({one}), and the results have a "
                        "file of this name; name another --out"
                    )
        for name in found:
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
        for one in above:
            if os.path.lexists(self.folder / one) and not (self.folder / one).is_dir():
                raise ValueError(
                    f"{self.folder / one}: is a file, and the results have a folder of this name; "
                    "move it away or name another --out"
                )

    def finish(self) -> None:
        """Puts the new files in place; an error puts the earlier ones back."""
        planned = manifest_of(self.new, self.result)
        try:
            self.check([glob.escape(name) for name in planned.files])
        except ValueError as error:
            kept = free_folder(self.folder, f"{self.result}_not_placed")
            self.new.replace(kept)
            raise ValueError(f"{error}; the new results are in {kept}") from None
        before = read_manifest(self.manifest, self.result).files
        left = [
            name
            for name in before
            if name not in planned.files and before[name].describes(self.folder / name)
        ]
        write_text(self.planned, planned.text())
        try:
            for name in planned.files:
                if name in before and (self.folder / name).exists():
                    _keep_copy(self.folder / name, self.old / name)
                _move(self.new / name, self.folder / name)
            for name in left:
                _move(self.folder / name, self.old / name)
            self.planned.replace(self.manifest)
        except BaseException:
            self.put_back()
            raise
        self._remove_empty_folders(left)

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


@contextmanager
def _opened(
    folder: Path, result: str, names: Sequence[str], inputs: Iterable[Path]
) -> Iterator[_Exchange]:
    """Yields the exchange of a result after all checks; at the end nothing is left of it."""
    nearest = next(path for path in (folder, *folder.absolute().parents) if _exists(path))
    if not nearest.is_dir():
        raise ValueError(f"--out {folder}: {nearest} is a file; give the name of a folder")
    missing = [path for path in (folder, *folder.parents) if not _exists(path)]
    exchange = _Exchange(folder, result)
    try:
        with _locked(exchange.aside):
            exchange.check_aside()
            try:
                exchange.begin()
                exchange.check(names, inputs)
                yield exchange
            finally:
                exchange.end()
    except OSError as error:
        ours = str(error.filename).startswith(str(folder / FOLDER))
        if error.errno not in FULL and not ours:
            raise
        raise ValueError(
            f"--out {folder}: cannot be written to ({error.strerror}); make room there, or name "
            "another folder. Earlier results are unchanged"
        ) from error
    finally:
        for path in (folder / FOLDER, *missing):
            with suppress(OSError):  # has files, or is not there
                path.rmdir()


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Makes the folder and keeps other processes out; the lock ends with this process."""
    out = folder.parent.parent
    if sys.platform == "win32":
        folder.mkdir(parents=True, exist_ok=True)
        yield
        return
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(folder, os.O_RDONLY)
        except OSError as error:
            raise ValueError(
                f"--out {out}: cannot be written to ({error.strerror}); name another folder"
            ) from None
        try:
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise ValueError(
                    f"--out {out}: another run of this command is writing there; wait for its end "
                    "or name another --out"
                ) from None
            except OSError:  # a file system without locks
                pass
            # A run that ended in between has removed the folder that was opened.
            if folder.exists() and os.path.samestat(os.fstat(descriptor), folder.stat()):
                yield
                return
        finally:
            os.close(descriptor)


def _exists(path: Path) -> bool:
    with suppress(OSError):  # such as a name that is too long
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

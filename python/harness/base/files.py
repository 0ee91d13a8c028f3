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
import socket
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from .exchange import FOLDER, Exchange, exists

if sys.platform != "win32":
    import fcntl

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
    with _opened(folder, folder, result, names, inputs) as exchange:
        yield from _placed(exchange)


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
        raise ValueError(
            f"--out {path}: there is no folder {path.parent}: expected one that exists; make "
            "it first"
        )
    names = [glob.escape(name) for name in (path.name, *beside)]
    result = f"{result}-{path.name}"
    with _opened(path, path.parent, result, names, inputs) as exchange:
        yield from _placed(exchange)


def check_result_folder(folder: Path, result: str, names: Sequence[str]) -> None:
    """Checks what `result_folder` checks before its block, and leaves the folder as it is.

    Raises
    ------
    ValueError
        as `result_folder`.
    """
    with _opened(folder, folder, result, names, ()):
        pass


@contextmanager
def temporary_folder() -> Iterator[Path]:
    """Yields a folder for temporary files, and removes it at the end.

    A process that is killed leaves its folder. It is removed by the next process that makes one on
    this host: the name has the host and the number of the process.
    """
    mine = f"ehsid_{socket.gethostname()}_"
    for left in Path(tempfile.gettempdir()).glob(f"{glob.escape(mine)}*"):
        number = left.name.removeprefix(mine).partition("_")[0]
        if number.isdecimal() and not _runs(int(number)):
            shutil.rmtree(left, ignore_errors=True)
    with tempfile.TemporaryDirectory(prefix=f"{mine}{os.getpid()}_") as folder:
        yield Path(folder)


def _runs(process: int) -> bool:
    """Whether a process of this number exists."""
    if sys.platform == "win32":  # where the signal 0 would end it
        return True
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # it belongs to another user, or is no number of a process
        pass
    return True


def is_incomplete(folder: Path, result: str) -> bool:
    """Whether a run was killed while its files were exchanged, so that files of two runs mix."""
    return Exchange(folder, result).planned.exists()


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


def _placed(exchange: Exchange) -> Iterator[Path]:
    """Yields the folder of the new files, then puts them in place."""
    yield exchange.new
    try:
        planned = exchange.plan()
    except ValueError as error:
        kept = free_folder(exchange.folder, f"{exchange.result}_not_placed")
        exchange.new.replace(kept)
        raise ValueError(f"{error}; the new results are in {kept}") from None
    exchange.finish(planned)


@contextmanager
def _opened(
    out: Path, folder: Path, result: str, names: Sequence[str], inputs: Iterable[Path]
) -> Iterator[Exchange]:
    """Yields the exchange of a result after all checks; at the end nothing is left of it.

    `out` is what the user has named: the folder, or a file in it.
    """
    nearest = next(path for path in (folder, *folder.parents) if exists(path))
    if not nearest.is_dir():
        raise ValueError(
            f"--out {folder}: {nearest} is a file: expected a folder; give the name of one"
        )
    missing = [path for path in (folder, *folder.parents) if not exists(path)]
    exchange = Exchange(folder, result)
    try:
        with _locked(exchange.aside, out):
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
            f"--out {out}: cannot be written to ({error.strerror}); make room there, or name "
            "another --out. Earlier results are unchanged"
        ) from error
    finally:
        for path in (folder / FOLDER, *missing):
            with suppress(OSError):  # has files, or is not there
                path.rmdir()


@contextmanager
def _locked(folder: Path, out: Path) -> Iterator[None]:
    """Makes the folder and keeps other processes out; the lock ends with this process."""
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
                f"--out {out}: cannot be written to ({error.strerror}); name another --out"
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

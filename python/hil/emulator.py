# SPDX-License-Identifier: MIT
"""Runs firmware on a board emulated by QEMU, with its serial line on a socket of this machine."""

from __future__ import annotations

import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from .frames import HilError

MACHINE = "mps2-an386"
QEMU = "qemu-system-arm"
_ELF, _ARM = b"\x7fELF", 40  # first bytes; machine, at byte 18


class Emulator:
    """An emulated board that runs as long as the context lasts; `emulated` is the short form.

    The firmware starts when the line is opened.

    Parameters
    ----------
    image
        ELF file for a Cortex-M.
    machine
        name of the board, as `qemu-system-arm -machine help` lists it.

    Attributes
    ----------
    port
        serial line of the board, for `open_line`; it can be opened once.

    Raises
    ------
    HilError
        the image does not exist or is not for a Cortex-M, or QEMU is not installed.
    """

    def __init__(self, image: Path, machine: str = MACHINE) -> None:
        _check(image)
        # This process binds the port and passes the socket to QEMU, so that no other program can
        # take the port number in between.
        with socket.create_server(("127.0.0.1", 0)) as listening:
            self.port = f"socket://127.0.0.1:{listening.getsockname()[1]}"
            self._said = tempfile.TemporaryFile()  # noqa: SIM115 -- as long as this lives
            self._process = self._start(image, machine, listening.fileno())

    def reset(self) -> None:
        """Resets the board, as its reset button would."""
        monitor = self._process.stdin
        if monitor is not None:
            monitor.write(b"system_reset\n")
            monitor.flush()

    def last_words(self) -> str | None:
        """Returns the messages of QEMU if it ends by itself within a second; otherwise None."""
        try:
            code = self._process.wait(1.0)
        except subprocess.TimeoutExpired:
            return None
        self._said.seek(0)
        lines = self._said.read().decode("utf-8", "replace").splitlines()
        said = "\n".join(line for line in lines if ": info: " not in line).strip()
        return said or f"it ended with exit code {code}"

    def close(self) -> None:
        """Ends QEMU; more than once is allowed."""
        self._process.kill()  # QEMU has nothing to save
        self._process.communicate()
        self._said.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self, image: Path, machine: str, listening: int) -> subprocess.Popen[bytes]:
        # If this process is killed and cannot end QEMU, the kernel ends it.
        with_us = ["setpriv", "--pdeathsig", "KILL"] if shutil.which("setpriv") else []
        line = f"socket,id=line,server=on,wait=on,nodelay=on,fd={listening}"
        return subprocess.Popen(
            [
                *with_us,
                *(QEMU, "-display", "none", "-machine", machine, "-kernel", str(image)),
                *("-chardev", line, "-serial", "chardev:line", "-monitor", "stdio"),
                *("-semihosting-config", "enable=on,target=native"),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
            pass_fds=[listening],
            start_new_session=True,  # Ctrl-C reaches this process only, which then ends QEMU
        )


@contextmanager
def emulated(image: Path, machine: str = MACHINE) -> Iterator[str]:
    """Runs the firmware on an emulated board as long as the context lasts.

    Parameters
    ----------
    image, machine
        see `Emulator`.

    Yields
    ------
    str
        serial line of the board, for `open_line`.

    Raises
    ------
    HilError
        an error of `Emulator`, or QEMU ended while the line was in use; the message then has its
        output.
    """
    with Emulator(image, machine) as emulator:
        try:
            yield emulator.port
        except HilError as error:
            said = emulator.last_words()
            if said is None:
                raise
            raise HilError(f"{QEMU} with {image} on {machine} has ended: {said}") from error


def _check(image: Path) -> None:
    """Checks that QEMU is installed and that the image is an ELF file for ARM.

    QEMU loads any other file as the contents of the memory and then hangs.
    """
    if shutil.which(QEMU) is None:
        raise HilError(f"{QEMU} is not installed; on Debian and Ubuntu: apt install {QEMU}")
    try:
        with image.open("rb") as file:
            head = file.read(20)
    except OSError as error:
        raise HilError(f"{image}: cannot be read ({error.strerror}); build the firmware") from error
    if head[:4] != _ELF or int.from_bytes(head[18:20], "little") != _ARM:
        raise HilError(
            f"{image}: not an ELF file for ARM; build the firmware: cmake --preset arm, "
            "cmake --build --preset arm"
        )

# SPDX-License-Identifier: MIT
"""Firmware on an emulated board: QEMU, with its serial line on a socket of this machine."""

from __future__ import annotations

import shutil
import socket
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

from ehsid.harness.deploy.hil.errors import HilError

MACHINE = "mps2-an386"
QEMU = "qemu-system-arm"
_END_S = 5.0
_ELF, _ARM = b"\x7fELF", 40  # first bytes; machine, at byte 18


class Emulator:
    """An emulated board, on as long as the context lasts; `emulated` is the short form.

    Its program begins when the line is opened.

    Parameters
    ----------
    image
        ELF file for a Cortex-M.
    machine
        board, as `qemu-system-arm -machine help` lists them.

    Attributes
    ----------
    port
        its serial line, for `open_line`; can be opened once.

    Raises
    ------
    HilError
        the image is not there or for no Cortex-M, or QEMU is not installed.
    """

    def __init__(self, image: Path, machine: str = MACHINE) -> None:
        _check(image)
        # Bound here and handed down: no other program can take the number meanwhile.
        with socket.create_server(("127.0.0.1", 0)) as listening:
            self.port = f"socket://127.0.0.1:{listening.getsockname()[1]}"
            self._said = tempfile.TemporaryFile()  # noqa: SIM115 -- as long as this lives
            self._process = self._start(image, machine, listening.fileno())

    def reset(self) -> None:
        """As the reset button of a board does."""
        monitor = self._process.stdin
        if monitor is not None:
            monitor.write(b"system_reset\n")
            monitor.flush()

    def last_words(self, within_s: float = 1.0) -> str | None:
        """What QEMU said where it ends by itself within this time; None where it goes on."""
        try:
            code = self._process.wait(within_s)
        except subprocess.TimeoutExpired:
            return None
        self._said.seek(0)
        lines = self._said.read().decode("utf-8", "replace").splitlines()
        said = "\n".join(line for line in lines if ": info: " not in line).strip()
        return said or f"it ended with exit code {code}"

    def close(self) -> None:
        """Ends QEMU; more than once is allowed."""
        self._process.kill()  # there is nothing for it to save
        self._process.communicate()
        self._said.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _start(self, image: Path, machine: str, listening: int) -> subprocess.Popen[bytes]:
        # Where this process is killed and cannot end QEMU, the kernel does.
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
        its serial line, for `open_line`.

    Raises
    ------
    HilError
        as `Emulator`; or what QEMU said, where it ended while the line was in use.
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
    """QEMU is there and the image right: any other file it takes for memory, and hangs."""
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

# SPDX-License-Identifier: MIT
"""Targets that stand behind a relay: at an address, and in the emulator."""

from __future__ import annotations

import socket
from pathlib import Path
from urllib.parse import urlsplit

from .emulator import MACHINE, QEMU, Emulator
from .errors import HilError
from .relay import DeviceGone

CONNECT_S = 5.0


class SocketDevice:
    """A target at an address socket://HOST:PORT.

    Raises
    ------
    HilError
        the address is not complete, or nothing listens there.
    """

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        try:
            complete = parts.scheme == "socket" and parts.hostname and parts.port
        except ValueError:  # a number that is no port
            complete = None
        if not complete:
            raise HilError(
                f"{address}: the address is not complete; expected socket://HOST:PORT, e.g. "
                "socket://localhost:4000"
            )
        try:
            self._socket = socket.create_connection((parts.hostname, parts.port), CONNECT_S)
        except OSError as error:
            raise HilError(
                f"{address}: could not be opened ({error.strerror or error}); expected something "
                "that listens there: start it, or correct the address"
            ) from None
        self._socket.settimeout(None)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def fileno(self) -> int:
        """Returns the descriptor to wait for."""
        return self._socket.fileno()

    def read(self) -> bytes:
        """Returns the bytes that are there."""
        data = self._socket.recv(4096)
        if not data:
            raise DeviceGone
        return data

    def write(self, data: bytes) -> None:
        """Sends bytes."""
        self._socket.sendall(data)

    def close(self) -> None:
        """Ends the connection."""
        self._socket.close()


class EmulatedDevice(SocketDevice):
    """Firmware on a board that QEMU emulates; see `Emulator`."""

    def __init__(self, image: Path, machine: str = MACHINE) -> None:
        self._emulator = Emulator(image, machine)
        self._about = f"{QEMU} with {image} on {machine}"
        try:
            super().__init__(self._emulator.port)
        except HilError:
            said = self._emulator.last_words()
            self._emulator.close()
            raise HilError(f"{self._about} has ended: {said or 'without a word'}") from None

    def reset(self) -> None:
        """Resets the board, as its reset button would."""
        self._emulator.reset()

    def why_gone(self) -> str:
        """Returns why QEMU has ended as a sentence; "" where it still runs."""
        said = self._emulator.last_words()
        return "" if said is None else f"{self._about} has ended: {said}"

    def close(self) -> None:
        """Ends QEMU."""
        super().close()
        self._emulator.close()

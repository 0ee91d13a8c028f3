# SPDX-License-Identifier: MIT
"""Sends and receives frames over a serial line, or over a socket in its place.

Targets that stand behind a relay: at an address, and in the emulator.
"""

from __future__ import annotations

import errno
import io
import select
import socket
import time
from pathlib import Path
from typing import Self
from urllib.parse import urlsplit

import serial
from serial.tools import list_ports

from .emulator import MACHINE, QEMU, Emulator
from .faults import DeviceGone
from .frames import MAX_FRAME, HilError

BAUD = 115200
WRITE_TIMEOUT_S = 5.0
_POLL_S = 0.01  # read timeout of ports without a descriptor; a read returns at the first byte
_CHUNK = 4096


class Line:
    """Carries frames over an open port; `open_line` makes it, and its context closes the port.

    Attributes
    ----------
    name
        name of the port, as the caller gave it.
    sent
        number of frames that were sent.
    """

    def __init__(self, port: serial.Serial, name: str) -> None:
        self.name = name
        self.sent = 0
        self._port = port
        self._frame = bytearray()  # first part of a frame whose end has not arrived yet
        self._received = bytearray()
        self._socket: socket.socket | None = getattr(port, "_socket", None)
        if self._socket is not None:
            # Otherwise a frame that follows an unanswered one waits for up to 40 ms.
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # pyserial reads from sockets byte by byte unless its timeout is zero; then it returns the
        # available bytes and this class has to wait for them. Not every port has a descriptor to
        # wait for.
        try:
            self._descriptor: int | None = port.fileno()
            port.timeout = 0.0
        except (AttributeError, io.UnsupportedOperation):
            self._descriptor = None
            port.timeout = _POLL_S

    def send(self, data: bytes) -> None:
        """Writes all bytes to the line.

        Raises
        ------
        HilError
            the line was closed, or accepted no bytes for 5 s.
        """
        try:
            self._port.write(data)
            self.sent += 1
        except serial.SerialTimeoutException as error:
            raise HilError(
                f"{self.name}: the line has taken nothing for {WRITE_TIMEOUT_S:g} s; is flow "
                "control on, or the other end stopped?"
            ) from error
        except (serial.SerialException, OSError) as error:
            raise self._closed(error) from error

    def receive(self, timeout_s: float) -> bytes | None:
        """Returns the next frame without its final zero, as `decode` takes it; skips empty frames.

        Parameters
        ----------
        timeout_s
            longest time to wait, s. The received part of a frame is kept for the next call.

        Returns
        -------
        bytes or None
            the frame; None if no frame was complete in time.

        Raises
        ------
        HilError
            the line was closed.
        """
        deadline = time.monotonic() + timeout_s
        left = max(timeout_s, 0.0)
        while (frame := self._next_frame()) is None:
            if left < 0.0:
                return None
            self._received += self._read(left)
            left = deadline - time.monotonic()
        return frame

    def close(self) -> None:
        """Closes the port; more than once is allowed."""
        # If the other end closed first, pyserial drops the socket without closing it.
        self._port.close()
        if self._socket is not None:
            self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _next_frame(self) -> bytes | None:
        """Takes the next complete frame from the received bytes; None if there is none.

        Of a frame that is too long only the start is kept.
        """
        while self._received:
            part, zero, rest = self._received.partition(b"\0")
            self._frame += part[: MAX_FRAME + 1 - len(self._frame)]
            self._received = rest
            if zero and self._frame:
                frame = bytes(self._frame)
                self._frame.clear()
                return frame
        return None

    def _read(self, timeout_s: float) -> bytes:
        """Returns the available bytes; waits for the first of them, at most `timeout_s`."""
        try:
            if self._descriptor is None:
                return bytes(self._port.read(max(1, self._port.in_waiting)))
            ready, _, _ = select.select([self._descriptor], [], [], timeout_s)
            return bytes(self._port.read(_CHUNK)) if ready else b""
        except (serial.SerialException, OSError, TypeError, ValueError) as error:
            raise self._closed(error) from error

    def _closed(self, error: Exception) -> HilError:
        return HilError(
            f"{self.name}: the line was closed ({error}); is the other end still there?"
        )


def open_line(port: str, baud: int = BAUD) -> Line:
    """Opens a port through pyserial.

    Parameters
    ----------
    port
        /dev/ttyACM0, COM3, or a URL of pyserial: socket://host:port, rfc2217://host:port, loop://.
    baud
        bit rate, bits per second; not used for sockets.

    Raises
    ------
    HilError
        the port does not exist, is in use, or may not be opened; the message says how to correct
        it.
    """
    address = urlsplit(port) if port.lower().startswith("socket://") else None
    try:
        complete = address is None or bool(address.hostname and address.port)
    except ValueError:  # a number that is no port
        complete = False
    if not complete:
        raise HilError(
            f"{port}: could not be opened (the address is not complete); expected "
            "socket://HOST:PORT, e.g. socket://localhost:4000"
        )
    # pyserial supports no write timeout for rfc2217 ports.
    write_timeout_s = None if port.lower().startswith("rfc2217:") else WRITE_TIMEOUT_S
    try:
        opened = serial.serial_for_url(
            port, baud, timeout=0.0, write_timeout=write_timeout_s, exclusive=True
        )
    except (serial.SerialException, OSError, ValueError) as error:
        raise HilError(f"{port}: {_why(port, error)}") from error
    return Line(opened, port)


def _why(port: str, error: Exception) -> str:
    """Returns the reason why a port was not opened, and what the user can do."""
    number = getattr(error, "errno", None)
    if "://" in port:
        return (
            f"could not be opened ({error}); expected e.g. socket://localhost:4000, and something "
            "that listens there"
        )
    if number == errno.EACCES:
        return (
            "no permission; on Linux join the group of serial ports and log in anew: "
            "sudo usermod -aG dialout $USER"
        )
    if number in (errno.EBUSY, errno.EAGAIN):
        return "in use by another program; end that (a terminal, another run) and try again"
    if number == errno.ENOENT:
        there = ", ".join(sorted(found.device for found in list_ports.comports()))
        return f"there is no such port; there are: {there or 'none'}. Is the board plugged in?"
    return f"could not be opened ({error}); expected a serial port, e.g. /dev/ttyACM0"


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

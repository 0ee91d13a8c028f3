# SPDX-License-Identifier: MIT
"""Ports: frames in pieces, ports that are not there, in use, forbidden, gone."""

import errno
import os
import pty
import select
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
import serial
import serial.rfc2217
from hypothesis import given
from hypothesis import strategies as st

from ehsid.hil.frames import MAX_FRAME, HilError, encode
from ehsid.hil.transport import Line, open_line

FRAME = encode(4, 7, bytes(range(95)))


@contextmanager
def socket_pair() -> Iterator[tuple[Line, socket.socket]]:
    """A line, and its other end."""
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        with open_line(f"socket://127.0.0.1:{port}") as line:
            end, _ = listening.accept()
            with end:
                yield line, end


@pytest.fixture(scope="module")
def pair() -> Iterator[tuple[Line, socket.socket]]:
    with socket_pair() as made:
        yield made


@given(st.lists(st.binary(max_size=60), max_size=6), st.lists(st.integers(1, 40), min_size=1))
def test_frames_come_whole_however_the_line_cuts_them(
    pair: tuple[Line, socket.socket], bodies: list[bytes], cuts: list[int]
) -> None:
    line, end = pair
    stream = b"".join(encode(4, i, body) for i, body in enumerate(bodies))
    got, start = [], 0
    for i in range(len(stream)):
        size = cuts[i % len(cuts)]
        end.sendall(stream[start : start + size])
        start += size
        while (frame := line.receive(0.0)) is not None:  # what is there of one is kept
            got.append(frame)
        if start >= len(stream):
            break
    while len(got) < len(bodies):
        frame = line.receive(5.0)
        assert frame is not None
        got.append(frame)
    assert got == [encode(4, i, body)[1:-1] for i, body in enumerate(bodies)]


def test_nothing_in_time_is_none(pair: tuple[Line, socket.socket]) -> None:
    line, end = pair
    end.sendall(b"\0\0\0\0")  # empty frames
    assert line.receive(0.02) is None
    assert line.receive(0.0) is None


def test_of_what_never_ends_only_the_start_is_kept(pair: tuple[Line, socket.socket]) -> None:
    line, end = pair
    noise = threading.Thread(target=end.sendall, args=(b"\1" * 1_000_000 + b"\0" + FRAME,))
    noise.start()
    assert line.receive(10.0) == b"\1" * (MAX_FRAME + 1)  # too long, as decode() then says
    assert line.receive(10.0) == FRAME[1:-1]
    noise.join()


def test_what_is_sent_arrives(pair: tuple[Line, socket.socket]) -> None:
    line, end = pair
    line.send(FRAME)
    got = b""
    while len(got) < len(FRAME):
        got += end.recv(1000)
    assert got == FRAME


def test_the_other_end_goes() -> None:
    with socket_pair() as (line, end):
        end.sendall(FRAME[:50])
        end.close()
        with pytest.raises(HilError, match=r"socket://127.0.0.1:\d+: the line was closed"):
            line.receive(5.0)


def test_sending_on_a_line_that_is_closed() -> None:
    with socket_pair() as (line, _):
        line.close()
        with pytest.raises(HilError, match="the line was closed"):
            line.send(FRAME)
        with pytest.raises(HilError, match="the line was closed"):
            line.receive(0.0)


def test_a_line_that_takes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ehsid.hil.transport.WRITE_TIMEOUT_S", 0.05)
    with (
        socket_pair() as (line, _),
        pytest.raises(HilError, match=r"has taken nothing for 0\.05 s"),
    ):
        line.send(bytes(20_000_000))


# Serial ports


@contextmanager
def terminal() -> Iterator[tuple[int, str]]:
    """A pair of pseudo terminals: what stands in for a serial port, and its name."""
    master, slave = pty.openpty()
    name = os.ttyname(slave)
    try:
        yield master, name
    finally:
        os.close(slave)
        os.close(master)


def test_a_serial_port_carries_all_bytes() -> None:
    with terminal() as (master, name), open_line(name) as line:
        every = bytes(range(1, 256))  # none is taken for a control character
        line.send(every + b"\0")
        got = b""
        while len(got) < 256:
            got += os.read(master, 1000)
        assert got == every + b"\0"
        os.write(master, b"\0" + every + b"\0" + FRAME)
        assert line.receive(5.0) == every
        assert line.receive(5.0) == FRAME[1:-1]


def test_a_serial_port_in_use() -> None:
    with (
        terminal() as (_, name),
        open_line(name),
        pytest.raises(HilError, match=f"^{name}: in use by another program"),
    ):
        open_line(name)


def test_a_board_that_is_unplugged() -> None:
    master, slave = pty.openpty()
    with open_line(os.ttyname(slave)) as line:
        os.close(slave)
        os.close(master)
        with pytest.raises(HilError, match="the line was closed"):
            line.receive(5.0)


def test_loop() -> None:
    """A port of pyserial without anything to wait for."""
    with open_line("loop://") as line:
        assert line.receive(0.0) is None
        line.send(FRAME + FRAME)
        assert line.receive(5.0) == FRAME[1:-1]
        assert line.receive(5.0) == FRAME[1:-1]
        assert line.receive(0.02) is None


def serve_rfc2217(listening: socket.socket) -> None:
    """A server of serial ports for one client; its port sends back what it gets."""
    end, _ = listening.accept()
    port = serial.serial_for_url("loop://", timeout=0)
    with end, end.makefile("wb", buffering=0) as out, port:
        manager = serial.rfc2217.PortManager(port, out)
        while True:
            ready, _, _ = select.select([end], [], [], 0.001)
            data = end.recv(4096) if ready else b""
            if ready and not data:
                return
            port.write(b"".join(manager.filter(data)))
            end.sendall(b"".join(manager.escape(port.read(port.in_waiting))))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # pyserial 3.5
def test_a_server_of_serial_ports() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        server = threading.Thread(target=serve_rfc2217, args=(listening,))
        server.start()
        with open_line(f"rfc2217://127.0.0.1:{listening.getsockname()[1]}") as line:
            every = encode(4, 255, bytes(range(256)))  # 255 has a meaning of its own there
            for _ in range(3):
                line.send(every)
                assert line.receive(10.0) == every[1:-1]
        server.join()


# Ports that cannot be opened


def refuse(monkeypatch: pytest.MonkeyPatch, number: int) -> None:
    def opened(*given: object, **named: object) -> None:
        raise serial.SerialException(number, "could not open port")

    monkeypatch.setattr(serial, "serial_for_url", opened)


def test_no_permission(monkeypatch: pytest.MonkeyPatch) -> None:
    refuse(monkeypatch, errno.EACCES)  # root, who may run this, may open everything
    with pytest.raises(HilError, match=r"^/dev/ttyACM0: no permission; .*usermod -aG dialout"):
        open_line("/dev/ttyACM0")


def test_no_such_port() -> None:
    with pytest.raises(
        HilError, match=r"^/dev/ttyEHSID7: there is no such port; there are: .*plug"
    ):
        open_line("/dev/ttyEHSID7")


@pytest.mark.parametrize(
    ("port", "said"),
    [
        ("socket://127.0.0.1:1", "Connection refused"),
        ("socket://127.0.0.1", "expected socket://HOST:PORT"),
        ("rfc2217://127.0.0.1:1", "Connection refused"),
        ("telnet://127.0.0.1:1", "'telnet' not known"),
        ("/", "expected a serial port, e.g. /dev/ttyACM0"),
        (__file__, "expected a serial port, e.g. /dev/ttyACM0"),
    ],
)
def test_what_is_no_port(port: str, said: str) -> None:
    with pytest.raises(HilError, match=said) as raised:
        open_line(port)
    assert str(raised.value).startswith(f"{port}: could not be opened")

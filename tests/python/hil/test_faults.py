# SPDX-License-Identifier: MIT
"""Faults of the line on request, and the targets behind a relay."""

from __future__ import annotations

import random
import socket
from pathlib import Path

import pytest
from hil_target import FakeDevice, Target

from ehsid.hil.faults import FAULTS, TO_HOST, TO_TARGET, OnRequest, fault, relayed
from ehsid.hil.frames import HilError
from ehsid.hil.session import Session
from ehsid.hil.transport import EmulatedDevice, SocketDevice, open_line


def test_a_fault_is_put_in_once_and_in_its_direction() -> None:
    hook = OnRequest(1.5)
    hook.ask("drop", TO_HOST)
    hook.ask("hold", TO_HOST)
    assert hook(TO_TARGET, 0, b"a").data == b"a\0"
    assert hook(TO_HOST, 0, b"a").data == b""
    held = hook(TO_HOST, 1, b"a")
    assert (held.data, held.hold_s) == (b"a\0", 1.5)
    assert hook(TO_HOST, 2, b"a").hold_s == 0.0
    assert hook.made == 2


def test_a_fault_that_there_is_not() -> None:
    hook = OnRequest(0.0)
    with pytest.raises(ValueError, match="there is no such fault"):
        hook.ask("explode", TO_HOST)
    with pytest.raises(ValueError, match="there is no such fault"):
        hook.ask("drop", "sideways")
    with pytest.raises(ValueError, match="there is no such fault"):
        fault("explode", b"a", random.Random(0), 0.0)


@pytest.mark.parametrize("kind", [kind for kind in FAULTS if kind != "hold"])
def test_every_fault_changes_the_frame(kind: str) -> None:
    assert fault(kind, b"frame", random.Random(1), 0.0).data != b"frame\0"


@pytest.mark.slow
def test_a_fault_on_the_line_is_corrected() -> None:
    hook = OnRequest(0.0)
    with relayed(FakeDevice(Target())) as relay:
        relay.disturb(hook)
        with open_line(relay.port) as line:
            session = Session(line, timeout_s=0.1)
            hook.ask("flip", TO_HOST)
            hook.ask("drop", TO_TARGET)
            session.hello()
            assert line.sent >= 2
    assert hook.made == 2
    assert session.counters.asked_again >= 1


@pytest.mark.parametrize("address", ["socket://localhost", "socket://:1", "tcp://localhost:1"])
def test_an_address_that_is_not_complete(address: str) -> None:
    with pytest.raises(HilError, match="the address is not complete"):
        SocketDevice(address)


def test_an_address_where_nothing_listens() -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with pytest.raises(HilError, match="expected something that listens there"):
        SocketDevice(f"socket://127.0.0.1:{port}")


def test_a_target_that_hangs_up_ends_the_line() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        device = SocketDevice(f"socket://127.0.0.1:{listening.getsockname()[1]}")
        other, _ = listening.accept()
        with relayed(device) as relay, open_line(relay.port) as line:
            other.close()
            with pytest.raises(HilError, match="the line was closed"):
                Session(line).hello()


def test_an_image_that_is_none(tmp_path: Path) -> None:
    with pytest.raises(HilError, match=r"not installed|cannot be read"):
        EmulatedDevice(tmp_path / "none.elf")

# SPDX-License-Identifier: MIT
"""QEMU is there as long as the block lasts, and what it says of bad images and boards is told."""

import os
import shutil
import signal
import struct
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from ehsid.hil.emulator import QEMU, Emulator, emulated
from ehsid.hil.frames import HilError
from ehsid.hil.transport import open_line

needs_qemu = pytest.mark.skipif(
    shutil.which("qemu-system-arm") is None, reason="no qemu-system-arm: apt install it"
)


def elf(program: bytes) -> bytes:
    """An executable for ARM with these instructions behind a stack pointer and a reset vector."""
    memory = struct.pack("<II", 0x20010000, 8 | 1) + program  # bit 0: Thumb
    head = struct.pack("<16s2H5I6H", b"\x7fELF\1\1\1", 2, 40, 1, 8, 52, 0, 0, 52, 32, 1, 40, 0, 0)
    segment = struct.pack("<8I", 1, 84, 0, 0, len(memory), len(memory), 5, 4)
    return head + segment + memory


@pytest.fixture
def image(tmp_path: Path) -> Path:
    """A program that does nothing for ever: a branch to itself."""
    path = tmp_path / "nothing.elf"
    path.write_bytes(elf(b"\xfe\xe7"))
    return path


def running(process: int) -> bool:
    """Neither gone nor waiting to be buried."""
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_for_end(process: int) -> None:
    deadline = time.monotonic() + 20.0
    while running(process):
        assert time.monotonic() < deadline, f"process {process} still runs"
        time.sleep(0.01)


@needs_qemu
@pytest.mark.parametrize("error", [None, ValueError, KeyboardInterrupt])
def test_qemu_ends_with_the_block(image: Path, error: type[BaseException] | None) -> None:
    with suppress(ValueError, KeyboardInterrupt), Emulator(image) as emulator:
        process = emulator._process.pid
        assert running(process)
        assert os.getsid(process) != os.getsid(0)  # Ctrl-C of the terminal does not reach it
        if error is not None:
            raise error
    assert not running(process)


@needs_qemu
@pytest.mark.skipif(shutil.which("setpriv") is None, reason="setpriv (util-linux) is not there")
def test_qemu_ends_with_a_host_that_is_killed(image: Path) -> None:
    program = (
        "import sys, time; from pathlib import Path\n"
        "from ehsid.hil.emulator import Emulator\n"
        "with Emulator(Path(sys.argv[1])) as e: print(e._process.pid, flush=True); time.sleep(60)"
    )
    host = subprocess.Popen([sys.executable, "-c", program, image], stdout=subprocess.PIPE)
    assert host.stdout is not None
    process = int(host.stdout.readline())
    wait_until_named(process)
    host.send_signal(signal.SIGKILL)
    host.communicate()
    wait_for_end(process)


def wait_until_named(process: int) -> None:
    """Until it is QEMU: what it begins as asks the kernel first to end it with its parent.

    While a process changes its program its command line is empty for a moment.
    """
    deadline = time.monotonic() + 20.0
    while not Path(f"/proc/{process}/cmdline").read_bytes().startswith(QEMU.encode()):
        assert time.monotonic() < deadline
        time.sleep(0.01)


@needs_qemu
def test_a_machine_that_there_is_not(image: Path) -> None:
    with (
        pytest.raises(
            HilError, match=r"nothing.elf on pdp11 has ended: .*unsupported machine type"
        ),
        emulated(image, "pdp11") as port,
        open_line(port) as line,
    ):
        line.receive(20.0)


@needs_qemu
def test_a_program_that_ends_the_emulator(image: Path) -> None:
    image.write_bytes(elf(b"\x18\x20\xab\xbe"))  # movs r0, SYS_EXIT; bkpt 0xAB: semihosting
    with (
        pytest.raises(HilError, match=r"on mps2-an386 has ended: it ended with exit code 1"),
        emulated(image) as port,
        open_line(port) as line,
    ):
        line.receive(20.0)


@pytest.mark.slow
@needs_qemu
def test_an_error_with_qemu_alive_is_left_as_it_is(image: Path) -> None:
    with pytest.raises(HilError, match=r"^mine$"), emulated(image):  # nobody opens its line
        raise HilError("mine")


@needs_qemu
@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("none.elf", None, r"none.elf: cannot be read \(No such file or directory\)"),
        ("text.elf", b"S-record", "text.elf: not an ELF file for ARM; build the firmware"),
        ("short.elf", b"\x7fELF", "not an ELF file for ARM"),
        ("host.elf", b"\x7fELF" + bytes(14) + b"\x3e\0", "not an ELF file for ARM"),  # x86-64
    ],
)
def test_what_is_no_image(tmp_path: Path, name: str, content: bytes | None, said: str) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(HilError, match=said):
        Emulator(tmp_path / name)


def test_without_qemu(image: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(HilError, match=r"not installed; .* apt install qemu-system-arm"):
        Emulator(image)

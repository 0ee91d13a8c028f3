# SPDX-License-Identifier: MIT
"""What the user chooses for a run: as it was typed, in the units of engineers, and read."""

from __future__ import annotations

import math
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

import ehsid
from ehsid.harness.catalogue.parameters import TARGET_POLICY
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.rigs.new import published_rig
from ehsid.harness.signals.simulation import parse_settings
from ehsid.harness.signals.simulation.settings import SignalOptions
from ehsid.hil.emulator import MACHINE
from ehsid.hil.plan import THIRD_ORDER, WATCHDOG_MS, LoopRun

SIGNALS = ("multisine", "prbs", "steps", "chirp", "triangle")
HERE, LINE, IMAGE = "here", "line", "image"
TARGETS = {
    HERE: "this computer, no board",
    LINE: "serial port or address",
    IMAGE: "firmware in QEMU",
}
MACHINES = {"mps2-an386": "Cortex-M4F", "mps2-an500": "Cortex-M7"}
POLICIES = {info.id.replace("_", "-"): info for info in ehsid.policies()}
LEAST_BAUD = 1


class LiveSettings(msgspec.Struct, frozen=True):
    """The form of a run; texts are as the user typed them. The defaults move at once, on any PC."""

    target: str = HERE
    """Key of `TARGETS`: this computer, or what is at `port`, or `image` in QEMU on `machine`."""
    port: str = ""
    baud: str = "115200"
    """Serial port or address of the target, and the bit rate of a serial port."""
    image: str = ""
    machine: str = MACHINE
    """Firmware image (ELF) and board of QEMU."""
    rig: str = ""
    """Path of the rig file; "" stands for the rig of the published experiment."""
    effects: str = ""
    """Values of the simulated machine that the controller does not know, as in `--effect`."""
    position_control: bool = True
    """Whether the target controls the position; else the test signal is the command."""
    signal: str = "multisine"
    seed: str = "0"
    duration_s: str = "300"
    dt_ms: str = "20"
    amplitude: str = ""
    bandwidth_hz: str = "0.5"
    """Test signal. The amplitude is in V, or in mm with position control; "" takes the default."""
    forgetting: str = TARGET_POLICY
    retune: bool = True
    """Policy of the estimator, and whether the gain of the controller follows the estimate."""
    real_time: bool = True
    """Whether the run keeps to the sampling time; else it is as fast as the line."""


@dataclass(frozen=True)
class Wanted:
    """The settings, read."""

    address: str | None
    """Serial port or address; None for another target."""
    image: Path | None
    """Path of the image of QEMU; None for another target."""
    baud: int
    rig: Rig
    run: LoopRun


def read_settings(settings: LiveSettings) -> Wanted:
    """Reads the form.

    Raises
    ------
    ValueError
        a field is empty that must not be, or has no sense; the message names the field.
    """
    address = settings.port.strip() if settings.target == LINE else None
    image = _image(settings.image) if settings.target == IMAGE else None
    if address == "":
        raise ValueError(
            "serial port or address: nothing is given: expected e.g. /dev/ttyACM0 or "
            "socket://localhost:4444; fill it in, or choose this computer as the target"
        )
    dt_s = 1e-3 * number(settings.dt_ms, "sampling time", "ms")
    amplitude = number(settings.amplitude, "amplitude", "V or mm", optional=True)
    scale = 1e-3 if settings.position_control else 1.0
    signal = SignalOptions(
        settings.signal,
        number(settings.duration_s, "duration", "s"),
        dt_s,
        None if math.isnan(amplitude) else scale * amplitude,
        whole(settings.seed, "seed", 0),
    )
    bandwidth = number(settings.bandwidth_hz, "bandwidth", "Hz", optional=True)
    run = LoopRun(
        settings.position_control,
        signal,
        None if math.isnan(bandwidth) else bandwidth,
        POLICIES[settings.forgetting].policy(),
        THIRD_ORDER,
        settings.retune,
        parse_settings(settings.effects.replace(",", " ").split()),
        WATCHDOG_MS + (round(2000.0 * dt_s) if settings.real_time else 0),
    )
    baud = whole(settings.baud, "baud rate", LEAST_BAUD)
    return Wanted(address, image, baud, rig_of(settings.rig), run)


def rig_of(path: str) -> Rig:
    """Reads a rig file; "" stands for the rig of the published experiment."""
    return read_rig(Path(path).expanduser()) if path.strip() else published_rig()


def number(text: str, what: str, unit: str, *, optional: bool = False) -> float:
    """Returns a positive number with a decimal point or comma; NaN for an empty optional field.

    Raises
    ------
    ValueError
        the text is no such number.
    """
    plain = text.strip().replace(",", ".")
    if optional and not plain:
        return math.nan
    try:
        value = float(plain)
    except ValueError:
        value = math.nan
    if not 0.0 < value < math.inf:
        raise ValueError(f"{what}: '{text}': expected a number above 0, in {unit}; correct it")
    return value


def whole(text: str, what: str, least: int) -> int:
    """Returns a whole number.

    Raises
    ------
    ValueError
        the text is none, or it is too small.
    """
    try:
        value = int(text.strip())
    except ValueError:
        value = least - 1
    if value < least:
        raise ValueError(f"{what}: '{text}': expected a whole number from {least} on; correct it")
    return value


def _image(text: str) -> Path:
    if not text.strip():
        raise ValueError(
            "firmware image: nothing is given: expected the path of an ELF file, such as "
            "build/firmware/servo_an386.elf, which script/firmware makes"
        )
    return Path(text.strip()).expanduser()


def command(settings: LiveSettings) -> str:
    """Returns the command that does the same; "" without a board, because there is none."""
    if settings.target == HERE:
        return ""
    scale = 1e-3 if settings.position_control else 1.0
    amplitude = number(settings.amplitude, "amplitude", "V or mm", optional=True)
    bandwidth = number(settings.bandwidth_hz, "bandwidth", "Hz", optional=True)
    words = ["ehsid", "hil"]
    if settings.target == IMAGE:
        words += ["--qemu", settings.image.strip(), "--machine", settings.machine]
    else:
        words += ["--port", settings.port.strip(), "--baud", settings.baud.strip()]
    if settings.rig.strip():
        words += ["--rig", settings.rig.strip()]
    for effect in settings.effects.replace(",", " ").split():
        words += ["--effect", effect]
    words += ["--loop", "position" if settings.position_control else "open"]
    words += ["--excitation", settings.signal, "--seed", settings.seed.strip()]
    words += ["--duration", f"{number(settings.duration_s, 'duration', 's'):.12g}"]
    words += ["--dt", f"{1e-3 * number(settings.dt_ms, 'sampling time', 'ms'):.12g}"]
    if not math.isnan(amplitude):
        words += ["--amplitude", f"{scale * amplitude:.12g}"]
    if not math.isnan(bandwidth):
        words += ["--bandwidth", f"{bandwidth:.12g}"]
    words += ["--forgetting", settings.forgetting]
    words += [] if settings.retune else ["--no-retune"]
    words += ["--real-time"] if settings.real_time else []
    return shlex.join([*words, "--out", "hil"])


def python(settings: LiveSettings) -> str:
    """Returns the Python that does the same, without the files."""
    told: dict[str, Any] = {
        name: value
        for name, value in msgspec.structs.asdict(settings).items()
        if value != msgspec.structs.asdict(LiveSettings())[name]
    }
    arguments = ", ".join(f"{name}={value!r}" for name, value in told.items())
    return "\n".join(
        [
            "from contextlib import ExitStack",
            "from pathlib import Path",
            "from ehsid.workbench.live.settings import LiveSettings, read_settings",
            "from ehsid.hil.emulator import emulated",
            "from ehsid.hil.host_target import HostTarget",
            "from ehsid.hil.recording import Recording",
            "from ehsid.hil.run import run_plan",
            "from ehsid.hil.session import Session",
            "from ehsid.hil.transport import open_line",
            "from ehsid.harness.signals.simulation.run import OUTPUTS_OF",
            "",
            f"settings = LiveSettings({arguments})",
            "wanted = read_settings(settings)",
            "plan = wanted.run.plan(wanted.rig)",
            "orders = plan.configuration.estimator.orders",
            "with ExitStack() as stack:",
            "    session, port = HostTarget(), wanted.address",
            "    if wanted.image is not None:",
            "        port = stack.enter_context(emulated(wanted.image, settings.machine))",
            "    if port is not None:",
            "        session = Session(stack.enter_context(open_line(port, wanted.baud)))",
            "    made = Recording(Path('samples'), OUTPUTS_OF[plan.rig.plant], orders)",
            "    with made as recording:",
            "        run_plan(plan, session, recording, real_time=settings.real_time)",
            "",
        ]
    )

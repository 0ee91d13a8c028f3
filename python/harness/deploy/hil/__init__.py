# SPDX-License-Identifier: MIT
"""Hardware in the loop: controller and estimator run on a target, the plant on this host.

docs/hil_protocol.md describes the protocol between the two.

>>> with emulated(Path("firmware.elf")) as port, open_line(port) as line:
...     session = Session(line)
...     session.hello()
"""

from .answers import Done, Identity, Refused, Result, Safe
from .configuration import POLICIES, Configuration, ControllerSettings
from .emulator import Emulator, emulated
from .errors import BadFrame, HilError, TargetReset
from .frames import Packet, decode, encode
from .messages import VERSION, Kind, Reason, State, status_name
from .requests import Sample
from .session import Counters, Session
from .transport import Line, open_line

__all__ = [
    "POLICIES",
    "VERSION",
    "BadFrame",
    "Configuration",
    "ControllerSettings",
    "Counters",
    "Done",
    "Emulator",
    "HilError",
    "Identity",
    "Kind",
    "Line",
    "Packet",
    "Reason",
    "Refused",
    "Result",
    "Safe",
    "Sample",
    "Session",
    "State",
    "TargetReset",
    "decode",
    "emulated",
    "encode",
    "open_line",
    "status_name",
]

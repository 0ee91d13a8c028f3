# SPDX-License-Identifier: MIT
"""Hardware in the loop: controller and estimator run on a target, the plant on this host.

docs/hil_protocol.md describes the protocol between the two.

>>> with emulated(Path("firmware.elf")) as port, open_line(port) as line:
...     session = Session(line)
...     session.hello()
"""

from ehsid.harness.deploy.hil.answers import Done, Identity, Refused, Result, Safe
from ehsid.harness.deploy.hil.configuration import POLICIES, Configuration, ControllerSettings
from ehsid.harness.deploy.hil.emulator import Emulator, emulated
from ehsid.harness.deploy.hil.errors import BadFrame, HilError, TargetReset
from ehsid.harness.deploy.hil.frames import Packet, decode, encode
from ehsid.harness.deploy.hil.messages import VERSION, Kind, Reason, State, status_name
from ehsid.harness.deploy.hil.requests import Sample
from ehsid.harness.deploy.hil.session import Counters, Session
from ehsid.harness.deploy.hil.transport import Line, open_line

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

# SPDX-License-Identifier: MIT
"""Kinds of packets, states of the target and reasons, version 1 of docs/hil_protocol.md."""

from __future__ import annotations

from enum import IntEnum

import ehsid

VERSION = 1


class Kind(IntEnum):
    """Kind of a packet, its first byte."""

    HELLO = 0x01
    CONFIGURE = 0x02
    START = 0x03
    SAMPLE = 0x04
    RESUME = 0x05
    STOP = 0x06
    IDENTITY = 0x81
    DONE = 0x82
    RESULT = 0x84
    REFUSED = 0x85
    SAFE = 0x86


class State(IntEnum):
    """State of the target; its valve is open in `RUNNING` only."""

    IDLE = 0
    READY = 1
    RUNNING = 2
    SAFE = 3


class Reason(IntEnum):
    """Reason for which the target refused a request."""

    STATE = 1
    ORDER = 2
    UNKNOWN = 3
    CONFIGURATION = 4
    NOT_HELD = 5


def status_name(status: int) -> str:
    """Returns an `ehsid_status` in words, e.g. "invalid input".

    A status that only the C interface has is named by its number.
    """
    try:
        return ehsid.Status(status).name.replace("_", " ")
    except ValueError:
        return f"status {status}"

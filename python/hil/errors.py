# SPDX-License-Identifier: MIT
"""Errors of the serial line and of the target."""


class HilError(ValueError):
    """The run cannot continue; the message says what was observed and how to correct it."""


class TargetReset(HilError):  # noqa: N818 -- an event, which a run gets over
    """The target was reset during a run; `hello`, `configure` and `start` bring it back."""


class BadFrame(ValueError):  # noqa: N818 -- usual on a line: dropped, counted, asked again
    """The received bytes are not a valid packet; the message says why."""

# SPDX-License-Identifier: MIT
"""What goes wrong on the line, or at its other end."""


class HilError(ValueError):
    """The run cannot go on; the message says what was seen and how to mend it."""


class TargetReset(HilError):  # noqa: N818 -- an event, which a run gets over
    """The target has begun anew in mid-run; `hello`, `configure` and `start` take it in again."""


class BadFrame(ValueError):  # noqa: N818 -- usual on a line: dropped, counted, asked again
    """Bytes that are no packet; says why."""

# SPDX-License-Identifier: MIT
"""The one exception of this room: every problem of a rig file at once."""

from __future__ import annotations

from collections.abc import Sequence


class RigError(ValueError):
    """A rig that cannot be read, written or simulated as it is.

    Attributes
    ----------
    source
        the file, or the name of a rig made in memory.
    problems
        what is wrong, one line each: key, value, what was expected.
    """

    def __init__(self, source: object, problems: Sequence[str]) -> None:
        self.source = str(source)
        # A key in quotation marks may hold anything, line ends too: one problem stays one line.
        printable = ("".join(c if c.isprintable() else repr(c)[1:-1] for c in p) for p in problems)
        self.problems = tuple(dict.fromkeys(printable))
        lines = "".join(f"\n  {problem}" for problem in self.problems)
        super().__init__(
            f"{self.source}: {lines.strip()}"
            if len(self.problems) == 1
            else f"{self.source}: {len(self.problems)} problems{lines}"
        )

    def __reduce__(self) -> tuple[type[RigError], tuple[str, tuple[str, ...]]]:
        """From another process it comes back whole: exceptions are made again from `args` else."""
        return RigError, (self.source, self.problems)

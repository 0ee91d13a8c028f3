# SPDX-License-Identifier: MIT
"""The only exception of this package: it reports all problems of a rig file together."""

from __future__ import annotations

from collections.abc import Sequence

# More problems than this are counted in the message, not listed.
MOST_LISTED = 20


class RigError(ValueError):
    """A rig that cannot be read, written or simulated as it is.

    Attributes
    ----------
    source
        path of the rig file, or name of a rig made in memory.
    problems
        the problems, one line each: key, value, and what was expected.
    """

    def __init__(self, source: object, problems: Sequence[str]) -> None:
        self.source = str(source)
        # A quoted TOML key may contain any character, also line ends. Characters that cannot be
        # printed are escaped, so that each problem stays on one line.
        printable = ("".join(c if c.isprintable() else repr(c)[1:-1] for c in p) for p in problems)
        self.problems = tuple(dict.fromkeys(printable))
        lines = "".join(f"\n  {problem}" for problem in self.problems[:MOST_LISTED])
        if len(self.problems) > MOST_LISTED:
            lines += f"\n  and {len(self.problems) - MOST_LISTED} more"
        super().__init__(
            f"{self.source}: {lines.strip()}"
            if len(self.problems) == 1
            else f"{self.source}: {len(self.problems)} problems{lines}"
        )

    def __reduce__(self) -> tuple[type[RigError], tuple[str, tuple[str, ...]]]:
        """Keeps both arguments in pickling; by default an exception is rebuilt from `args` only."""
        return RigError, (self.source, self.problems)

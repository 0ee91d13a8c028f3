# SPDX-License-Identifier: MIT
"""What a comparison found, as data."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ehsid.harness.base.numbers import FloatArray

# The row that times are divided by: the least that a factored recursion can do.
BASE = "plain C, UD"
CPP, PYTHON = "C++", "Python"
# Number of parameters of model (16), at which most tables compare.
SHOWN_N = 6


@dataclass(frozen=True)
class Name:
    """A row of the comparison: recursion, precision, and the language it is called from."""

    text: str
    scalar: str
    language: str
    ours: bool


@dataclass(frozen=True, eq=False)
class Times:
    """Nanoseconds an update of one recursion."""

    name: Name
    level: str
    """"2" or "3" for -O2 or -O3; "" for Python."""
    n: int
    """Number of parameters."""
    ns: FloatArray
    """One value for each pass, shape (passes,)."""
    base: FloatArray
    """Those of the bare UD recursion in the same passes; empty for Python."""

    @property
    def least(self) -> float:
        """The shortest time, ns."""
        return float(self.ns.min())

    def ratios(self) -> FloatArray:
        """Quartiles of the ratio to the bare UD recursion, pass by pass."""
        return np.asarray(np.quantile(self.ns / self.base, (0.25, 0.5, 0.75)))


@dataclass(frozen=True)
class Answer:
    """Is it the answer of batch least squares?"""

    name: Name
    deviation: float
    """Largest deviation over all n, relative to the largest parameter."""
    share: float
    """The largest share of the tolerance that a deviation takes; NaN where a parameter is none."""
    own: bool
    """Whether the recursion weighs its samples by a rule of its own, so that the answer differs."""

    @property
    def right(self) -> bool:
        """Within the tolerance for every n."""
        return self.share <= 1.0


@dataclass(frozen=True, eq=False)
class Errors:
    """Error of a recursion in float against batch least squares in double, on the same samples."""

    name: Name
    times_faster: int
    """The servo of model (16) is sampled so many times as fast."""
    factor: float
    """Forgetting factor."""
    samples: FloatArray
    """Counts of samples, shape (m,)."""
    errors: FloatArray
    """Relative to the largest parameter, shape (m,); infinite where a parameter is no number."""


@dataclass(frozen=True)
class Hold:
    """How long a held input is survived."""

    name: Name
    moved: tuple[int | None, ...]
    not_finite: tuple[int | None, ...]
    """Samples until a parameter has moved by 1 % of the largest one, and until one is no number: a
    value for each seed, or None where it did not happen."""
    held: int
    """Samples that were tried."""


@dataclass
class Results:
    """All of it."""

    machine: list[str]
    """Processor, compiler, versions: one line each."""
    missing: dict[str, str]
    """Rows that are not installed, with the command that installs them."""
    control: str
    """What python-control has."""
    times: list[Times] = field(default_factory=list)
    others: dict[str, list[Times]] = field(default_factory=dict)
    """The same of SHOWN_N with other compilers, by the name of the compiler."""
    answers: list[Answer] = field(default_factory=list)
    errors: list[Errors] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)

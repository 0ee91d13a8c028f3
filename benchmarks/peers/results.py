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
    """Nanoseconds an update of one recursion.

    Attributes
    ----------
    level
        "2" or "3" for -O2 or -O3; "" for Python.
    n
        number of parameters.
    ns
        one value for each pass, shape (passes,).
    base
        those of the bare UD recursion in the same passes; empty for Python.
    """

    name: Name
    level: str
    n: int
    ns: FloatArray
    base: FloatArray

    @property
    def least(self) -> float:
        """The shortest time, ns."""
        return float(self.ns.min())

    def ratios(self) -> FloatArray:
        """Quartiles of the ratio to the bare UD recursion, pass by pass."""
        return np.asarray(np.quantile(self.ns / self.base, (0.25, 0.5, 0.75)))


@dataclass(frozen=True)
class Answer:
    """Is it the answer of batch least squares?

    Attributes
    ----------
    deviation
        largest deviation over all n, relative to the largest parameter.
    share
        the largest share of the tolerance that a deviation takes; NaN where a parameter is none.
    own
        whether the recursion weighs its samples by a rule of its own, so that the answer differs.
    """

    name: Name
    deviation: float
    share: float
    own: bool

    @property
    def right(self) -> bool:
        """Within the tolerance for every n."""
        return self.share <= 1.0


@dataclass(frozen=True, eq=False)
class Errors:
    """Error of a recursion in float against batch least squares in double, on the same samples.

    Attributes
    ----------
    times_faster
        the servo of model (16) is sampled so many times as fast.
    factor
        forgetting factor.
    samples
        counts of samples, shape (m,).
    errors
        relative to the largest parameter, shape (m,); infinite where a parameter is no number.
    """

    name: Name
    times_faster: int
    factor: float
    samples: FloatArray
    errors: FloatArray


@dataclass(frozen=True)
class Hold:
    """How long a held input is survived.

    Attributes
    ----------
    moved, not_finite
        samples until a parameter has moved by 1 % of the largest one, and until one is no number:
        a value for each seed, or None where it did not happen.
    held
        samples that were tried.
    """

    name: Name
    moved: tuple[int | None, ...]
    not_finite: tuple[int | None, ...]
    held: int


@dataclass
class Results:
    """All of it.

    Attributes
    ----------
    machine
        processor, compiler, versions: one line each.
    missing
        rows that are not installed, with the command that installs them.
    control
        what python-control has.
    """

    machine: list[str]
    missing: dict[str, str]
    control: str
    times: list[Times] = field(default_factory=list)
    answers: list[Answer] = field(default_factory=list)
    errors: list[Errors] = field(default_factory=list)
    holds: list[Hold] = field(default_factory=list)

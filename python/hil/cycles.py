# SPDX-License-Identifier: MIT
"""Cycles as a PLC has them: times that jitter, cycles that do not run, commands that come late."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from ehsid.harness.base.numbers import FloatArray

TICKS = 100
"""Ticks of the simulated machine in a sampling time; every cycle begins at a tick."""
MOST = {"jitter": 0.5, "lost": 0.5, "overrun": 1.0}
"""Largest numbers of the options. A share of 0.5 does not lose 1000 cycles in a row."""


@dataclass(frozen=True)
class CycleOptions:
    """How irregular the cycles of a run are; all zero: as regular as without the options."""

    jitter: float = 0.0
    """Largest deviation of the time of a cycle, as a share of the sampling time, 0 to 0.5."""
    lost: float = 0.0
    """Share of the cycles that do not run, 0 to 0.5."""
    overrun: float = 0.0
    """Share of the cycles whose command acts one cycle late, 0 to 1."""

    @classmethod
    def parse(cls, texts: Iterable[str]) -> CycleOptions:
        """Returns the options of texts such as "jitter=0.1".

        Raises
        ------
        ValueError
            a text has another form, or its name or number is none of the options or given twice.
        """
        names = [field.name for field in fields(cls)]
        given: dict[str, float] = {}
        for text in texts:
            name, equals, number = (part.strip() for part in text.partition("="))
            if name not in names or not equals:
                raise ValueError(
                    f"--cycles {text}: expected NAME=NUMBER, with the name {', '.join(names[:-1])} "
                    f"or {names[-1]}"
                )
            if name in given:
                raise ValueError(f"--cycles {text}: {name} is given twice; leave one of them out")
            try:
                given[name] = float(number)
            except ValueError:
                given[name] = math.nan
            if not 0.0 <= given[name] <= MOST[name]:
                raise ValueError(f"--cycles {text}: expected a number from 0 to {MOST[name]:g}")
        return cls(**given)

    def draw(self, count: int, dt_s: float, rng: np.random.Generator) -> Cycles:
        """Draws the cycles of a run, each without regard to the others.

        The first and the last one always run.

        Parameters
        ----------
        count
            number of cycles N, at least 1.
        dt_s
            sampling time, s.
        rng
            source of the random numbers.
        """
        most = math.ceil(round(self.jitter * TICKS, 6))
        ticks = TICKS + rng.integers(-most, most, count, endpoint=True)
        lost = rng.random(count) < self.lost
        lost[[0, -1]] = False
        overrun = (rng.random(count) < self.overrun) & ~lost
        return Cycles(self, dt_s, ticks, lost, overrun)


@dataclass(frozen=True, eq=False)
class Cycles:
    """The cycles of a run, numbered from 0 to N - 1."""

    options: CycleOptions
    """What they were drawn from."""
    dt_s: float
    """Sampling time, s, that controller and estimator take for the time of every cycle."""
    ticks: npt.NDArray[np.int64]
    """Ticks from the start of each cycle to that of the next, shape (N,)."""
    lost: npt.NDArray[np.bool_]
    """Whether the cycle does not run: there is no sample, and the command before is held, shape
    (N,)."""
    overrun: npt.NDArray[np.bool_]
    """Whether the command of the cycle acts only when the next cycle begins, shape (N,). The
    command of the next cycle then takes its place at once, unless that one is late or lost."""

    @property
    def durations_s(self) -> FloatArray:
        """Times of the cycles, s, shape (N,)."""
        return self.ticks.astype(np.float64) * (self.dt_s / TICKS)

    @property
    def times_s(self) -> FloatArray:
        """Starts of the cycles, s, shape (N,); the first is 0."""
        begun = np.cumsum(self.ticks) - self.ticks
        return begun.astype(np.float64) * (self.dt_s / TICKS)

    def __str__(self) -> str:
        """Says in one clause what happened."""
        shortest, longest = (1e3 * float(f(self.durations_s)) for f in (np.min, np.max))
        return (
            f"of {self.ticks.size} cycles {np.sum(self.lost)} were lost and the command of "
            f"{np.sum(self.overrun)} came late; a cycle took {shortest:.4g} to {longest:.4g} ms "
            f"with a standard deviation of {1e3 * np.std(self.durations_s):.2g} ms"
        )

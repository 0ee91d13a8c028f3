# SPDX-License-Identifier: MIT
"""Sequences of samples that an estimator should survive, and the good ones that follow them.

Each maker takes a random generator and a number of samples, and returns command and position in
scaled units. They reach up to and beyond the default `input_limit` of 1e4, and hold NaN, infinity
and denormal numbers.
"""

from __future__ import annotations

from collections.abc import Callable

import model16
import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
Pair = tuple[FloatArray, FloatArray]
Maker = Callable[[np.random.Generator, int], Pair]

HOSTILE, GOOD = 1500, 700
LIMIT = 1e4  # the default input_limit


def _random_signs(rng: np.random.Generator, n: int) -> FloatArray:
    return rng.choice([-1.0, 1.0], size=n)


def _of_the_plant(rng: np.random.Generator, u: FloatArray, noise: float = 1e-3) -> Pair:
    """What model (16) answers, cut off at the limit of what is taken."""
    y = model16.output(u, noise * np.max(np.abs(u), initial=1e-300) * rng.normal(size=u.size))
    return u, np.clip(y, -LIMIT, LIMIT)


def scale_jumps(rng: np.random.Generator, n: int) -> Pair:
    """Every 50 samples another scale, from 1e-12 to beyond the limit, in command and position."""
    scale = 10.0 ** np.repeat(rng.uniform(-12.0, 5.0, size=(2, n // 50 + 1)), 50, axis=1)[:, :n]
    u, y = scale * rng.normal(size=(2, n))
    return u, y


def large(rng: np.random.Generator, n: int) -> Pair:
    """Noise close to the limit."""
    u, y = LIMIT * rng.uniform(-1.0, 1.0, size=(2, n))
    return u, y


def large_plant(rng: np.random.Generator, n: int) -> Pair:
    """The plant itself, driven a hundred times as hard: a precise estimate of the truth."""
    return _of_the_plant(rng, 100.0 * _random_signs(rng, n))


def quiet_plant(rng: np.random.Generator, n: int) -> Pair:
    """The same, with no more noise than afterwards: what follows can only confirm it."""
    return _of_the_plant(rng, 100.0 * _random_signs(rng, n), 1e-5)


def fourfold_plant(rng: np.random.Generator, n: int) -> Pair:
    """The same, driven four times as hard."""
    return _of_the_plant(rng, 4.0 * _random_signs(rng, n))


def other_plant(rng: np.random.Generator, n: int) -> Pair:
    """A plant of first order, large and nearly without noise."""
    u = 1e3 * _random_signs(rng, n)
    y = np.zeros(n)
    for k in range(1, n):
        y[k] = 0.5 * y[k - 1] + 0.3 * u[k - 1] + rng.normal()
    return u, y


def steps(rng: np.random.Generator, n: int) -> Pair:
    """Steps of the full range at random moments."""
    u = LIMIT * _random_signs(rng, n // 30 + 1).repeat(30)[:n]
    return u, np.roll(u, 3) * rng.uniform(0.5, 1.0)


def alternating(rng: np.random.Generator, n: int) -> Pair:
    """The two ends of the range in turn."""
    u = LIMIT * (1.0 - 2.0 * (np.arange(n) % 2))
    return u, -u


def denormal(rng: np.random.Generator, n: int) -> Pair:
    """Below the smallest normal number of either precision."""
    scale = np.where(rng.uniform(size=n) < 0.5, 1e-40, 1e-310)
    return scale * rng.normal(size=n), scale * rng.normal(size=n)


def constant(rng: np.random.Generator, n: int) -> Pair:
    """Nothing moves, far from zero."""
    return np.full(n, 9e3), np.full(n, -7e3)


def zero(rng: np.random.Generator, n: int) -> Pair:
    """Nothing at all."""
    return np.zeros(n), np.zeros(n)


def ramp(rng: np.random.Generator, n: int) -> Pair:
    """Up to the limit and beyond it."""
    u = np.linspace(0.0, 1.2 * LIMIT, n)
    return u, np.roll(u, 1)


def sparse_spikes(rng: np.random.Generator, n: int) -> Pair:
    """Small noise, and here and there a spike of the full range."""
    u, y = rng.normal(size=(2, n))
    spike = rng.uniform(size=(2, n)) < 0.02
    return np.where(spike[0], LIMIT * np.sign(u), u), np.where(spike[1], LIMIT * np.sign(y), y)


def not_numbers(rng: np.random.Generator, n: int) -> Pair:
    """The plant with NaN and infinity in between, and values beyond the limit."""
    u, y = _of_the_plant(rng, 1e2 * _random_signs(rng, n))
    bad = rng.uniform(size=n) < 0.05
    return u, np.where(bad, rng.choice([np.nan, np.inf, -np.inf, 1e300, 1e30, 2e4], size=n), y)


def rank_deficient(rng: np.random.Generator, n: int) -> Pair:
    """Position proportional to the command of the sample before: no more than three directions."""
    u = 1e3 * np.repeat(rng.normal(size=n // 7 + 1), 7)[:n]
    return u, 2.0 * np.roll(u, 1)


def periodic(rng: np.random.Generator, n: int) -> Pair:
    """A sine: two directions."""
    phase = 2.0 * np.pi * np.arange(n) / 40.0
    return 1e3 * np.sin(phase), 5e3 * np.sin(phase - 1.0)


def growing(rng: np.random.Generator, n: int) -> Pair:
    """An oscillation that grows from nothing to the limit."""
    envelope = np.geomspace(1e-8, LIMIT, n)
    return envelope * np.sin(np.arange(n)), envelope * np.cos(0.9 * np.arange(n))


CATALOGUE: dict[str, Maker] = {
    maker.__name__: maker
    for maker in (
        *(scale_jumps, large, large_plant, quiet_plant, fourfold_plant, other_plant, steps),
        *(
            alternating,
            denormal,
            constant,
            zero,
            ramp,
            sparse_spikes,
            not_numbers,
            rank_deficient,
            periodic,
        ),
        growing,
    )
}


def mixture(rng: np.random.Generator, n: int) -> Pair:
    """Pieces of the catalogue, of random lengths and scales, one behind the other."""
    pieces: list[Pair] = []
    missing = n
    while missing > 0:
        length = min(missing, int(rng.integers(20, 400)))
        maker = CATALOGUE[rng.choice(list(CATALOGUE))]
        scale = 10.0 ** rng.uniform(-3.0, 1.0, size=2)
        u, y = maker(rng, max(length, 60))
        pieces.append((scale[0] * u[:length], scale[1] * y[:length]))
        missing -= length
    u = np.concatenate([piece[0] for piece in pieces])
    y = np.concatenate([piece[1] for piece in pieces])
    return u, y


def good(rng: np.random.Generator, n: int = GOOD) -> Pair:
    """Random signs through model (16), with 1e-3 of noise."""
    u = _random_signs(rng, n)
    return u, model16.output(u, 1e-3 * rng.normal(size=n))


def hostile_then_good(name: str, seed: int, hostile: int = HOSTILE) -> Pair:
    """`hostile` samples of the catalogue, or of "mixture", and GOOD good ones behind them."""
    rng = np.random.default_rng(seed)
    first = (mixture if name == "mixture" else CATALOGUE[name])(rng, hostile)
    second = good(rng)
    return np.concatenate((first[0], second[0])), np.concatenate((first[1], second[1]))

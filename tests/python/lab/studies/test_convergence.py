# SPDX-License-Identifier: MIT
"""A start from the offline model shortens convergence; the numbers of docs/evidence/export.md."""

from typing import Any

import numpy as np
import pytest

import ehsid
from ehsid.lab.studies.verdicts import B, compare_starts

pytestmark = pytest.mark.slow

SEEDS = range(200)
# Quiet, and that of the published fit: its loss, 0.0228, is the variance.
NOISES = (0.01, 0.151)


def medians(
    forgetting: ehsid.Forgetting, noise: float, *, tolerance: float = 0.05, **more: Any
) -> tuple[float, float, float]:
    """Median of the samples to settle, from the model and from nothing; share of runs sooner."""
    starts = compare_starts(forgetting, SEEDS, noise=noise, **more)
    seeded, vague = starts.settled(tolerance)
    return float(np.median(seeded)), float(np.median(vague)), float(np.mean(seeded < vague))


def with_wrong_model(noise: float, **more: Any) -> tuple[float, float, float]:
    """The b of the model are half of what they should be; settled is b within 10 %."""
    return medians(ehsid.FRatio(), noise, tolerance=0.1, model_b=0.5, judged=B, **more)


@pytest.mark.parametrize(
    "noise", [NOISES[0], *(pytest.param(one, marks=pytest.mark.thorough) for one in NOISES[1:])]
)
def test_a_start_from_the_model_settles_sooner(noise: float) -> None:
    seeded, vague, sooner = medians(ehsid.FRatio(), noise)
    # Measured: 0 samples against 15 and against 160 to 184, in at least 99 % of the runs. The
    # claim of the document is half; under chance the share would be 0.5 +- 0.035.
    assert seeded <= 0.5 * vague
    assert sooner > 0.9


def test_a_wrong_model_in_little_noise_is_dropped_at_once() -> None:
    seeded, vague, _ = with_wrong_model(0.01)
    # The first sample shows nothing yet, the reset fires at the fifth large error, and up to two
    # small ones lie between (test_return_after_hold.py). From then on the start is vague.
    assert seeded <= vague + 8


@pytest.mark.thorough
def test_a_wrong_model_in_much_noise_is_outvoted() -> None:
    # Its errors are 2.4 times the noise, too little for the reset.
    seeded, vague, _ = with_wrong_model(0.151)
    assert seeded > vague
    # It counts for m = 100 samples: after k new ones m / (m + k) of the error is left, a fifth
    # after k = 400, were every sample worth the same. Measured 464.
    assert 200 < seeded < 800
    starts = compare_starts(ehsid.FRatio(), SEEDS, noise=0.151, model_b=0.5, judged=B)
    assert starts.seeded[:, 0].min() > 0.4
    assert starts.seeded[:, -1].max() < 0.1  # measured 0.055


@pytest.mark.thorough
def test_more_inflation_forgives_a_wrong_model_sooner() -> None:
    samples = [with_wrong_model(0.151, inflation=f)[0] for f in (1, 10, 100)]
    assert samples == sorted(samples, reverse=True)
    assert samples[0] > 4 * samples[2]  # measured 2000 (not at all), 464, 74


def test_forgetting_that_starts_low_gives_the_start_away() -> None:
    # Eq. (15) from 0.95 keeps a product of exp(-5) of it: the medians differ by chance only, of 40
    # runs whose settling times scatter by a half, so by 0.1 of themselves.
    seeded, vague, sooner = medians(ehsid.Exponential(), 0.151)
    assert seeded > 0.9 * vague
    assert sooner < 0.5


def test_after_a_change_of_the_plant_both_return_alike() -> None:
    starts = compare_starts(ehsid.FRatio(), SEEDS, noise=0.01, change=(1000, 1.5))
    seeded, vague = starts.settled(start=1000)
    # The reset goes back to the same vague P; what differs is the last digits of theta.
    assert abs(np.median(seeded) - np.median(vague)) <= 2.0
    assert np.quantile(seeded, 0.95) < 50.0

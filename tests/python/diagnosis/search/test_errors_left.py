# SPDX-License-Identifier: MIT
"""The errors that a candidate leaves: what they grow with, and what they do not depend on."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import gap_cases as made
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_candidates import CASE, FLOOR, LIKELIHOOD, MadeCase, candidate

from ehsid.harness.diagnosis.data.floor import NoiseFloor
from ehsid.harness.diagnosis.deciding import LAPSE
from ehsid.harness.diagnosis.decision.hypotheses import posterior
from ehsid.harness.diagnosis.model.case import Case, make_case
from ehsid.harness.diagnosis.model.spectrum import BANDS
from ehsid.harness.diagnosis.search.candidates import nominal_candidate
from ehsid.harness.diagnosis.search.score import DIVERGED, above_noise, left


def test_perfect_errors_leave_nothing() -> None:
    perfect = candidate(rms=0.0)
    assert [left(CASE, perfect, data) for data in ("all", "fitted", "held out")] == [0.0, 0.0, 0.0]


@given(rms=st.floats(1e-9, 1.0))
def test_white_errors_leave_their_logarithm_over_what_is_tolerated(rms: float) -> None:
    # All bands have the same power and the same tolerance: ln(P + t) / t, half of it.
    expected = 0.5 * np.log1p((rms / FLOOR) ** 2)
    assert left(CASE, candidate(rms=rms)) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@given(
    rms=st.floats(1e-7, 1e-4),
    more=st.floats(1.01, 1e3),
    band=st.integers(0, BANDS - 1),
    window=st.integers(0, 39),
)
def test_larger_errors_leave_more(rms: float, more: float, band: int, window: int) -> None:
    before = candidate(rms=rms)
    powers = before.powers.copy()
    powers[window, 0, band] *= more
    after = replace(before, powers=powers)
    if LIKELIHOOD.counts[band] > 0.0:
        assert left(CASE, after) > left(CASE, before)
        assert left(CASE, after, "held out") > left(CASE, before, "held out")
    else:
        assert left(CASE, after) == left(CASE, before)
    # Errors on held-out data say nothing of those on the data that were fitted.
    assert left(CASE, after, "fitted") == left(CASE, before, "fitted")


@given(fitted=st.floats(1e-7, 1e-4), held_out=st.floats(1e-7, 1e-4))
def test_all_data_are_the_mean_of_both_parts(fitted: float, held_out: float) -> None:
    """Both parts have as many independent errors."""
    both = replace(candidate(rms=held_out), fit_powers=candidate(rms=fitted).powers)
    parts = [left(CASE, both, data) for data in ("fitted", "held out")]
    assert left(CASE, both) == pytest.approx(np.mean(parts), rel=1e-9)


@given(share=st.floats(0.0, 3.0))
def test_noise_counts_where_the_record_shows_it(share: float) -> None:
    """Errors that are only noise leave nothing above it; noise that motion hides may be less."""
    hidden = MadeCase()
    hidden.floors = {"position_m": NoiseFloor(FLOOR, FLOOR, FLOOR, seen=False)}
    errors = candidate(rms=share * FLOOR)
    by_noise = left(CASE, candidate(rms=FLOOR))
    assert above_noise(CASE, errors) == pytest.approx(left(CASE, errors) - by_noise, abs=1e-12)
    assert above_noise(cast(Case, cast(Any, hidden)), errors) == left(CASE, errors)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_a_simulation_that_diverges_leaves_more_than_any_other(wrong: float) -> None:
    powers = candidate("sensor_lag", rms=1e-6).powers.copy()
    powers[3, 0, 5] = wrong
    diverged = replace(candidate("sensor_lag", rms=1e-6), powers=powers)
    assert left(CASE, diverged) == DIVERGED > left(CASE, candidate(rms=1e100))
    # Its probability is a number, and so are those of the others.
    for calibrated in (candidate(rms=1e-6), replace(candidate(rms=1e-6), powers=powers)):
        found = posterior(CASE, calibrated, [diverged, candidate("transport_delay", rms=1e-7)])
        probabilities = {each.effects: each.probability for each in found.sets}
        assert sum(probabilities.values()) + found.outside == pytest.approx(1.0, abs=1e-12)
        # No more than its share of what is spread over all.
        assert probabilities[("sensor_lag",)] <= 1.001 * LAPSE / (len(probabilities) + 1)


def test_a_longer_record_of_the_same_errors_leaves_the_same() -> None:
    """Each record twice or three times: nothing new is seen."""
    fitted, held_out = (made.record(made.OFF, seed, seconds=3.0) for seed in (1, 2))
    once = make_case(made.RIG, [fitted], [held_out])
    expected = left(once, nominal_candidate(once))
    # The values of the rig are off, so that much is left.
    assert expected > 0.1
    for times in (2, 3):
        case = make_case(made.RIG, [fitted] * times, [held_out] * times)
        assert left(case, nominal_candidate(case)) == pytest.approx(expected, rel=1e-9)

# SPDX-License-Identifier: MIT
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.show.plotting import kept_samples


@given(st.integers(1, 3), st.integers(2, 4000), st.integers(10, 500), st.integers(0, 99))
def test_thinning_keeps_peaks_ends_and_order(signals: int, size: int, most: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    drawn = [rng.standard_normal(size) for _ in range(signals)]
    always = rng.integers(0, size, 3)
    kept = kept_samples(drawn, most, always)
    assert np.all(np.diff(kept) > 0)
    assert kept[0] == 0
    assert kept[-1] == size - 1
    if size > most:
        assert np.isin(always, kept).all()
    else:
        assert kept.size == size
    for signal in drawn:
        assert signal[kept].max() == signal.max()
        assert signal[kept].min() == signal.min()
    # Two of each signal in most / (2 signals) stretches, at least one; the ends, what is asked for.
    assert kept.size <= max(most, 2 * signals) + 5 + 2 * signals


def test_a_lone_peak_survives_anywhere() -> None:
    for place in range(0, 10_000, 97):
        signal = np.zeros(10_000)
        signal[place] = 1.0
        assert place in kept_samples([signal], 100)


def test_gaps_in_a_signal_are_no_peaks() -> None:
    signal = np.sin(np.arange(1000.0))
    signal[:700] = np.nan
    kept = kept_samples([signal], 50)
    assert signal[kept][~np.isnan(signal[kept])].max() == np.nanmax(signal)

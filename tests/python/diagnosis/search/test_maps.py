# SPDX-License-Identifier: MIT
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from servo_records import DT_S, RIG, made

from ehsid.harness.diagnosis.model.comparison import Compared, compare
from ehsid.harness.diagnosis.search.identifiability import after_turns, conditions
from ehsid.harness.diagnosis.search.maps import maps
from ehsid.harness.records import make_record

COMPARED = compare(made({}))
USED = COMPARED.used
OUTPUTS = ("position_m", "pressure_a_pa")
FLOORS = {"position_m": 5e-6, "pressure_a_pa": 1e4}


def errors_of(shape: np.ndarray, times: float = 20.0) -> dict[str, np.ndarray]:
    """Errors of this shape in both outputs, `times` the floor, plus noise of the floor."""
    rng = np.random.default_rng(0)
    return {
        name: FLOORS[name] * (times * shape + rng.standard_normal(shape.size)) for name in OUTPUTS
    }


def test_an_error_in_slow_motion_is_mapped_there() -> None:
    holds = conditions([COMPARED], RIG)
    slow = next(name for name in holds if name.startswith("|velocity| <"))
    rng = np.random.default_rng(1)
    mapped = maps(
        [COMPARED], errors_of(rng.standard_normal(holds[slow].size) * holds[slow]), FLOORS, RIG
    )
    shares = {regime.condition: regime for regime in mapped.regimes}
    assert shares[slow].share_of_gap.value > 0.98
    assert shares[slow].share_of_time == pytest.approx(float(np.mean(holds[slow])))
    for name, regime in shares.items():
        if name.startswith("velocity"):
            assert regime.share_of_gap.value < 0.02
    values = [regime.share_of_gap.value for regime in mapped.regimes]
    assert values == sorted(values, reverse=True)


def test_limits_of_conditions_are_written_for_people() -> None:
    load = next(name for name in conditions([COMPARED], RIG) if name.startswith("|load|"))
    assert re.fullmatch(r"\|load\| > \d+ N", load)


@pytest.mark.parametrize(("hz", "place"), [(1.0, 0), (6.0, 1), (30.0, 2), (200.0, 3)])
def test_a_tone_is_mapped_to_its_band(hz: float, place: int) -> None:
    time_s = np.arange(USED.size)[USED] * DT_S
    mapped = maps([COMPARED], errors_of(np.cos(2.0 * np.pi * hz * time_s)), FLOORS, RIG)
    shares = [band.share_of_gap.value for band in mapped.frequency]
    # A tone between two lines of a window of 0.5 s leaks into its neighbours, the slowest most.
    assert shares[place] > 0.8
    # The share of a band with noise alone may be negative, and is shown as zero.
    assert sum(shares) == pytest.approx(1.0, abs=1e-3)
    assert mapped.frequency[-1].band_hz == (50.0, 500.0)


def test_bands_end_at_nyquist() -> None:
    slow = compare(made({}, every=25))
    rng = np.random.default_rng(0)
    rows = np.count_nonzero(slow.used)
    errors = {name: FLOORS[name] * 20.0 * rng.standard_normal(rows) for name in OUTPUTS}
    mapped = maps([slow], errors, FLOORS, RIG)
    assert [band.band_hz for band in mapped.frequency] == [(0.0, 2.0), (2.0, 10.0), (10.0, 20.0)]
    # White noise: shares in proportion to the width of a band, except for the line at zero.
    assert mapped.frequency[2].share_of_gap.value == pytest.approx(0.5, abs=0.1)


def test_a_stretch_with_large_errors_is_listed() -> None:
    window = COMPARED.window[USED]
    rng = np.random.default_rng(2)
    loud = np.where((window >= 3) & (window < 8), 10.0, 1.0) * rng.standard_normal(window.size)
    (span,) = maps([COMPARED], errors_of(loud), FLOORS, RIG).time
    # Runs of five windows that overlap those with large errors exceed their share, too.
    begin, end = span.span_s
    assert begin <= 0.3 + 3 * 0.5 < 0.3 + 8 * 0.5 <= end + 1e-9
    assert span.share_of_gap > 0.98
    assert maps([COMPARED], errors_of(rng.standard_normal(window.size)), FLOORS, RIG).time == ()


def test_noise_alone_has_no_map() -> None:
    # The errors are a third below the floor: nothing is above it.
    errors = {
        name: 0.7 * FLOORS[name] * np.random.default_rng(0).standard_normal(np.count_nonzero(USED))
        for name in OUTPUTS
    }
    assert maps([COMPARED], errors, FLOORS, RIG).regimes == ()


@pytest.mark.slow
@settings(max_examples=20)
@given(
    scale=st.floats(1e-6, 1e6),
    seed=st.integers(0, 1000),
    smooth=st.integers(1, 200),
)
def test_shares_are_shares_in_any_unit(scale: float, seed: int, smooth: int) -> None:
    rng = np.random.default_rng(seed)
    shape = np.convolve(rng.standard_normal(np.count_nonzero(USED)), np.ones(smooth), "same")
    errors = errors_of(shape)
    mapped = maps([COMPARED], errors, FLOORS, RIG)
    scaled = scaled_pressure(scale)
    mapped_scaled = maps(
        [scaled],
        {**errors, "pressure_a_pa": scale * errors["pressure_a_pa"]},
        {**FLOORS, "pressure_a_pa": scale * FLOORS["pressure_a_pa"]},
        RIG,
    )
    for band, band_scaled in zip(mapped.frequency, mapped_scaled.frequency, strict=True):
        assert band.share_of_gap.value == pytest.approx(
            band_scaled.share_of_gap.value, rel=1e-6, abs=1e-9
        )
    by_sign = [
        regime
        for regime in mapped.regimes
        if regime.condition.startswith(("velocity", "|velocity|"))
    ]
    assert sum(regime.share_of_gap.value for regime in by_sign) == pytest.approx(1.0, abs=0.02)
    for share in [*mapped.regimes, *mapped.frequency]:
        estimate = share.share_of_gap
        assert 0.0 <= estimate.low <= estimate.value <= estimate.high <= 1.0


def scaled_pressure(scale: float) -> Compared:
    """The output in another unit; the record, from which the conditions follow, is unchanged."""
    outputs = dict(COMPARED.outputs)
    outputs["pressure_a_pa"] = scale * outputs["pressure_a_pa"]
    return replace(COMPARED, outputs=outputs)


def test_turns_are_those_of_a_triangle() -> None:
    up = np.arange(100.0)
    triangle = np.concatenate([up, up[::-1], up, up[::-1]])
    # Small noise turns all the time; such turns do not count.
    marked = after_turns(triangle + 1e-3 * np.random.default_rng(0).standard_normal(400), 0.05, 10)
    begins = np.flatnonzero(np.diff(marked.astype(int), prepend=0) > 0)
    np.testing.assert_allclose(begins, [99, 199, 299], atol=2)
    assert 3 * 11 <= np.count_nonzero(marked) <= 3 * 11 + 6
    assert not after_turns(np.ones(50), 0.05, 10).any()


def test_blocks_are_mapped_as_blocks() -> None:
    record = make_record({"time_s": np.arange(30_000) * DT_S, **long_columns()})
    held_out = compare(record, blocks="held out")
    numbers = held_out.window[held_out.used]
    loud = numbers == np.unique(numbers)[0]
    rng = np.random.default_rng(3)
    errors = {
        name: FLOORS[name] * (1.0 + 50.0 * loud) * rng.standard_normal(numbers.size)
        for name in OUTPUTS
    }
    mapped = maps([held_out], errors, FLOORS, RIG)
    assert sum(band.share_of_gap.value for band in mapped.frequency) == pytest.approx(1.0, abs=1e-3)
    for span in mapped.time:
        inside = np.arange(30_000) * DT_S
        inside = (inside >= span.span_s[0] - 1e-9) & (inside < span.span_s[1] - 1e-9)
        # A stretch contains held-out samples only.
        assert held_out.used[inside].all()


def long_columns() -> dict[str, np.ndarray]:
    names = ("command_v", "position_m", "pressure_a_pa", "pressure_b_pa")
    return {name: np.tile(COMPARED.record.column(name), 5) for name in names}

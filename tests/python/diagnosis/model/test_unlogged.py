# SPDX-License-Identifier: MIT
"""Whitening of errors for commands that nobody logged, against dense matrices."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.diagnosis.model.comparison import Compared, compare
from ehsid.harness.diagnosis.model.spectrum import BANDS, Spectrum
from ehsid.harness.diagnosis.model.unlogged import (
    LEAST_SINGULAR,
    NEEDLESS,
    Whitening,
    whitened,
    whitening_of,
)
from ehsid.harness.records import make_record

DT_S = 0.05
WINDOWS, LENGTH = 6, 10  # windows of half a second
COUNT = WINDOWS * LENGTH + 7
# A command acts on a pressure and on the rate of the position, and is forgotten within a window.
MEMORY = 0.5 ** np.arange(LENGTH)


def compared(blocks: str = "all") -> Compared:
    time_s = DT_S * np.arange(COUNT)
    columns = {
        "time_s": time_s,
        "command_v": np.sin(time_s),
        "position_m": 0.1 + 0.01 * np.cos(time_s),
        "pressure_a_pa": 1e6 * np.sin(time_s),
    }
    return compare(make_record(columns), skip_s=0.0, blocks=blocks)  # type: ignore[arg-type]


RECORD = compared()
SPECTRUM = Spectrum([RECORD])
BETWEEN = RECORD.record.column("command_v")


def changed(signal: FloatArray, record: Compared = RECORD) -> dict[str, FloatArray]:
    """Coefficients of what a signal, added to the command between the samples, changes."""
    pressure = np.convolve(signal, MEMORY)[: signal.size]
    position = np.cumsum(np.convolve(signal, MEMORY**2)[: signal.size])
    spectrum = Spectrum([record])
    return {
        "position_m": spectrum.transform([record.inside(position)], differences=True),
        "pressure_a_pa": spectrum.transform([record.inside(pressure)], differences=False),
    }


def made(seed: int, size: float) -> tuple[Whitening, dict[str, FloatArray], FloatArray]:
    """A whitening, what is tolerated, and the deviations of the commands."""
    rng = np.random.default_rng(seed)
    tolerated = {name: rng.uniform(0.5, 2.0, BANDS) for name in ("position_m", "pressure_a_pa")}
    deviation = size * rng.uniform(0.5, 1.0, COUNT)
    return whitening_of(RECORD, BETWEEN, deviation, changed, tolerated), tolerated, deviation


def of_window(coefficients: Mapping[str, FloatArray], window: int) -> FloatArray:
    return np.concatenate([SPECTRUM.in_windows(rows)[0][window] for rows in coefficients.values()])


@given(seed=st.integers(0, 10**6), size=st.floats(0.01, 10.0))
def test_what_is_whitened_has_the_variance_that_is_tolerated(seed: int, size: float) -> None:
    """Errors of variance V + J diag(s^2) J' have V afterwards, but for what is left out on purpose.

    Directions of a singular value below LEAST_SINGULAR are left as they are, and commands with
    NEEDLESS of the power: the variance may be larger by these two, and is never smaller.
    """
    whitening, tolerated, deviation = made(seed, size)
    window = 3
    each = [changed(np.where(np.arange(COUNT) == k, s, 0.0)) for k, s in enumerate(deviation)]
    jacobian = np.stack([of_window(one, window) for one in each], axis=1)
    v = of_window({name: SPECTRUM.spread(power) for name, power in tolerated.items()}, window)
    variance = np.diag(v) + jacobian @ jacobian.T
    rows = np.eye(v.size)
    ends = [whitening.scales["position_m"].size]
    split = dict(zip(tolerated, np.split(rows, ends), strict=True))
    only = {
        name: np.repeat(block[np.newaxis], WINDOWS, axis=0)[: whitening.less.shape[0]]
        for name, block in split.items()
    }
    matrix = np.concatenate([block[window] for block in whitening.applied(only).values()])
    found = matrix @ variance @ matrix.T / np.sqrt(np.outer(v, v))
    eigenvalues = scipy.linalg.eigvalsh(found)
    assert eigenvalues.min() > 1.0 - 1e-9
    forgotten = (
        NEEDLESS * float(np.sum(deviation**2)) * np.linalg.norm(jacobian / deviation, 2) ** 2
    )
    assert eigenvalues.max() < 1.0 + LEAST_SINGULAR**2 + forgotten / v.min()


def test_an_error_that_no_command_can_cause_stays_and_one_that_a_command_causes_goes() -> None:
    whitening, tolerated, deviation = made(1, 30.0)
    k = 3 * LENGTH + 4
    caused = changed(np.where(np.arange(COUNT) == k, deviation[k], 0.0))
    after = whitened(SPECTRUM, [whitening], caused)
    scale = {name: np.sqrt(SPECTRUM.spread(power)) for name, power in tolerated.items()}
    before_size, after_size = (
        np.linalg.norm(np.concatenate([each[name] / scale[name] for name in scale]))
        for each in (caused, after)
    )
    # An error of one deviation of the command counts as one deviation of the errors at the most.
    assert before_size > 20.0
    assert after_size < 2.0
    # A direction of the errors of one window that no command has
    free = scipy.linalg.null_space(whitening.directions[2].T)[:, 0]
    rows = {name: np.zeros_like(rows) for name, rows in caused.items()}
    ends = [whitening.scales["position_m"].size]
    for (name, scale_of), part in zip(whitening.scales.items(), np.split(free, ends), strict=True):
        SPECTRUM.in_windows(rows[name])[0][2][:] = part * scale_of
    kept = whitened(SPECTRUM, [whitening], rows)
    for name in rows:
        assert np.abs(rows[name]).max() > 1e-3
        np.testing.assert_allclose(kept[name], rows[name], atol=1e-12)


def test_blocks_have_the_whitening_of_their_windows() -> None:
    whitening, _, _ = made(3, 5.0)
    rng = np.random.default_rng(4)
    signal = rng.standard_normal(COUNT)
    whole = whitened(SPECTRUM, [whitening], changed(signal))
    in_all = {name: SPECTRUM.in_windows(rows)[0] for name, rows in whole.items()}
    for blocks in ("fit", "held out"):
        record = compared(blocks)
        spectrum = Spectrum([record])
        found = whitened(spectrum, [whitening.of(record)], changed(signal, record))
        numbers = np.unique(record.window[record.used])[: record.full_windows[0]]
        assert 0 < numbers.size < WINDOWS
        for name, rows in found.items():
            np.testing.assert_allclose(
                spectrum.in_windows(rows)[0],
                in_all[name][np.searchsorted(whitening.numbers, numbers)],
            )


@pytest.mark.parametrize("columns", [1, 3])
def test_sensitivities_are_whitened_as_errors_are(columns: int) -> None:
    whitening, _, _ = made(5, 5.0)
    rng = np.random.default_rng(6)
    many = {
        name: rng.standard_normal((rows.size, columns))
        for name, rows in changed(np.zeros(COUNT)).items()
    }
    together = whitened(SPECTRUM, [whitening], many)
    for column in range(columns):
        alone = whitened(
            SPECTRUM, [whitening], {name: rows[:, column] for name, rows in many.items()}
        )
        for name in many:
            np.testing.assert_allclose(together[name][:, column], alone[name])


def test_a_command_that_rests_leaves_all_errors_as_they_are() -> None:
    tolerated = {name: np.ones(BANDS) for name in ("position_m", "pressure_a_pa")}
    whitening = whitening_of(RECORD, BETWEEN, np.zeros(COUNT), changed, tolerated)
    errors = changed(np.random.default_rng(7).standard_normal(COUNT))
    after = whitened(SPECTRUM, [whitening], errors)
    for name, rows in errors.items():
        np.testing.assert_array_equal(after[name], rows)

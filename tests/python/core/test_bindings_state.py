# SPDX-License-Identifier: MIT
"""Nothing bad gets into the state."""

import math

import model16
import numpy as np
import policies
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import ehsid

Status = ehsid.Status
DTYPES = ("float32", "float64")
BAD = (math.nan, math.inf, -math.inf)
NAMES = st.sampled_from(policies.NAMES)
PRECISIONS = st.sampled_from(DTYPES)


def make(name: str, dtype: str) -> ehsid.ArxEstimator:
    return ehsid.ArxEstimator(3, 3, 1, forgetting=policies.PAIRS[name].compiled, dtype=dtype)


def make_rls(name: str, dtype: str) -> ehsid.Rls:
    return ehsid.Rls(6, forgetting=policies.PAIRS[name].compiled, dtype=dtype)


@given(name=NAMES, dtype=PRECISIONS, data=st.data())
def test_recursion_keeps_every_bit_when_it_refuses(
    name: str, dtype: str, data: st.DataObject
) -> None:
    u, y = model16.signals(data.draw(st.integers(0, 1000)), 203)
    phi, y = model16.regressors(u, y)
    rls, undisturbed = make_rls(name, dtype), make_rls(name, dtype)
    huge = math.sqrt(float(np.finfo(dtype).max)) * 1e3  # finite, its square is not
    for k in range(200):
        if k % 20 == 7:
            row, right = phi[k].copy(), float(y[k])
            at, value = data.draw(st.integers(0, 6)), data.draw(st.sampled_from((*BAD, huge)))
            if at == 6:
                right = value
            else:
                row[at] = value
            before = rls.save()
            status = rls.update(row, right)
            expected = Status.numerical_limit if value == huge else Status.invalid_input
            assert status == expected
            assert ehsid.is_error(status)
            assert rls.save() == before
        assert rls.update(phi[k], y[k]) == undisturbed.update(phi[k], y[k])
    assert rls.save() == undisturbed.save()


@pytest.mark.slow
@given(name=NAMES, dtype=PRECISIONS, seed=st.integers(0, 1000))
def test_finite_samples_of_any_size_leave_a_usable_estimate(
    name: str, dtype: str, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    most = math.log10(float(np.finfo(dtype).max)) - 1.0
    phi, y = rng.normal(size=(300, 6)), rng.normal(size=300)
    wild = rng.random(phi.shape) < 0.05
    phi[wild] *= 10.0 ** rng.uniform(-most, most, size=np.count_nonzero(wild))
    y[::11] *= 10.0 ** rng.uniform(-most, most, size=y[::11].size)
    rls = make_rls(name, dtype)
    before = rls.save()
    for k in range(300):
        if ehsid.is_error(rls.update(phi[k], y[k])):
            assert rls.save() == before
        before = rls.save()
        assert np.isfinite(rls.theta_hat).all()
        assert np.isfinite(rls.P).all()
        assert (np.diag(rls.P) > 0.0).all()


@given(name=NAMES, dtype=PRECISIONS, bad_rows=st.sets(st.integers(0, 199), max_size=12))
@settings(max_examples=50)
def test_estimator_rests_on_a_bad_sample_and_fills_anew(
    name: str, dtype: str, bad_rows: set[int]
) -> None:
    u, y = (x.astype(dtype) for x in model16.signals(1, 200))
    estimator = make(name, dtype)
    gap = 0
    for k in range(200):
        if k in bad_rows:
            before = policies.bits(estimator)
            value = (*BAD, 1e5, -3e38)[k % 5]
            sample = (value, y[k]) if k % 2 else (u[k], value)
            expected = Status.out_of_range if math.isfinite(value) else Status.invalid_input
            assert estimator.step(*sample) == expected
            assert policies.bits(estimator) == before
            gap = 0
            continue
        status = estimator.step(u[k], y[k])
        assert (status == Status.filling) == (gap < 3)
        gap += 1

# SPDX-License-Identifier: MIT
"""Nothing bad gets into the state, and the state can be carried elsewhere."""

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


def make(name: str, dtype: str) -> ehsid.ServoEstimator:
    return ehsid.ServoEstimator(3, 3, 1, forgetting=policies.PAIRS[name].compiled, dtype=dtype)


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


@given(name=NAMES, dtype=PRECISIONS, cut=st.integers(0, 250))
def test_restored_estimator_resumes_bit_for_bit(name: str, dtype: str, cut: int) -> None:
    u, y = model16.signals(2, 500)
    first, second = make(name, dtype), make(name, dtype)
    first.run(u[:cut], y[:cut])
    second.run(y[:100], u[:100])  # something else before
    second.restore(first.save())
    assert policies.bits(first) == policies.bits(second)
    assert policies.same_bits(first.run(u[cut:], y[cut:]), second.run(u[cut:], y[cut:]))
    assert first.save() == second.save()

    phi, right = model16.regressors(u, y)
    alone, other = make_rls(name, dtype), make_rls(name, dtype)
    alone.run(phi[:cut], right[:cut])
    other.restore(alone.save())
    assert policies.same_bits(alone.run(phi[cut:], right[cut:]), other.run(phi[cut:], right[cut:]))


def test_switched_off_and_reset_are_part_of_the_state() -> None:
    u, y = model16.signals(3, 600)
    b = np.where(np.arange(600) < 400, 1.0, -1.0)
    estimator = make("constant", "float64")
    estimator.run(u, model16.output(b * u, np.zeros(600)) + 1e-3 * y)
    estimator.enabled = False
    copy = make("constant", "float64")
    copy.restore(estimator.save())
    assert not copy.enabled
    assert copy.resets == estimator.resets > 0
    assert copy.excitation == estimator.excitation


def test_a_state_fits_only_its_own_kind() -> None:
    kinds: list[ehsid.Rls | ehsid.ServoEstimator] = []
    for name in policies.NAMES:
        for dtype in DTYPES:
            with_policy = {"forgetting": policies.PAIRS[name].compiled, "dtype": dtype}
            kinds += [ehsid.Rls(n, **with_policy) for n in range(1, 14)]
            for orders in ((3, 3, 1), (3, 3, 2), (2, 4, 1), (4, 2, 1)):
                kinds.append(ehsid.ServoEstimator(*orders, **with_policy))
            kinds.append(ehsid.ServoEstimator(3, 2, 1, offset=True, **with_policy))
    states = [estimator.save() for estimator in kinds]
    for i, estimator in enumerate(kinds):
        for j, state in enumerate(states):
            if i == j:
                estimator.restore(state)
                continue
            with pytest.raises(ValueError, match=r"restore: .* nothing was changed"):
                estimator.restore(state)
        assert estimator.save() == states[i]


@settings(max_examples=300)
@given(
    name=NAMES,
    dtype=PRECISIONS,
    recursion=st.booleans(),
    damage=st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=4),
)
def test_damaged_bytes_are_refused_or_harmless(
    name: str, dtype: str, recursion: bool, damage: list[tuple[int, int]]
) -> None:
    u, y = model16.signals(4, 400)
    phi, right = model16.regressors(u, y)
    estimator = make_rls(name, dtype) if recursion else make(name, dtype)
    estimator.run(phi, right) if recursion else estimator.run(u, y)
    good = estimator.save()
    bytes_ = bytearray(good)
    for at, value in damage:
        bytes_[at % len(good)] = value
    try:
        estimator.restore(bytes(bytes_))
    except ValueError:
        assert estimator.save() == good
        return
    path = estimator.run(phi, right) if recursion else estimator.run(u, y)
    assert np.isfinite(path.theta).all()


@given(st.binary(max_size=4000))
def test_noise_is_no_state(noise: bytes) -> None:
    estimator, rls = make("f_ratio", "float32"), make_rls("f_ratio", "float32")
    for one in (estimator, rls):
        before = one.save()
        with pytest.raises(ValueError, match="restore"):
            one.restore(noise)
        with pytest.raises(ValueError, match="restore"):
            one.restore(before[:-1])
        with pytest.raises(ValueError, match="restore"):
            one.restore(before + b"\0")
        assert one.save() == before


def test_window_positions_are_checked() -> None:
    """f_ratio.hpp keeps where to write next: outside the window it would be another's memory."""
    rls = make_rls("f_ratio", "float32")
    good = rls.save()
    refused = 0
    for at in range(0, len(good), 4):
        # As an integer far outside any window, as a float32 a denormal number: finite, positive.
        damaged = good[:at] + (10**6).to_bytes(4, "little") + good[at + 4 :]
        try:
            rls.restore(damaged)
        except ValueError:
            refused += 1
        else:
            rls.restore(good)
    # Four words that say of what the state is, six factors that must be normal numbers, the
    # critical ratio that must be one at least; and two positions and the count of samples.
    assert refused == 4 + 6 + 1 + 3

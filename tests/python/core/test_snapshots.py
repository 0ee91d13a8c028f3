# SPDX-License-Identifier: MIT
"""A saved state can be carried elsewhere; what is not exactly of the same estimator is refused."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from typing import Any

import model16
import numpy as np
import policies
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid

DTYPES = ("float32", "float64")
NAMES = st.sampled_from(policies.NAMES)
PRECISIONS = st.sampled_from(DTYPES)
HEADER = struct.Struct("<IHHHHHHHII")  # docs/linking.md
ESTIMATOR = 0x45485331
RLS = 0x524C5331
Estimator = ehsid.ArxEstimator | ehsid.Rls

DAMAGED = "damaged or incomplete"
OTHER_CONFIGURATION = "another configuration"
OTHER_VERSION = "another version of ehsid"
NO_STATE = "not a saved state of this class"


def make(name: str, dtype: str, **options: Any) -> ehsid.ArxEstimator:
    given = {"forgetting": policies.PAIRS[name].compiled, "dtype": dtype} | options
    return ehsid.ArxEstimator(3, 3, 1, **given)


def make_rls(name: str, dtype: str, **options: Any) -> ehsid.Rls:
    given = {"forgetting": policies.PAIRS[name].compiled, "dtype": dtype} | options
    return ehsid.Rls(6, **given)


def run(estimator: Estimator, seed: int = 4) -> Estimator:
    u, y = model16.signals(seed, 300)
    if isinstance(estimator, ehsid.Rls):
        estimator.run(*model16.regressors(u, y))
    else:
        estimator.run(u, y)
    return estimator


def refuses(estimator: Estimator, state: bytes, reason: str = "") -> bool:
    """Refuses the state for this reason, in a sentence, and has not changed?"""
    before = estimator.save()
    with pytest.raises(ValueError, match=f"restore: .*{reason}.*; nothing was changed"):
        estimator.restore(state)
    return estimator.save() == before


def forged(state: bytes) -> bytes:
    return state[:-4] + struct.pack("<I", zlib.crc32(state[:-4]))


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


@pytest.mark.slow
def test_a_state_fits_only_its_own_kind() -> None:
    kinds: list[ehsid.Rls | ehsid.ArxEstimator] = []
    for name in policies.NAMES:
        for dtype in DTYPES:
            with_policy = {"forgetting": policies.PAIRS[name].compiled, "dtype": dtype}
            kinds += [ehsid.Rls(n, **with_policy) for n in range(1, 14)]
            for orders in ((3, 3, 1), (3, 3, 2), (2, 4, 1), (4, 2, 1)):
                kinds.append(ehsid.ArxEstimator(*orders, **with_policy))
            kinds.append(ehsid.ArxEstimator(3, 2, 1, offset=True, **with_policy))
    states = [estimator.save() for estimator in kinds]
    for i, estimator in enumerate(kinds):
        for j, state in enumerate(states):
            if i == j:
                estimator.restore(state)
                continue
            with pytest.raises(ValueError, match=r"restore: .* nothing was changed"):
                estimator.restore(state)
        assert estimator.save() == states[i]


def test_damage_and_other_versions_are_told_apart() -> None:
    """That every flipped bit and every other length is found, tests/cpp/test_snapshot.cpp shows."""
    for estimator in (make("constant", "float32"), make_rls("constant", "float32")):
        good = estimator.save()
        assert refuses(estimator, good[:5], NO_STATE)
        assert refuses(estimator, good[:-1], DAMAGED)
        assert refuses(estimator, good[:-1] + bytes([good[-1] ^ 1]), DAMAGED)
        assert refuses(estimator, forged(good + b"\0"), DAMAGED)
        other = good[:4] + struct.pack("<H", 5) + good[6:]
        assert refuses(estimator, other, OTHER_VERSION)
        assert refuses(estimator, forged(other), OTHER_VERSION)


def test_other_classes_are_refused() -> None:
    one, other = make("constant", "float32"), make_rls("constant", "float32")
    assert refuses(one, other.save(), NO_STATE)
    assert refuses(other, one.save(), NO_STATE)


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("name", policies.NAMES)
def test_other_configurations_are_refused(name: str, dtype: str) -> None:
    """Each setting of a recursion alone; tests/cpp/test_snapshot.cpp has those of an estimator."""
    policy = policies.PAIRS[name].compiled
    changed: list[dict[str, Any]] = [
        {"options": ehsid.RlsOptions(information_margin=0.5)},
        {"options": ehsid.RlsOptions(covariance_ceiling=2.0)},
        {"variance0": [1e6] * 5 + [1e5]},
        {"theta0": [0.0] * 5 + [1.0]},
    ]
    settings = {s.name: getattr(policy, s.name) for s in policy.info.settings}
    for key, value in settings.items():
        other = (np.asarray(value) * 0.875 + 0.09375).tolist()
        changed.append({"forgetting": type(policy)(**(settings | {key: other}))})
    recursion = run(make_rls(name, dtype))
    for options in changed:
        other = make_rls(name, dtype, **options).save()
        assert refuses(recursion, other, OTHER_CONFIGURATION), options
    # Where an estimator started no longer matters: nothing goes back to theta0.
    estimator = run(make(name, dtype))
    estimator.restore(make(name, dtype, theta0=[0.5] * 6).save())
    with_limit = make(name, dtype, input_limit=100.0)
    assert refuses(estimator, with_limit.save(), OTHER_CONFIGURATION)


@pytest.mark.parametrize("dtype", DTYPES)
def test_layout_is_the_documented_one(dtype: str) -> None:
    """Read by hand, as docs/linking.md has it: ARX(3, 3, 1), constant factor."""
    u, y = model16.signals(3, 200)
    estimator = make("constant", dtype, reset=ehsid.RmseResetOptions(cool_down=7))
    estimator.run(u, y)
    estimator.enabled = False
    state = estimator.save()
    assert struct.unpack("<I", state[-4:])[0] == zlib.crc32(state[:-4])
    kind = np.dtype(dtype)
    header = HEADER.unpack_from(state)
    assert header[:9] == (ESTIMATOR, 4, kind.itemsize, 1, 3, 3, 1, 0, len(state))
    numbers = 5 * 6 + 15 + 10
    assert len(state) == (
        HEADER.size + 1 + kind.itemsize * (numbers + 3 + 4 + 3 + 22) + 4 * 8 + 3 + 4
    )
    assert state[HEADER.size] == 0  # switched off
    at = HEADER.size + 1
    theta = np.frombuffer(state, kind.newbyteorder("<"), 6, at)
    assert (theta == estimator.theta_hat).all()
    d = np.frombuffer(state, kind.newbyteorder("<"), 6, at + 12 * kind.itemsize)
    assert d[5] == estimator.P[5, 5]  # the last one stands alone in P = U D U'
    past = np.frombuffer(state, kind.newbyteorder("<"), 7, at + numbers * kind.itemsize)
    assert (past[:3] == y[:-4:-1].astype(kind)).all()
    assert (past[3:] == u[:-5:-1].astype(kind)).all()
    filled = struct.unpack_from("<i", state, at + (numbers + 7) * kind.itemsize)[0]
    assert filled == 3
    assert HEADER.unpack_from(make_rls("constant", dtype).save())[0] == RLS


@given(
    name=NAMES,
    dtype=PRECISIONS,
    kind=st.sampled_from([make, make_rls]),
    damage=st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), min_size=1, max_size=4),
)
def test_a_forged_state_is_refused_or_harmless(
    name: str,
    dtype: str,
    kind: Callable[[str, str], Estimator],
    damage: list[tuple[int, int]],
) -> None:
    """With a right checksum behind other bytes."""
    estimator = run(kind(name, dtype))
    good = estimator.save()
    bytes_ = bytearray(good)
    for at, value in damage:
        bytes_[HEADER.size + at % (len(good) - HEADER.size)] = value
    try:
        estimator.restore(forged(bytes(bytes_)))
    except ValueError:
        assert estimator.save() == good
        return
    run(estimator)
    assert np.isfinite(estimator.theta_hat).all()


@given(st.binary(max_size=4000))
def test_noise_is_no_state(noise: bytes) -> None:
    for one in (make("f_ratio", "float32"), make_rls("f_ratio", "float32")):
        assert refuses(one, noise, "")


@pytest.mark.parametrize("kind", [make, make_rls])
def test_window_positions_are_checked(kind: Callable[[str, str], Estimator]) -> None:
    """f_ratio.hpp keeps where to write next: outside the window it would be another's memory."""
    estimator = run(kind("f_ratio", "float32"))
    good = estimator.save()
    # short window: 10 numbers, sum, position; long window: 100 numbers, sum, position; samples
    seen = struct.pack("<i", 100)
    positions = 4 * np.array([11, 113, 114])
    windows = next(
        start
        for start in range(HEADER.size, len(good) - 460)
        if good[start + 456 : start + 460] == seen
        and 0 <= struct.unpack_from("<i", good, start + 44)[0] < 10
        and 0 <= struct.unpack_from("<i", good, start + 452)[0] < 100
    )
    for position, size in zip(windows + positions, (10, 100, 101), strict=True):
        for outside in (-1, size, 10**6, 2**31 - 1):
            damaged = good[:position] + struct.pack("<i", outside) + good[position + 4 :]
            assert refuses(estimator, forged(damaged), "no estimator has such a state")

# SPDX-License-Identifier: MIT
"""benchmarks/peers: that its checks see who is wrong and who is missing. No times."""

import sys
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from sources import ROOT

FOLDER = ROOT / "benchmarks" / "peers"


@pytest.fixture(autouse=True, scope="module")
def modules_of_the_comparison() -> Iterator[None]:
    """Its modules stand beside its program, as scripts do."""
    sys.path.insert(0, str(FOLDER))
    yield
    sys.path.remove(str(FOLDER))


def answers(peers: Any, n: int = 4) -> dict[str, Any]:
    from checking import from_python, judge
    from series import easy_series

    found = from_python(peers, easy_series(n, 400, seed=n), 0.99, 1e4)
    return {one.name.text: one for one in judge(found)}


def test_recursions_that_are_installed_find_the_same_parameters() -> None:
    from python_peers import PEERS

    found = answers(PEERS)
    assert {peer.name for peer in PEERS if not peer.missing} == set(found)
    assert len(found) >= 4, "ours, numpy, and padasip, which the tests need anyway"
    assert [name for name, one in found.items() if not one.right] == []


def test_a_recursion_that_forgets_to_forget_is_wrong() -> None:
    from python_peers import PEERS, NumpyTextbook, PythonPeer

    def never_forgets(n: int, factor: float, variance0: float) -> NumpyTextbook:
        return NumpyTextbook(n, 1.0, variance0)

    def never_started(n: int, factor: float, variance0: float) -> NumpyTextbook:
        return NumpyTextbook(n, factor, np.nan)

    wrong = [PythonPeer("never forgets", start=never_forgets)]
    wrong += [PythonPeer("never started", start=never_started)]
    with np.errstate(invalid="ignore"):
        found = answers([*wrong, *(peer for peer in PEERS if peer.ours)])
    assert not found["never forgets"].right
    assert found["never forgets"].deviation > 1e-3
    assert not found["never started"].right
    assert all(one.right for one in found.values() if one.name.ours)


def test_a_library_that_is_not_installed_is_a_row() -> None:
    from python_peers import PEERS, PythonPeer
    from results import PYTHON, SHOWN_N, Name, Results, Times
    from tables import python_table

    absent = PythonPeer("of nobody", "no-such-distribution", start=PEERS[2].start)
    assert absent.missing == "python -m pip install no-such-distribution"
    assert answers([absent]) == {}
    results = Results(["machine"], {absent.name: absent.missing}, "has none")
    name = Name("numpy", "double", PYTHON, False)
    one = Times(name, "", SHOWN_N, np.array([50.0]), np.array([]))
    bare = replace(one, name=replace(name, text="plain C, UD", language="C++"), level="2")
    results.times = [one, bare]
    rows = {row[0]: list(row[1:]) for row in python_table(results).rows}
    assert rows["of nobody"][0] == f"not installed: {absent.missing}"
    assert rows["numpy"] == ["50.0", "1"]
    assert rows["python-control"][0] == "has none"


def test_libraries_that_the_program_was_built_without_are_told() -> None:
    from native import missing

    found = missing([{"name": "dlib rls"}, {"name": "dlib rls, not regularised"}])
    assert found == {"liquid-dsp eqrls_rrrf": "apt-get install libliquid-dev"}


def test_a_held_input_is_seen_to_move_the_textbook() -> None:
    from measuring import hold_in_python
    from python_peers import PEERS

    textbook = next(peer for peer in PEERS if peer.name.startswith("numpy"))
    moved, not_finite = hold_in_python(textbook, seed=1, held=1500)
    assert moved is not None
    assert 0 < moved <= 1500
    assert not_finite is None


def test_the_truth_is_the_ratio_of_sums_for_one_parameter() -> None:
    from series import batch

    rng = np.random.default_rng(3)
    phi, y = rng.normal(size=(50, 1)), rng.normal(size=50)
    weights = 0.9 ** np.arange(49, -1, -1)
    for kept, prior in ((False, 0.9**50 / 4.0), (True, 1.0 / 4.0)):
        expected = np.sum(weights * phi[:, 0] * y) / (np.sum(weights * phi[:, 0] ** 2) + prior)
        np.testing.assert_allclose(batch(phi, y, 0.9, 4.0, kept=kept), [expected], rtol=1e-12)


def test_the_servo_of_model_16_sampled_faster_is_the_same_servo() -> None:
    from series import A16, B16, sampled_faster

    a, b = sampled_faster(10)
    np.testing.assert_allclose(b.sum() / (1.0 + a.sum()), B16.sum() / (1.0 + A16.sum()), rtol=1e-6)
    poles = np.sort_complex(np.roots(np.concatenate(([1.0], a))) ** 10)
    np.testing.assert_allclose(poles, np.sort_complex(np.roots([1.0, *A16])), atol=1e-6)

# SPDX-License-Identifier: MIT
"""Bad arguments: an error that names the argument, and nothing changed."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import ehsid

NAN, INF = math.nan, math.inf
Make = Callable[[], object]


def cases(*entries: tuple[str, Make, str]) -> pytest.MarkDecorator:
    """Parametrise over (name, call, words the message must hold)."""
    return pytest.mark.parametrize(
        ("call", "words"), [pytest.param(call, words, id=name) for name, call, words in entries]
    )


@cases(
    ("na=0", lambda: ehsid.ArxEstimator(0, 1, 1), "na must be in 1..6, got 0"),
    ("na=7", lambda: ehsid.ArxEstimator(7, 1, 1), "na must be in 1..6, got 7"),
    ("nb=0", lambda: ehsid.ArxEstimator(1, 0, 1), "nb must be in 1..6, got 0"),
    ("nb=7", lambda: ehsid.ArxEstimator(1, 7, 1), "nb must be in 1..6, got 7"),
    ("nk=-1", lambda: ehsid.ArxEstimator(1, 1, -1), "nk must be in 0..20, got -1"),
    ("nk=21", lambda: ehsid.ArxEstimator(1, 1, 21), "nk must be in 0..20, got 21"),
    ("n=0", lambda: ehsid.Rls(0), "n must be in 1..13, got 0"),
    ("n=14", lambda: ehsid.Rls(14), "n must be in 1..13, got 14"),
    ("int", lambda: ehsid.Rls(2, dtype=int), "dtype must be float32 or float64, got int64"),
    ("half", lambda: ehsid.Rls(2, dtype="float16"), "dtype must be float32 or float64, got float1"),
    ("no dtype", lambda: ehsid.ArxEstimator(1, 1, 1, dtype="flat"), "dtype .* got 'flat'"),
    ("theta0", lambda: ehsid.Rls(2, theta0=[1.0]), "theta0 has 1 values; expected 2"),
    ("theta0 NaN", lambda: ehsid.Rls(2, theta0=[1.0, NAN]), "theta0 must be finite"),
    ("variance0", lambda: ehsid.Rls(2, variance0=[1.0] * 3), "variance0 has 3 values; expected 2"),
    ("variance0=0", lambda: ehsid.Rls(2, variance0=[1.0, 0.0]), "variance0 finite and > 0"),
    (
        "variance0 rounds to zero",
        lambda: ehsid.Rls(1, variance0=[1e-60], dtype="float32"),
        "in the chosen precision",
    ),
    ("limit", lambda: ehsid.ArxEstimator(1, 1, 1, input_limit=0.0), "input_limit must be > 0"),
)
def test_structure_and_start_values_are_checked(call: Make, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        call()


BAD_FACTORS = (0.0, -0.5, 1.0 + 1e-9, NAN, INF, -INF)


@cases(
    *((f"Constant({x})", lambda x=x: ehsid.Constant(x), "Constant") for x in BAD_FACTORS),
    *((f"Exp({x})", lambda x=x: ehsid.Exponential(x), "Exponential") for x in BAD_FACTORS),
    *((f"Exp(., {x})", lambda x=x: ehsid.Exponential(0.9, x), "Exponential") for x in BAD_FACTORS),
    *((f"Err({x})", lambda x=x: ehsid.ErrorDriven(x), "ErrorDriven") for x in (0.9, NAN, INF)),
    *((f"Err(., {x})", lambda x=x: ehsid.ErrorDriven(9, x), "lambda_min") for x in BAD_FACTORS),
    *((f"Err(., ., {x})", lambda x=x: ehsid.ErrorDriven(9, 1, x), "noise") for x in (-1, NAN, INF)),
    *((f"F({x})", lambda x=x: ehsid.FRatio(x), "FRatio") for x in (-1e-9, NAN, INF)),
    *((f"F(., {x})", lambda x=x: ehsid.FRatio(1, x), "critical") for x in (0.999, NAN, INF)),
)
def test_parameters_of_policies_are_checked(call: Make, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        call()


@pytest.mark.parametrize(
    ("kind", "names", "values"),
    [
        (ehsid.Scaling, ("command_scale", "position_scale"), (0.0, -1.0, NAN, INF)),
        (ehsid.Scaling, ("command_offset", "position_offset"), (NAN, INF)),
        (ehsid.RlsOptions, ("information_margin",), (NAN, INF)),
        (ehsid.RlsOptions, ("covariance_ceiling",), (0.0, -1.0, NAN, INF)),
        (ehsid.RmseResetOptions, ("short_window",), (0.5, 200.0, NAN, INF)),
        (ehsid.RmseResetOptions, ("long_window",), (10.0, NAN, INF)),
        (ehsid.RmseResetOptions, ("trigger_ratio",), (1.5, NAN, INF)),
        (ehsid.RmseResetOptions, ("release_ratio",), (0.9, 3.0, NAN, INF)),
        (ehsid.RmseResetOptions, ("cool_down",), (-1,)),
        (ehsid.RmseResetOptions, ("floor",), (-1e-9, NAN, INF)),
        (ehsid.ConvergenceOptions, ("tolerance", "magnitude"), (0.0, -1.0, NAN, INF)),
        (ehsid.ConvergenceOptions, ("hold",), (0,)),
    ],
)
def test_options_are_checked(kind: Any, names: tuple[str, ...], values: tuple[float, ...]) -> None:
    for name, value in itertools.product(names, values):
        with pytest.raises(ValueError, match=kind.__name__):
            kind(**{name: value})


POLICIES = [
    (ehsid.Constant(1.0), "Constant(lambda_=1.0)"),
    (ehsid.Exponential(1.0, 0.5), "Exponential(lambda0=1.0, lambda_initial=0.5)"),
    (ehsid.ErrorDriven(1, 1, 0), "ErrorDriven(memory=1.0, lambda_min=1.0, noise_variance=0.0)"),
    (ehsid.FRatio(0.0, 1.0), "FRatio(eta=0.0, critical_ratio=1.0)"),
]


@pytest.mark.parametrize(("policy", "shown"), POLICIES)
def test_ends_of_the_ranges_are_allowed_and_shown(policy: ehsid.Forgetting, shown: str) -> None:
    assert repr(policy) == shown
    assert eval(shown, vars(ehsid)).__class__ is policy.__class__
    assert ehsid.Rls(2, forgetting=policy).update([1.0, 2.0], 3.0) == ehsid.Status.ok


def recursion() -> ehsid.Rls:
    rls = ehsid.Rls(3, dtype="float64")
    rls.run(np.eye(3), np.arange(3.0))
    return rls


def estimator() -> ehsid.ArxEstimator:
    one = ehsid.ArxEstimator(1, 1, 1)
    one.run(np.arange(5.0), np.arange(5.0) ** 2)
    return one


@pytest.mark.parametrize(
    ("make", "method", "arguments", "kind", "words"),
    [
        (recursion, "update", ([1.0, 2.0], 1.0), ValueError, r"phi has shape \(2,\), expected \(3"),
        (recursion, "update", (np.eye(3), 1.0), ValueError, r"phi has shape \(3, 3\), expected"),
        (recursion, "update", (["a", "b", "c"], 1.0), TypeError, "phi must hold real numbers"),
        (recursion, "update", ([1.0, 2.0, 3.0], "x"), TypeError, "update"),
        (recursion, "predict", ([[1.0, 2.0, 3.0]],), ValueError, "phi has shape"),
        (recursion, "run", (np.ones((4, 2)), np.ones(4)), ValueError, r"expected \(N, 3\)"),
        (recursion, "run", (np.ones(3), np.ones(3)), ValueError, r"phi .* expected \(N, 3\)"),
        (recursion, "run", (np.ones((4, 3)), np.ones(5)), ValueError, r"y .* expected \(4,\)"),
        (recursion, "run", (np.ones((4, 3)), [1j] * 4), TypeError, "y must hold .* complex128"),
        (recursion, "run", ([[1.0, 2.0], [3.0]], [1.0]), ValueError, "inhomogeneous"),
        (
            estimator,
            "run",
            (np.ones(4), np.ones(5)),
            ValueError,
            r"y has shape \(5,\), expected \(4",
        ),
        (estimator, "run", (np.ones((4, 1)), np.ones(4)), ValueError, r"u .* expected \(N,\)"),
        (estimator, "run", ("record.csv", np.ones(4)), TypeError, "u must hold real numbers"),
        (estimator, "run", ([None] * 4, np.ones(4)), TypeError, "u must hold .* object"),
        (estimator, "step", (None, 1.0), TypeError, "step"),
        (estimator, "restore", ("text",), TypeError, "restore"),
    ],
)
def test_bad_samples_name_the_argument_and_change_nothing(
    make: Callable[[], Any],
    method: str,
    arguments: tuple[Any, ...],
    kind: type[Exception],
    words: str,
) -> None:
    one = make()
    before = one.save()
    with pytest.raises(kind, match=words):
        getattr(one, method)(*arguments)
    assert one.save() == before


@pytest.mark.parametrize(
    ("theta0", "p0"),
    [
        ([0.0] * 3, np.eye(2)),
        ([0.0] * 3, np.ones((2, 3))),
        ([0.0] * 3, np.zeros((0, 3))),
        ([0.0] * 3, np.ones(3)),
        ([0.0] * 3, np.diag([1.0, -1.0, 1.0])),
        ([0.0] * 3, np.ones((3, 3))),  # rank one
        ([0.0] * 3, np.diag([1.0, NAN, 1.0])),
        ([0.0, INF, 0.0], np.eye(3)),
        ([0.0] * 2, np.eye(3)),
    ],
)
def test_bad_start_covariance_changes_nothing(theta0: list[float], p0: Any) -> None:
    rls = recursion()
    before = rls.save()
    with pytest.raises(ValueError, match=r"p0|theta0"):
        rls.start_from_covariance(theta0, p0)
    assert rls.save() == before

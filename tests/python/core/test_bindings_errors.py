# SPDX-License-Identifier: MIT
"""Settings out of their range; bad_input/arrays.py has samples and start values."""

import itertools
import math
from collections.abc import Callable
from typing import Any

import pytest

import ehsid

NAN, INF = math.nan, math.inf
Make = Callable[[], object]


def cases(*entries: tuple[str, Make, str]) -> pytest.MarkDecorator:
    """Parametrise over (name, call, words the message must hold)."""
    return pytest.mark.parametrize(
        ("call", "words"), [pytest.param(call, words, id=name) for name, call, words in entries]
    )


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

# SPDX-License-Identifier: MIT
"""Settings out of their range; bad_input/arrays.py has samples and start values."""

import itertools
import math
from typing import Any

import pytest

import ehsid

NAN, INF = math.nan, math.inf


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

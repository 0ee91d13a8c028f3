# SPDX-License-Identifier: MIT
"""Errors of estimated sizes and values, and whether their intervals contain the true ones."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.schema import Estimate
from ehsid.harness.validation.scoring.judged_case import Scored


@dataclass(frozen=True)
class SizeError:
    """Error of a parameter of an effect that was rightly named, or of a value in the rig file.

    Attributes
    ----------
    case, of, parameter
        name of the case, id of the effect ("" for a value in the rig file), and the parameter.
    primary
        whether it is the first parameter of the effect in the catalogue, which gives its size.
    relative
        |estimate - true| / |true|; infinite where only the true value is 0.
    inside
        whether the 90 % interval contains the true value.
    """

    case: str
    of: str
    parameter: str
    primary: bool
    relative: float
    inside: bool


def effect_errors(cases: Sequence[Scored]) -> tuple[SizeError, ...]:
    """Returns the errors of all parameters of the named effects whose id is that of a true one."""
    return tuple(error for case in cases for error in _of_effects(case))


def rig_errors(cases: Sequence[Scored]) -> tuple[SizeError, ...]:
    """Returns the errors of the calibrated values in the rig file.

    Two groups are left out: machines with an effect outside of the catalogue, whose values mean
    something else, and nuisances, which have no true value.
    """
    return tuple(
        _error(case.name, "", name, True, found, case.answer.true[name])
        for case in cases
        if case.answer.kind != "open"
        for name, found in case.said.calibration.items()
        if name in case.answer.true and math.isfinite(found.value)
    )


def _of_effects(case: Scored) -> Iterator[SizeError]:
    for named in case.said.named:
        true = case.answer.effects.get(named.id, {})
        for name, found in named.sizes.items():
            if name in true and math.isfinite(found.value):
                first = named.id in effects() and effects()[named.id].parameters[0].name == name
                yield _error(case.name, named.id, name, first, found, true[name])


def _error(case: str, of: str, name: str, primary: bool, found: Estimate, true: float) -> SizeError:
    off = abs(found.value - true)
    relative = off / abs(true) if true else (math.inf if off else 0.0)
    return SizeError(case, of, name, primary, relative, found.low <= true <= found.high)

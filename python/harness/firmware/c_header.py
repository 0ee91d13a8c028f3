# SPDX-License-Identifier: MIT
"""Renders a configuration as a C99 header for ehsid/c_api.h, with the numbers of the C++ header."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import ehsid

from .configuration import EstimatorConfiguration
from .header import check_name, comment, float32_literal, policy_members, template, upper_triangle

SCALING = ("command_scale", "position_scale", "command_offset", "position_offset")
RLS = ("information_margin", "covariance_ceiling")
RESET = ("short_window", "long_window", "trigger_ratio", "release_ratio", "cool_down", "floor")
CONVERGENCE = ("tolerance", "magnitude", "hold")


def _member(name: str, value: float) -> str:
    """Returns a designated initialiser in C; an integer stays an integer."""
    if isinstance(value, int):
        return f".{name} = {value},"
    return f".{name} = {float32_literal(value)}, /* {np.float32(value):.6g} */"


def _members(settings: object, names: Sequence[str], prefix: str = "") -> list[str]:
    return [_member(f"{prefix}{name}", getattr(settings, name)) for name in names]


def render_c_header(
    configuration: EstimatorConfiguration,
    *,
    name: str,
    dt_s: float | None = None,
    provenance: Sequence[str] = (),
) -> str:
    """Returns the text of the header: `NAME_configuration` and, with a seed, `NAME_estimate`.

    Parameters
    ----------
    configuration
        settings and seed; at least two parameters, as any ARX model has.
    name
        prefix of the names that the header defines.
    dt_s
        sampling time, s; None if it is not known.
    provenance
        lines of the comment at the top that say where the numbers come from.

    Raises
    ------
    ValueError
        the name is not valid in C++, or a number is not finite in float32.
    """
    orders, seed = configuration.orders, configuration.seed
    members = policy_members(configuration.forgetting)
    reset = configuration.reset
    # The C structure always has these members. Without a reset they get the C++ defaults, which are
    # valid and not used.
    thresholds = ehsid.RmseResetOptions() if reset is None else reset
    settings = [
        *_members(configuration.scaling, SCALING),
        *(_member(f"forgetting.{name}", value) for name, value in members),
        *_members(configuration.rls, RLS),
        f".reset_enabled = {'false' if reset is None else 'true'},",
        *_members(thresholds, RESET, "reset_"),
        *_members(configuration.convergence, CONVERGENCE, "convergence_"),
        _member("variance0", float(configuration.variance0)),
        _member("input_limit", float(configuration.input_limit)),
    ]
    return template("configuration.h.j2").render(
        name=check_name(name),
        version=ehsid.__version__,
        # Each line stands in a block comment and must not end it.
        provenance=[comment(line).replace("*/", "*_") for line in provenance],
        orders=orders,
        policy=configuration.forgetting.info.id,
        settings=settings,
        seed=seed,
        upper=[] if seed is None else upper_triangle(seed),
        dt_s=dt_s,
    )

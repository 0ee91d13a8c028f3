# SPDX-License-Identifier: MIT
"""A configuration as C99 sources: the whole estimator with every size and setting fixed.

The sources need nothing of ehsid, no Eigen, no heap, and of libm the square root only. Numbers that
are made from the settings are computed here in the precision of the estimator, with the operations
of the C++ headers, so that the results have the same bits.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import jinja2
import numpy as np

import ehsid

from .configuration import EstimatorConfiguration
from .header import (
    GoldenTrace,
    check_name,
    comment,
    environment,
    float32_literal,
    policy_members,
    upper_triangle,
)

LONGEST_WINDOW = 2.0**24
"""Longest window of the reset, in samples: a float32 holds every whole number up to this."""

FORGETS = 0.0023
"""A policy that forgets less in a step keeps what a glitch did to theta: `RmseReset::kForgets`."""

PRECISIONS: dict[str, dict[str, str]] = {
    "float32": {
        "real_type": "float",
        "word": "uint32_t",
        "F": "F",
        "sqrt": "sqrtf",
        "exponent": "0x7f800000U",
        "least_normal": "0x00800000U",
        "square_overflows": "0x5f000000U",  # 2^63
    },
    "float64": {
        "real_type": "double",
        "word": "uint64_t",
        "F": "",
        "sqrt": "sqrt",
        "exponent": "0x7ff0000000000000U",
        "least_normal": "0x0010000000000000U",
        "square_overflows": "0x5fe0000000000000U",  # 2^511
    },
}


@dataclass(frozen=True)
class Sources:
    """The two files of an estimator."""

    header: str
    """Text of the header with the declarations."""
    source: str
    """Text of the C file."""


def real_literal(value: float, dtype: str) -> str:
    """Returns a number, rounded to the precision, as a literal of C99 with the same bits.

    Small whole numbers and simple fractions are decimal, all others hexadecimal.

    Raises
    ------
    ValueError
        the number is not finite in this precision.
    """
    suffix = PRECISIONS[dtype]["F"]
    if abs(value) < 1e7 and value * 16.0 == np.floor(value * 16.0):
        return f"{float(value)!r}{suffix}"
    if dtype == "float32":
        return float32_literal(value)
    if not np.isfinite(value):
        raise ValueError(f"{value!r} is not finite")
    mantissa, exponent = float(value).hex().split("p")
    return f"{mantissa.rstrip('0').removesuffix('.')}p{exponent}"


def check_stem(stem: str) -> str:
    """Returns the name of the files without its ending if an #include can hold it.

    Raises
    ------
    ValueError
        the name has other signs than letters, digits, points, underscores and hyphens.
    """
    if not re.fullmatch(r"[A-Za-z0-9_.-]+", stem):
        raise ValueError(
            f"the file name {stem!r} cannot stand in an #include everywhere; expected letters, "
            "digits, points, underscores and hyphens, e.g. servo_estimator.c"
        )
    return stem


def render_sources(
    configuration: EstimatorConfiguration,
    trace: GoldenTrace,
    *,
    name: str,
    stem: str,
    dtype: str = "float32",
    dt_s: float | None = None,
    provenance: Sequence[str] = (),
) -> Sources:
    """Returns the texts of `STEM.h` and `STEM.c`.

    Parameters
    ----------
    configuration
        settings and seed.
    trace
        golden trace of the same configuration, in the same precision, for the self-test.
    name
        prefix of all names that other files see.
    stem
        name of the files without .h and .c.
    dtype
        float32 or float64.
    dt_s
        sampling time, s; None if it is not known.
    provenance
        lines of the comment at the top that say where the numbers come from.

    Raises
    ------
    ValueError
        a name cannot be used, or a number is not finite in the precision.
    """
    reset = configuration.reset
    if reset is not None and reset.long_window > LONGEST_WINDOW:
        raise ValueError(
            f"long_window {reset.long_window:g}: expected at most {LONGEST_WINDOW:g} samples in C"
        )
    values = {
        "x": check_name(name),
        "X": name.upper(),
        "stem": check_stem(stem),
        "version": ehsid.__version__,
        # Each line stands in a block comment and must not end it, nor seem to begin another.
        "provenance": [
            comment(line).replace("*/", "*_").replace("/*", "/_") for line in provenance
        ],
        "dt_s": dt_s,
        "dtype": dtype,
        "samples": list(zip(trace.command, trace.position, trace.innovation, strict=True)),
        "trace_theta": trace.theta,
        **PRECISIONS[dtype],
        **_numbers(configuration, np.dtype(dtype).type),
        **_policy(configuration, np.dtype(dtype).type),
    }
    header, source = (templates().get_template(f"source.{kind}.j2").render(values) for kind in "hc")
    return Sources(header, source)


@functools.cache
def templates() -> jinja2.Environment:
    """Returns the templates, with the filter `real` for numbers in the precision `dtype`."""
    made = environment()

    @jinja2.pass_context
    def real(context: jinja2.runtime.Context, value: float) -> str:
        return real_literal(value, context["dtype"])

    made.filters["real"] = real
    return made


def _numbers(configuration: EstimatorConfiguration, real: Any) -> dict[str, Any]:
    """Returns what the templates take of the configuration but of its policy."""
    orders, scaling, reset = configuration.orders, configuration.scaling, configuration.reset
    n, limits = orders.n_parameters, np.finfo(real)
    margin = real(configuration.rls.information_margin)
    if margin < 0:
        margin = np.sqrt(real(n))
    variance0 = real(configuration.variance0)
    more: dict[str, Any] = {}
    if reset is not None:
        more = {
            "long_count": int(np.ceil(real(reset.long_window))),
            "trigger": real(reset.trigger_ratio) ** 2,
            "rearm": real(reset.release_ratio) ** 2,
            "floor_square": real(reset.floor) ** 2,
        }
    return {
        "orders": orders,
        "n": n,
        "full": max(orders.na, orders.nk + orders.nb - 1),
        "scaling": scaling,
        "input_limit": configuration.input_limit,
        "seed": configuration.seed,
        "variance0": variance0,
        "ceiling": configuration.rls.covariance_ceiling,
        "ceiling_weight": real(1) / (real(n) * variance0),
        # P_ii is at most n times the ceiling of its mean.
        "stays_finite": bool(
            float(variance0) * configuration.rls.covariance_ceiling < float(limits.max) / (2 * n)
        ),
        "guarded": margin > 0,
        "margin": margin,
        "largest": limits.max,
        "epsilon": limits.eps,
        "largest_square": limits.max / real(8 * 100),  # SlidingSum<Scalar, 100>::kMost
        "rounding_square": (real(64) * limits.eps) ** 2,
        "convergence": configuration.convergence,
        "tolerance_square": real(configuration.convergence.tolerance) ** 2,
        "magnitude_square": real(configuration.convergence.magnitude) ** 2,
        "smallest_square": real(1e-5) ** 2,
        "shortest_memory": real(1) - real(1) / real(500),
        "longest_memory": real(1) - real(1) / real(1e5),
        "reset": reset,
        **more,
        **_start(configuration, real),
    }


def _start(configuration: EstimatorConfiguration, real: Any) -> dict[str, Any]:
    """Returns the estimate before the first sample, scaled in the precision of the estimator."""
    orders, scaling, seed = configuration.orders, configuration.scaling, configuration.seed
    n = orders.n_parameters
    position = real(scaling.position_scale)
    units = [real(1)] * orders.na + [position / real(scaling.command_scale)] * orders.nb
    units += [position] * int(orders.offset)
    if seed is None:
        theta, d = np.zeros(n), np.full(n, configuration.variance0)
        u, noise = [0.0] * (n * (n - 1) // 2), 0.0
    else:
        theta, d = seed.theta, seed.d
        u, noise = upper_triangle(seed), seed.noise_variance
    start = {
        "theta": [real(value) / unit for value, unit in zip(theta, units, strict=True)],
        "d": d,
        "u": u,
        "noise_variance": real(noise) / position / position,
    }
    return {"start": start, "units_theta": theta, "noise_known": start["noise_variance"] > 0}


def _policy(configuration: EstimatorConfiguration, real: Any) -> dict[str, Any]:
    """Returns what the templates take of the forgetting policy.

    `forgotten` is what an ordinary step forgets, as an expression; `stays` whether theta may keep
    for long what it has learned, and `stays_too` a condition that this hangs on.
    """
    forgetting = configuration.forgetting
    info, members = forgetting.info, policy_members(forgetting)
    settings = dict(members)
    one = real_literal(1.0, np.dtype(real).name)
    forgotten, stays, stays_too = "", False, ""
    if info.id == "constant":
        forgotten = f"{one} - LAMBDA"
        stays = bool(real(1) - real(settings["lambda"]) < real(FORGETS))
    elif info.id == "exponential":
        forgotten, stays = "next_deficit(state)", True
        limit = real_literal(float(real(FORGETS)), np.dtype(real).name)
        stays_too = f" && (next_deficit(state) < {limit})"
    elif info.id == "error_driven":
        forgotten = f"{one} / MEMORY"
    noise_given = bool(real(settings.get("noise_variance", 0.0)) > 0)
    return {
        "policy": info.id,
        "policy_words": repr(forgetting),
        "policy_summary": info.summary,
        "policy_source": info.source,
        "policy_settings": [
            member for member in members if noise_given or member[0] != "noise_variance"
        ],
        "policy_has_state": info.id not in ("constant",) and not noise_given,
        "noise_given": noise_given,
        "forgotten": forgotten,
        "stays": stays,
        "stays_too": stays_too,
    }

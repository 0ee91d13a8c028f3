# SPDX-License-Identifier: MIT
"""A configuration as a C++ header: every number a hexadecimal float32 literal, exact to the bit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import jinja2
import numpy as np

import ehsid
from ehsid.harness.deploy.export.configuration import EstimatorConfiguration, Seed
from ehsid.harness.deploy.export.trace import GoldenTrace
from ehsid.harness.files import write_text

# Of C++20 too, so that a header does not stop to compile when the firmware moves on.
KEYWORDS = (
    "alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t "
    "char32_t class co_await co_return co_yield compl concept const const_cast consteval "
    "constexpr constinit continue decltype default delete do double dynamic_cast else enum "
    "explicit export extern false float for friend goto if inline int long mutable namespace new "
    "noexcept not not_eq nullptr operator or or_eq private protected public register "
    "reinterpret_cast requires return short signed sizeof static static_assert static_cast struct "
    "switch template this thread_local throw true try typedef typeid typename union unsigned using "
    "virtual void volatile wchar_t while xor xor_eq"
)
TAKEN = ("ehsid", "std", "Eigen", "linux", "unix")  # the last two are macros of GNU C++


def check_name(name: str) -> str:
    """The name, if it can be that of a C++ namespace.

    Raises
    ------
    ValueError
        it cannot; says why.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or "__" in name:
        raise ValueError(
            f"the name {name!r} is no C++ identifier; expected a letter, then letters, digits "
            "and single underscores, e.g. servo"
        )
    if name in KEYWORDS.split():
        raise ValueError(f"the name {name!r} is a C++ keyword; choose another, e.g. servo")
    if name in TAKEN:
        raise ValueError(f"the name {name!r} belongs to others; choose another, e.g. servo")
    return name


def float32_literal(value: float) -> str:
    """The number rounded to float32 as a literal of C++17, e.g. 0x1.99999ap-4F for 0.1.

    Raises
    ------
    ValueError
        not finite in float32.
    """
    with np.errstate(over="ignore"):
        single = float(np.float32(value))
    if not np.isfinite(single):
        raise ValueError(f"{value!r} is not finite in float32")
    mantissa, exponent = single.hex().split("p")
    return f"{mantissa.rstrip('0').removesuffix('.')}p{exponent}F"


def _set(target: str, value: float) -> str:
    """An assignment, with the decimal for people."""
    return f"{target} = {float32_literal(value)};  // {np.float32(value):.6g}"


def _fields(target: str, settings: object, names: Sequence[str]) -> list[str]:
    """Assignments of members that are called the same in both languages; integers stay integers."""
    lines = []
    for name in names:
        value = getattr(settings, name)
        exact = isinstance(value, int)
        lines.append(f"{target}.{name} = {value};" if exact else _set(f"{target}.{name}", value))
    return lines


def _policy(forgetting: ehsid.Forgetting, n: int) -> tuple[str, list[str]]:
    """Type of the policy in C++, and its settings."""
    target, kind = "options.forgetting", type(forgetting).__name__
    match forgetting:
        case ehsid.Constant():
            lines = [_set(f"{target}.lambda", forgetting.lambda_)]
        case ehsid.Exponential():
            lines = _fields(target, forgetting, ("lambda0", "lambda_initial"))
        case ehsid.ErrorDriven():
            lines = _fields(target, forgetting, ("memory", "lambda_min", "noise_variance"))
        case ehsid.FRatio():
            lines = _fields(target, forgetting, ("eta", "critical_ratio"))
        case ehsid.Directional():
            lines = [
                _set(f"{target}.lambda", forgetting.lambda_),
                _set(f"{target}.epsilon", forgetting.epsilon),
            ]
        case ehsid.RandomWalk():
            drift = forgetting.drift * n if len(forgetting.drift) == 1 else forgetting.drift
            lines = [_set(f"{target}.drift[{i}]", value) for i, value in enumerate(drift)]
            return f"ehsid::RandomWalk<float, {n}>", lines
    return f"ehsid::{kind}<float>", lines


def _settings(configuration: EstimatorConfiguration) -> list[str]:
    """Every member of Estimator::Options but theta0, which the seed replaces."""
    scaling = ("command_scale", "position_scale", "command_offset", "position_offset")
    lines = _fields("options.scaling", configuration.scaling, scaling)
    lines += _policy(configuration.forgetting, configuration.orders.n_parameters)[1]
    rls = ("information_margin", "covariance_ceiling")
    lines += _fields("options.rls", configuration.rls, rls)
    if configuration.reset is None:
        lines.append("options.reset_enabled = false;")
    else:
        windows = ("short_window", "long_window", "trigger_ratio", "release_ratio")
        names = (*windows, "cool_down", "floor")
        lines += _fields("options.reset", configuration.reset, names)
    convergence = ("tolerance", "magnitude", "hold")
    lines += _fields("options.convergence", configuration.convergence, convergence)
    variance = configuration.variance0
    lines.append(f"options.variance0.setConstant({float32_literal(variance)});  // {variance:.6g}")
    lines.append(_set("options.input_limit", configuration.input_limit))
    return lines


def upper_triangle(seed: Seed) -> list[float]:
    """The entries above the diagonal of u, column by column, as ehsid::UdFactors keeps them."""
    return [float(seed.u[i, j]) for j in range(seed.d.size) for i in range(j)]


def comment(text: str) -> str:
    """Nothing that would end a line comment, or carry it on."""
    return "".join(c if c.isprintable() and c != "\\" else "_" for c in text)


def template(name: str) -> jinja2.Template:
    """A template of this room, with the filter `float32`."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ehsid.harness.deploy.export"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # C and C++, not HTML
    )
    environment.filters["float32"] = float32_literal
    return environment.get_template(name)


def render_header(
    configuration: EstimatorConfiguration,
    trace: GoldenTrace,
    *,
    name: str,
    dt_s: float | None = None,
    provenance: Sequence[str] = (),
) -> str:
    """The text of the header.

    Parameters
    ----------
    configuration
        settings and seed.
    trace
        of the same configuration.
    name
        namespace.
    dt_s
        sampling time, None where it is not known.
    provenance
        lines of the comment at the top: where the numbers come from.

    Raises
    ------
    ValueError
        a name that C++ does not take, or a number that is not finite in float32.
    """
    orders = configuration.orders
    seed = configuration.seed
    return template("estimator.hpp.j2").render(
        name=check_name(name),
        version=ehsid.__version__,
        provenance=[comment(line) for line in provenance],
        orders=orders,
        policy=_policy(configuration.forgetting, orders.n_parameters)[0],
        settings=_settings(configuration),
        seed=seed,
        upper=[] if seed is None else upper_triangle(seed),
        dt_s=dt_s,
        trace=trace,
        samples=list(zip(trace.command, trace.position, trace.innovation, strict=True)),
    )


def write_header(path: Path, text: str) -> None:
    """Write under a temporary name, then rename.

    Raises
    ------
    ValueError
        the folder is not there, or a folder stands at the path.
    """
    if path.is_dir():
        raise ValueError(f"{path} is a folder; give the name of a file, e.g. servo.hpp")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}; make it first")
    write_text(path, text)

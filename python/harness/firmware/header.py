# SPDX-License-Identifier: MIT
"""Renders a configuration as a C++ header with bit-exact hexadecimal float32 literals.

Golden trace for the self-test of the target: some samples and the results of the estimator.

Renders a configuration as a C99 header for ehsid/c_api.h, with the numbers of the C++ header.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import jinja2
import numpy as np
import numpy.typing as npt

import ehsid

from ..base.numbers import FloatArray
from ..models.identification import IoData
from .configuration import EstimatorConfiguration, Seed

Float32 = npt.NDArray[np.float32]

TRACE_SAMPLES = 64


@dataclass(frozen=True, eq=False)
class GoldenTrace:
    """Samples of a record as float32, and results of the estimator in its precision."""

    command: Float32
    position: Float32
    """Samples, shape (m,), in the units of the signals."""
    innovation: FloatArray | Float32
    """`innovation` of the estimator after each sample, shape (m,); 0 before the first estimate."""
    theta: FloatArray | Float32
    """Estimate after the last sample, shape (n,)."""

    @classmethod
    def of(
        cls,
        configuration: EstimatorConfiguration,
        u: npt.ArrayLike,
        y: npt.ArrayLike,
        dtype: str = "float32",
    ) -> GoldenTrace:
        """Runs a new estimator over m samples of command u and position y, each of shape (m,)."""
        command, position = np.asarray(u, dtype=np.float32), np.asarray(y, dtype=np.float32)
        estimator = configuration.estimator(dtype)
        innovation = []
        for one_command, one_position in zip(command, position, strict=True):
            estimator.step(float(one_command), float(one_position))
            innovation.append(estimator.innovation)
        return cls(
            command,
            position,
            np.array(innovation, dtype=dtype),
            estimator.theta_hat.astype(dtype),
        )


def liveliest(data: IoData, length: int = TRACE_SAMPLES) -> tuple[Float32, Float32]:
    """Returns the window of command and position samples with the largest sum of scaled variances.

    The window has `length` samples, or is a whole segment if no segment is that long. Many records
    begin at rest, where a trace would show nothing. Neither signal may be constant.
    """
    scale_u, scale_y = np.std(data.u), np.std(data.y)
    best, found = -1.0, slice(0, 0)
    for segment in data.segments:
        width = min(length, segment.stop - segment.start)
        windows = np.lib.stride_tricks.sliding_window_view
        lively = windows(data.u[segment], width).var(axis=1) / scale_u**2
        lively = lively + windows(data.y[segment], width).var(axis=1) / scale_y**2
        at = int(np.argmax(lively))
        # A longer window always has priority over a shorter one.
        if (width, float(lively[at])) > (found.stop - found.start, best):
            best, found = float(lively[at]), slice(segment.start + at, segment.start + at + width)
    return data.u[found].astype(np.float32), data.y[found].astype(np.float32)


# The list has the keywords of C++20, too, so that a header still compiles after the firmware
# changes to that standard.
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


# C99 tells external names apart by their first 31 characters.
LONGEST_NAME = 31


def check_name(name: str) -> str:
    """Returns the name if it is valid for a C++ namespace.

    Raises
    ------
    ValueError
        the name is not valid; the message says why.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or "__" in name:
        raise ValueError(
            f"the name {name!r} is no C++ identifier; expected a letter, then letters, digits "
            "and single underscores, e.g. servo"
        )
    if len(name) > LONGEST_NAME:
        raise ValueError(
            f"the name {name[:LONGEST_NAME]}... has {len(name)} letters; expected at most "
            f"{LONGEST_NAME}, e.g. servo"
        )
    if name in KEYWORDS.split():
        raise ValueError(f"the name {name!r} is a C++ keyword; choose another, e.g. servo")
    if name in TAKEN:
        raise ValueError(f"the name {name!r} belongs to others; choose another, e.g. servo")
    return name


def float32_literal(value: float) -> str:
    """Returns a number, rounded to float32, as a literal of C++17, e.g. 0x1.99999ap-4F for 0.1.

    Raises
    ------
    ValueError
        the number is not finite in float32.
    """
    with np.errstate(over="ignore"):
        single = float(np.float32(value))
    if not np.isfinite(single):
        raise ValueError(f"{value!r} is not finite in float32")
    mantissa, exponent = single.hex().split("p")
    return f"{mantissa.rstrip('0').removesuffix('.')}p{exponent}F"


def _set(target: str, value: float) -> str:
    """Returns an assignment in C++, with the decimal number as a comment for readers."""
    return f"{target} = {float32_literal(value)};  // {np.float32(value):.6g}"


def _fields(target: str, settings: object, names: Sequence[str]) -> list[str]:
    """Returns assignments of members that have the same name in Python and C++.

    Integers stay integers.
    """
    lines = []
    for name in names:
        value = getattr(settings, name)
        exact = isinstance(value, int)
        lines.append(f"{target}.{name} = {value};" if exact else _set(f"{target}.{name}", value))
    return lines


def policy_type(info: ehsid.PolicyInfo) -> str:
    """Returns the type in C++ of a forgetting policy."""
    return f"ehsid::{info.policy.__name__}<float>"


def policy_members(forgetting: ehsid.Forgetting) -> list[tuple[str, float]]:
    """Returns the members that hold the settings of a policy, in C++ and C, with their values."""
    return [
        (setting.member, getattr(forgetting, setting.name)) for setting in forgetting.info.settings
    ]


def _settings(configuration: EstimatorConfiguration) -> list[str]:
    """Returns assignments of all members of Estimator::Options but theta0.

    The seed replaces theta0.
    """
    scaling = ("command_scale", "position_scale", "command_offset", "position_offset")
    lines = _fields("options.scaling", configuration.scaling, scaling)
    members = policy_members(configuration.forgetting)
    lines += [_set(f"options.forgetting.{name}", value) for name, value in members]
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
    vague = f"Estimator::Parameters::Constant(Estimator::kN, {float32_literal(variance)})"
    lines.append(f"options.variance0 = {vague};  // {variance:.6g}")
    lines.append(_set("options.input_limit", configuration.input_limit))
    return lines


def upper_triangle(seed: Seed) -> list[float]:
    """Returns the entries of u above its diagonal, by columns, as ehsid::UdFactors stores them."""
    return [float(seed.u[i, j]) for j in range(seed.d.size) for i in range(j)]


def comment(text: str) -> str:
    """Replaces characters that would end a line comment, or continue it on the next line."""
    return "".join(c if c.isprintable() and c != "\\" else "_" for c in text)


def plain_number(value: float | bool) -> str:
    """Returns a number or truth as XML and C++ write it, with all its digits."""
    return str(value).lower() if isinstance(value, bool) else repr(float(value))


def environment() -> jinja2.Environment:
    """Returns the templates of this package, with filters for numbers: `float32` and `number`."""
    made = jinja2.Environment(
        loader=jinja2.PackageLoader("ehsid.harness.firmware"),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # C and C++, not HTML
    )
    made.filters["float32"] = float32_literal
    made.filters["number"] = plain_number
    return made


def template(name: str) -> jinja2.Template:
    """Returns a template of this package."""
    return environment().get_template(name)


def render_header(
    configuration: EstimatorConfiguration,
    trace: GoldenTrace,
    *,
    name: str,
    dt_s: float | None = None,
    provenance: Sequence[str] = (),
) -> str:
    """Returns the text of the header.

    Parameters
    ----------
    configuration
        settings and seed.
    trace
        golden trace of the same configuration.
    name
        name of the C++ namespace.
    dt_s
        sampling time, s; None if it is not known.
    provenance
        lines of the comment at the top that say where the numbers come from.

    Raises
    ------
    ValueError
        the name is not valid in C++, or a number is not finite in float32.
    """
    orders = configuration.orders
    seed = configuration.seed
    return template("estimator.hpp.j2").render(
        name=check_name(name),
        version=ehsid.__version__,
        provenance=[comment(line) for line in provenance],
        orders=orders,
        policy=policy_type(configuration.forgetting.info),
        settings=_settings(configuration),
        seed=seed,
        upper=[] if seed is None else upper_triangle(seed),
        dt_s=dt_s,
        trace=trace,
        samples=list(zip(trace.command, trace.position, trace.innovation, strict=True)),
    )


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

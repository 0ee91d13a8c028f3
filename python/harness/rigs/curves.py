# SPDX-License-Identifier: MIT
"""Test curves of a valve from its bench (ISO 10770-1) as values of a rig with their uncertainty.

- Flow over signal at a constant pressure drop: rated flow, overlap, null bias, hysteresis and
  saturation are fitted at once, with the equations of the simulator (docs/effects.md).
- Load pressure over signal with blocked ports: its slope S within 40 % of the largest pressure P,
  and the signal at which it is zero.
- Leakage over signal with blocked ports: its peak Q above what is left at large signals.

Both of the last tell how far the edges are rounded. Four edges a = (s + sqrt(s^2 + r^2)) / 2 that
are s = +-x - o past their overlap pass q = K a sqrt(dp), dp = P / 2 each, at null (Merritt,
Hydraulic Control Systems, Wiley 1967, ch. 5):

    S = 2 P / sqrt(o^2 + r^2),    Q = 2 K a_0 sqrt(P / 2),  a_0 = (sqrt(o^2 + r^2) - o) / 2.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from ..base.numbers import FloatArray
from ..catalogue.parameters import plant_parameters
from ..records.names import split_unit
from ..records.reading import open_unread
from .checks import LARGEST_SIGMA
from .quantities import OF_COMMANDS, read_quantity
from .rig_file import Entry

# What a column is, by its name, and the SI unit of what it holds.
COLUMNS = (
    ("leakage", r"leak", "m^3/s"),
    ("flow", r"flow|\bq\b", "m^3/s"),
    ("pressure_a", r"pressure[ _]?a\b|\bp_?a\b", "Pa"),
    ("pressure_b", r"pressure[ _]?b\b|\bp_?b\b", "Pa"),
    ("load_pressure", r"load[ _]?pressure|\bp_?l\b", "Pa"),
    ("signal", r"signal|command|input|\bu\b", "V"),
)
ENDINGS = {"_m3_s": "m^3/s", "_l_min": "l/min", "_pa": "Pa", "_bar": "bar", "_v": "V", "_ma": "mA"}
LEAST, MOST = 20, 2000
# The fit knows its own noise; of the instruments, shares of full scale and of the value.
SIGNAL_SIGMA, FLOW_SIGMA = 5e-4, 0.01
# The formulas for rounded edges leave this, relative.
ROUNDING_SIGMA = 0.3
# Of the slope of a pressure gain, and of a leakage, by the instruments.
SLOPE_SIGMA, LEAKAGE_SIGMA = 0.02, 0.05
# Pressures within this share of the largest one are on the straight part (ISO 10770-1).
STRAIGHT = 0.4


@dataclass(frozen=True, eq=False)
class Curve:
    """One test: the signal as a share of the rated command, and what was measured, shape (n,)."""

    path: Path
    kind: str
    """"flow", "pressure" or "leakage"."""
    signal: FloatArray
    measured: FloatArray
    """m^3/s or Pa."""


@dataclass(frozen=True)
class Bench:
    """What the curves tell."""

    entries: list[Entry]
    rated_flow: str | None
    """As an answer such as "38 l/min +- 1 %"; None without a curve of the flow."""
    notes: list[str]


def read_curve(path: Path, rated_command: float) -> Curve:
    """Reads a curve; which test it is follows from the names of its columns.

    Raises
    ------
    ValueError
        the columns are none of a test, a unit is unknown, or the curve is too short.
    """
    found: dict[str, FloatArray] = {}
    for series in open_unread(path).series:
        label, unit = split_unit(series.name)
        ending = next((one for one in ENDINGS if label.lower().endswith(one)), "")
        label = label[: len(label) - len(ending)].lower()
        for kind, names, si in COLUMNS:
            if re.search(names, label) and kind not in found:
                unit = unit or series.unit or ENDINGS.get(ending)
                found[kind] = series.read() * _factor(path, series.name, unit, si, rated_command)
                break
    signal = found.get("signal")
    if "pressure_a" in found and "pressure_b" in found:
        found["load_pressure"] = found["pressure_a"] - found["pressure_b"]
    kinds = {"leakage": "leakage", "load_pressure": "pressure", "flow": "flow"}
    measured = next((name for name in kinds if name in found), None)
    if signal is None or measured is None:
        raise ValueError(
            f"{path}: no test of a valve: expected a column of the signal, such as 'signal [V]', "
            "and one of 'flow [l/min]', 'leakage [l/min]', 'load_pressure [bar]', or 'pressure_a "
            "[bar]' and 'pressure_b [bar]'; rename them"
        )
    kept = np.isfinite(signal) & np.isfinite(found[measured])
    if kept.sum() < LEAST or np.ptp(signal[kept]) <= 0.0:
        raise ValueError(
            f"{path}: {kept.sum()} points: expected {LEAST} at least, over a signal that changes; "
            "export more of the curve"
        )
    step = -(-int(kept.sum()) // MOST)
    return Curve(path, kinds[measured], signal[kept][::step], found[measured][kept][::step])


def _factor(path: Path, column: str, unit: str | None, si: str, rated: float) -> float:
    """Returns the factor from a column to SI; of a signal to shares of the rated command."""
    where = f"{path}, column '{column}'"
    if unit is None:
        raise ValueError(f"{where}: has no unit: expected one, such as [{si}]; put it in the name")
    if si == "V":
        if unit not in (*OF_COMMANDS, "%"):
            raise ValueError(f"{where}: the unit '{unit}' is none of a signal: expected V, mA or %")
        return 0.01 if unit in ("%", "percent") else 1.0 / rated
    try:
        one, two = (read_quantity(f"{n} {unit}", where, si, si).value for n in (1, 2))
    except ValueError as error:
        raise ValueError(f"{error}; correct the unit") from None
    return two - one


def _play(signal: FloatArray, half_width: float) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Signal behind a play, and whether its state no longer depends on the start, shape (n,)."""
    held = float(signal[0])
    behind: FloatArray = np.empty_like(signal)
    for i, value in enumerate(signal.tolist()):
        held = min(max(held, value - half_width), value + half_width)
        behind[i] = held
    return behind, np.asarray(np.maximum.accumulate(np.abs(signal - signal[0])) > 0.1)


def _flow(p: FloatArray, signal: FloatArray) -> FloatArray:
    """Flow of (gain, overlap, bias, half width, 1 / limit) at signals."""
    gain, overlap, bias, half_width, bend = p
    x = _play(signal, abs(half_width))[0] + bias
    if bend > 1e-6:
        x = np.tanh(bend * x) / bend
    return np.asarray(
        gain * (np.maximum(x - overlap, 0.0) + np.minimum(x + overlap, 0.0)), dtype=np.float64
    )


def _fitted_flow(curve: Curve) -> tuple[FloatArray, FloatArray]:
    """Returns the five values of `_flow` and their 1-sigma.

    Raises
    ------
    ValueError
        the curve does not go to both sides, or the flow does not follow the signal.
    """
    from scipy.optimize import least_squares

    u, q = curve.signal, curve.measured
    largest = float(np.abs(q).max())
    if not (u.min() < -0.1 < 0.1 < u.max() and q.min() < 0.0 < q.max()):
        raise ValueError(
            f"{curve.path}: signals of {u.min():.3g} to {u.max():.3g} of the rated command, flows "
            f"of {6e4 * q.min():.3g} to {6e4 * q.max():.3g} l/min: expected both signs of both, to "
            "a tenth of the rated command at least; look at --rated-command, and at the sign"
        )
    if np.corrcoef(u, q)[0, 1] < 0.5:
        raise ValueError(
            f"{curve.path}: the flow does not rise with the signal: expected a flow curve; change "
            "the sign of a column, or name another file"
        )
    kept = _play(u, 0.0)[1]
    still = np.abs(q) < 0.02 * largest
    edges = (float(u[still].min()), float(u[still].max())) if still.any() else (0.0, 0.0)
    gain = largest / float(np.abs(u).max())
    scale = np.array([gain, 0.01, 0.01, 0.01, 1.0])

    def apart(p: FloatArray) -> FloatArray:
        return np.asarray((_flow(p * scale, u) - q)[kept] / largest)

    fits = []
    for bend in (0.1, 1.5):
        start = np.array([gain, 0.5 * (edges[1] - edges[0]), -0.5 * sum(edges), 0.005, bend])
        fits.append(
            least_squares(
                apart,
                start / scale,
                bounds=([0.1, -20.0, -30.0, 0.0, 0.0], [20.0, 30.0, 30.0, 20.0, 20.0]),
                diff_step=[1e-4] * 5,
            )
        )
    best = min(fits, key=lambda one: float(one.cost))
    jacobian = np.asarray(best.jac, dtype=np.float64)
    variance = 2.0 * float(best.cost) / max(int(kept.sum()) - 5, 1)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * variance
    found = np.asarray(best.x, dtype=np.float64) * scale
    floor = np.array([FLOW_SIGMA * found[0], *[SIGNAL_SIGMA] * 3, 0.02])
    return found, np.hypot(np.sqrt(np.diag(covariance)) * scale, floor)


def _pressure_gain(curve: Curve) -> tuple[float, float, float, float]:
    """Slope in Pa for the rated command, its relative 1-sigma, largest pressure, signal of zero."""
    u, p = curve.signal, curve.measured
    largest = 0.5 * float(np.percentile(p, 98) - np.percentile(p, 2))
    straight = np.abs(p) < STRAIGHT * largest
    if straight.sum() < 6:
        raise ValueError(
            f"{curve.path}: {straight.sum()} points within 40 % of the largest pressure: expected "
            "6 at least; take the curve with smaller steps about null"
        )
    # Up and down apart: hysteresis shifts the one beside the other.
    up = np.gradient(u) > 0.0
    columns = [p[straight], up[straight], ~up[straight]]
    matrix = np.column_stack([one for one in columns if np.any(one)]).astype(np.float64)
    (slope, *zeros), rest, *_ = np.linalg.lstsq(matrix, u[straight], rcond=None)
    if not slope > 0.0:
        raise ValueError(
            f"{curve.path}: the load pressure does not rise with the signal: expected it to; "
            "exchange the columns of A and B, or change the sign"
        )
    noise = float(rest[0]) / max(straight.sum() - 3, 1) if rest.size else 0.0
    sigma = math.sqrt(noise * np.linalg.inv(matrix.T @ matrix)[0, 0]) / slope
    return 1.0 / float(slope), float(sigma), largest, float(np.mean(zeros))


def bench_of(curves: Sequence[Curve], drop_pa: float, pressure_pa: float) -> Bench:
    """Returns what the curves of one valve tell, as values of a rig.

    Parameters
    ----------
    curves
        at most one of each kind.
    drop_pa
        over one edge, at which the flow was measured, Pa; the leakage needs it.
    pressure_pa
        supply less tank of the leakage test where no pressure was measured, Pa.

    Raises
    ------
    ValueError
        two curves are of one kind, or one cannot be read as what it is.
    """
    by_kind: dict[str, Curve] = {}
    for one in curves:
        if one.kind in by_kind:
            raise ValueError(
                f"{one.path}: a second curve of the {one.kind}: expected one of each kind; leave "
                f"out this one or {by_kind[one.kind].path}"
            )
        by_kind[one.kind] = one
    values: dict[str, tuple[float, float, str]] = {}
    notes: list[str] = []
    overlap, gain, rated_flow = 0.0, 0.0, None
    if "flow" in by_kind:
        found, sigma = _fitted_flow(by_kind["flow"])
        gain, overlap = float(found[0]), max(float(found[1]), 0.0)
        spread_of_overlap = float(sigma[1])
        percent = max(100.0 * float(sigma[0]) / gain, 0.1)
        rated_flow = f"{6e4 * gain:.6g} l/min +- {percent:.3f} %"
        if found[1] < -3.0 * sigma[1]:
            notes.append(
                f"the edges are open by {-100.0 * found[1]:.2g} % at null (underlap), which a rig "
                "file does not describe: the overlap counts as 0"
            )
        names = ("valve_dead_band.overlap", "valve_null_bias.offset", "valve_hysteresis.half_width")
        for name, value, one in zip(names, found[1:4], sigma[1:4], strict=True):
            if abs(value) > 3.0 * one and (value > 0.0 or name.endswith("offset")):
                values[f"effects.{name}"] = (float(value), float(one), "flow curve")
        if found[4] > max(3.0 * sigma[4], 0.5):
            limit = 1.0 / float(found[4])
            spread = float(sigma[4]) * limit**2
            values["effects.valve_flow_saturation.limit"] = (limit, spread, "flow curve")
    spread_of_overlap = SIGNAL_SIGMA
    roundings: list[tuple[str, float, float]] = []
    if "pressure" in by_kind:
        slope, spread, pressure_pa, zero = _pressure_gain(by_kind["pressure"])
        notes.append(
            f"pressure gain {slope * 1e-7:.3g} bar for 1 % of the rated command (+- "
            f"{100.0 * spread:.1g} %), zero at {100.0 * zero:.2g} %"
        )
        roundings.append(("pressure gain", 2.0 * pressure_pa / slope, max(spread, SLOPE_SIGMA)))
        if "flow" not in by_kind:
            values["effects.valve_null_bias.offset"] = (-zero, SIGNAL_SIGMA, "pressure gain")
    if "leakage" in by_kind:
        q = by_kind["leakage"].measured
        null = float(np.percentile(q, 99.5) - np.percentile(q, 5))
        notes.append(f"null leakage {6e4 * null:.3g} l/min above that at large signals")
        if gain > 0.0:
            opening = null / (2.0 * gain * math.sqrt(0.5 * pressure_pa / drop_pa))
            roundings.append(("null leakage", opening, LEAKAGE_SIGMA))
        else:
            notes.append("the null leakage needs the flow curve, and is left out")
    _add_rounding(values, roundings, (overlap, spread_of_overlap), notes)
    return Bench(_entries(values), rated_flow, notes)


def _rounding(of: str, value: float, overlap: float) -> float:
    """Rounding r of the edges from sqrt(o^2 + r^2) of a pressure gain, or a_0 of a leakage."""
    root = value if of == "pressure gain" else 2.0 * value + overlap
    return math.sqrt(max(root**2 - overlap**2, 0.0))


def _add_rounding(
    values: dict[str, tuple[float, float, str]],
    roundings: Sequence[tuple[str, float, float]],
    overlap: tuple[float, float],
    notes: list[str],
) -> None:
    """Adds the rounding of the edges as the weighted mean of its logarithms."""
    o, spread = overlap
    weights, logs, sources = [], [], []
    for of, value, relative in roundings:
        r = _rounding(of, value, o)
        if r <= 0.0:
            notes.append(f"the {of} is that of sharp edges with this overlap: no rounding")
            continue
        # From finite steps, since r is a root of a difference that may be small.
        steps = ((value * (1.0 + relative), o), (value, max(o - spread, 0.0)))
        moved = (math.log(_rounding(of, *step) / r) for step in steps)
        weights.append(1.0 / (ROUNDING_SIGMA**2 + sum(one**2 for one in moved)))
        logs.append(math.log(r))
        sources.append(of)
    if weights:
        r = math.exp(float(np.average(logs, weights=weights)))
        sigma = max(1.0 / math.sqrt(sum(weights)), ROUNDING_SIGMA)
        values["nuisance.edge_rounding"] = (r, r * sigma, " and ".join(sources))


def _entries(values: Mapping[str, tuple[float, float, str]]) -> list[Entry]:
    entries = []
    for key, (value, sigma, of) in values.items():
        limits = plant_parameters()[key]
        number = min(max(value, limits.minimum), limits.maximum)
        relative = min(max(sigma / abs(number), 1e-3), LARGEST_SIGMA)
        shown, why = f"{100.0 * number:.3g} %", f"{of}, ISO 10770-1"
        entries.append(
            Entry(key, float(f"{number:.6g}"), float(f"{relative:.3g}"), True, shown, why)
        )
    return entries

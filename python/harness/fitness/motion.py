# SPDX-License-Identifier: MIT
"""What a record says about the speed: how late it follows the command, and the flow it needs.

Signals and their derivatives, all smoothed by one kernel, so that equations between them hold.

A linear equation such as m y'' + b y' = F holds just as well between signals that are smoothed by
the same kernel phi. The derivatives of the smoothed position are those of the kernel,
(phi * y)' = phi' * y, so that no measured signal is differentiated (M. Shinbrot, Trans. ASME 79,
1957).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.signal import fftconvolve

from ..base.numbers import FloatArray
from ..catalogue.channels import CHAMBER_PRESSURES, COMMAND, POSITION, SUPPLY_PRESSURE
from ..diagnosis.data.gate_signs import correlation
from ..diagnosis.data.repeats import areas as piston_areas
from ..records import Record
from ..rigs import Rig


@dataclass(frozen=True, eq=False)
class Kernel:
    """A smooth kernel of unit area, and its derivatives; each of shape (n,), n odd."""

    phi: FloatArray
    first: FloatArray
    second: FloatArray
    """Kernel, 1; its first derivative, 1/s; its second one, 1/s^2. Each includes the time step, so
    that a convolution needs no further factor."""

    def smooth(self, signal: FloatArray, order: int = 0) -> FloatArray:
        """Returns the smoothed signal or its derivative, where the whole kernel lies in it.

        Parameters
        ----------
        signal
            shape (N,), N not below the length n of the kernel.
        order
            of the derivative: 0, 1 or 2.

        Returns
        -------
        Shape (N - n + 1,).
        """
        weights = (self.phi, self.first, self.second)[order]
        # The mean is no motion. Without it, rounding of a large offset does not matter.
        mean = float(signal.mean())
        smoothed = fftconvolve(signal - mean, weights, mode="valid")
        return np.asarray(smoothed + (mean if order == 0 else 0.0), dtype=np.float64)

    @property
    def half(self) -> int:
        """Number of samples by which each side of a smoothed signal is shorter."""
        return int(self.phi.size // 2)


def kernel(duration_s: float, dt_s: float) -> Kernel:
    """Returns the kernel cos^4 of this duration, of at least seven samples.

    Its weights are exact for parabolas: the first derivative of t is 1, the second of t^2 / 2 too.
    """
    half = max(3, round(0.5 * duration_s / dt_s))
    steps = np.arange(-half, half + 1, dtype=np.float64)
    x = np.pi * steps / (2.0 * (half + 1))
    slope = np.pi / (2.0 * (half + 1) * dt_s)
    phi = np.cos(x) ** 4
    first = -4.0 * np.cos(x) ** 3 * np.sin(x) * slope
    second = slope**2 * (12.0 * np.cos(x) ** 2 * np.sin(x) ** 2 - 4.0 * np.cos(x) ** 4)
    times = steps * dt_s
    phi = phi / phi.sum()
    # Sum of w(tau) y(t - tau) for y = t is minus the sum of w(tau) tau.
    first = first / -np.sum(first * times)
    second = second - second.mean()
    second = second / np.sum(second * 0.5 * times**2)
    return Kernel(phi, first, second)


# Duration of the kernel, s: above the noise of usual sensors, below the period of usual commands.
SMOOTHED_S = 0.04
# A smaller opening says little, because dead band and leakage count there.
LEAST_OPENING = 0.08
LEAST_SAMPLES = 50
# Longest delay that is looked for, s.
LONGEST_DELAY_S = 0.3
# Below this correlation of speed and delayed command the delay cannot be told.
RELATED = 0.5


@dataclass(frozen=True)
class Areas:
    """Areas of the piston, m^2, and volumes of the chambers in the middle of the stroke, m^3."""

    cap: float
    annulus: float
    volume_a: float
    volume_b: float


def areas(rig: Rig) -> Areas:
    """Returns the areas and volumes of the cylinder of a rig."""
    v = rig.values
    cap, annulus = piston_areas(v)
    half = 0.5 * v["cylinder.stroke_m"]
    return Areas(
        cap,
        annulus,
        v["cylinder.dead_volume_a_m3"] + half * cap,
        v["cylinder.dead_volume_b_m3"] + half * annulus,
    )


@dataclass(frozen=True, eq=False)
class Motion:
    """A record, smoothed, with the command shifted by its delay."""

    kernel: Kernel
    """With which all signals are smoothed."""
    delay_s: float | None
    """Delay of the speed behind the command, s; None if it cannot be told."""
    opening: FloatArray
    """Delayed command as a share of the rated one, shape (N,), not smoothed."""
    speed: FloatArray
    """Smoothed, m/s, shape (N - n + 1,) with a kernel of n samples."""
    related: float
    """Correlation of the speed and the delayed command."""


def motion(record: Record, rig: Rig) -> Motion:
    """Determines speed and delay of a record without gaps."""
    assert record.dt_s is not None
    smoothing = kernel(SMOOTHED_S, record.dt_s)
    speed = smoothing.smooth(record.column(POSITION), 1)
    rated = rig.values.get("valve.rated_command_v", 0.0)
    command = record.column(COMMAND)
    opening = np.clip(command / rated, -1.0, 1.0) if rated > 0.0 else command
    delay, related = _delay(opening, speed, smoothing, record.dt_s)
    return Motion(smoothing, delay, delayed(opening, delay or 0.0, record.dt_s), speed, related)


def delayed(signal: FloatArray, delay_s: float, dt_s: float) -> FloatArray:
    """Returns the signal later by a delay; between samples it is interpolated."""
    places = np.arange(signal.size, dtype=np.float64)
    return np.interp(places - delay_s / dt_s, places, signal)


def _delay(
    opening: FloatArray, speed: FloatArray, smoothing: Kernel, dt_s: float
) -> tuple[float | None, float]:
    """Delay at the largest correlation, by a parabola through the best three; and this one."""
    smooth = smoothing.smooth(opening)
    if np.ptp(smooth) == 0.0 or np.ptp(speed) == 0.0:
        return None, 0.0
    most = min(math.ceil(LONGEST_DELAY_S / dt_s), speed.size // 4)
    steps = np.arange(-3, most + 1)
    # The same samples of the speed at every delay, so that only the delay differs.
    kept = speed[most:-3]
    found = np.array(
        [correlation(smooth[most - k : smooth.size - 3 - k], kept) for k in steps.tolist()]
    )
    best = int(np.argmax(found))
    if best in (0, found.size - 1) or found[best] < RELATED:
        return None, float(found[best])
    left, top, right = found[best - 1 : best + 2].tolist()
    bend = left - 2.0 * top + right
    shift = 0.5 * (left - right) / bend if bend < 0.0 else 0.0
    return float((steps[best] + shift) * dt_s), top


@dataclass(frozen=True)
class FlowGain:
    """Rated flow that explains the speed, m^3/s at the drop of the rig; None if it is not known."""

    a_out: float | None
    a_back: float | None
    """Of the edge at A, extending and retracting."""
    b_out: float | None
    b_back: float | None
    """The same of the edge at B."""
    unexplained: float
    """What the balances leave over the flow that only the edges can give, of both edges together: a
    bound of the relative error of A over B. A fast command leaves much, because the spool follows
    it late."""

    @property
    def extending(self) -> float | None:
        """Of both edges while the rod extends."""
        return geometric_mean(self.a_out, self.b_out)

    @property
    def retracting(self) -> float | None:
        """Of both edges while the rod retracts."""
        return geometric_mean(self.a_back, self.b_back)

    @property
    def mean(self) -> float | None:
        """Of both directions: an offset of the valve's null cancels in it."""
        return geometric_mean(self.extending, self.retracting)

    @property
    def edge_a(self) -> float | None:
        """Of the edge at A in both directions."""
        return geometric_mean(self.a_out, self.a_back)

    @property
    def edge_b(self) -> float | None:
        """Of the edge at B in both directions."""
        return geometric_mean(self.b_out, self.b_back)


def geometric_mean(one: float | None, other: float | None) -> float | None:
    """Returns the geometric mean of two values above 0, or the one that is known."""
    if one is None or other is None:
        return one or other
    return math.sqrt(one * other)


@dataclass(frozen=True, eq=False)
class Edge:
    """Flow balance of one chamber: area * speed + stored = q_r * (out + back), all smoothed."""

    area: float
    """Of the piston at this side, m^2."""
    stored: FloatArray
    """Flow that compresses the oil, m^3/s, shape (N,)."""
    out: FloatArray
    back: FloatArray
    """Flow of the edge while the valve extends and retracts, as a share of the rated flow, (N,)."""


def edge_balances(
    record: Record, rig: Rig, moved: Motion, area: Areas, supply_pa: float | None = None
) -> tuple[Edge, Edge]:
    """Returns the flow balances of both chambers.

    Turbulent flow through an edge (Merritt, Hydraulic Control Systems, Wiley 1967, ch. 3) feeds the
    motion and compresses the oil:

        A_a v + (V_a / beta) p_a' = q_r x sqrt(dp / dp_r),  dp = p_s - p_a extending, p_a - p_t back

    and likewise at B. Without pressures, they are those of a rod without load.

    Parameters
    ----------
    record, rig, moved, area
        record without gaps, rig, and what `motion` and `areas` return of them.
    supply_pa
        absolute supply pressure, Pa; None is the measured one, or else that of the rig.
    """
    drop = rig.values["valve.rated_pressure_drop_pa"]
    p_a, p_b = _pressures(record, rig, moved.opening, area)
    supply = _supply(record, rig) if supply_pa is None else supply_pa
    tank, x = rig.values["supply.tank_pressure_pa"], moved.opening
    softness = 1.0 / rig.values["fluid.bulk_modulus_pa"] if has_pressures(record) else 0.0
    smooth = moved.kernel.smooth

    def part(opened: npt.NDArray[np.bool_], pressure: FloatArray) -> FloatArray:
        return smooth(np.where(opened, x * np.sqrt(np.maximum(pressure, 0.0) / drop), 0.0))

    out, back = x > 0.0, x < 0.0
    return (
        Edge(
            area.cap,
            area.volume_a * softness * smooth(p_a, 1),
            part(out, np.asarray(supply - p_a)),
            part(back, p_a - tank),
        ),
        Edge(
            area.annulus,
            -area.volume_b * softness * smooth(p_b, 1),
            part(out, p_b - tank),
            part(back, np.asarray(supply - p_b)),
        ),
    )


def flow_gain(
    record: Record, rig: Rig, moved: Motion, area: Areas, supply_pa: float | None = None
) -> FlowGain:
    """Estimates the rated flow from the balances of `edge_balances`, by least squares.

    The stored flow has a weight of its own: volumes and bulk modulus of a rig are hardly known.
    """
    at_a, at_b = (
        _slopes(edge.area * moved.speed, edge)
        for edge in edge_balances(record, rig, moved, area, supply_pa)
    )
    return FlowGain(*at_a[:2], *at_b[:2], math.hypot(at_a[2], at_b[2]))


def expected_speed(record: Record, rig: Rig, moved: Motion, area: Areas) -> FloatArray:
    """Speed by the values of the rig, m/s, shape (N - n + 1,): the mean of both edges."""
    rated = rig.values["valve.rated_flow_m3_s"]
    speeds = [
        (rated * (edge.out + edge.back) - edge.stored) / edge.area
        for edge in edge_balances(record, rig, moved, area)
    ]
    return np.asarray(0.5 * (speeds[0] + speeds[1]))


def has_pressures(record: Record) -> bool:
    """Whether both chamber pressures are measured."""
    return all(name in record.columns for name in CHAMBER_PRESSURES)


def _slopes(flow: FloatArray, edge: Edge) -> tuple[float | None, float | None, float]:
    """Rated flow extending and retracting, and what is left over what only the edge can give.

    None where the valve hardly opens, or if negative.
    """
    acts = np.abs(edge.out) + np.abs(edge.back) > LEAST_OPENING
    terms = np.column_stack([edge.out, edge.back])[acts]
    often = [np.count_nonzero(np.abs(term) > LEAST_OPENING) >= LEAST_SAMPLES for term in terms.T]
    if not any(often):
        return None, None, 0.0
    wanted, flow = terms, flow[acts]
    if np.ptp(edge.stored) > 0.0:
        # In units of the flow, so that no column is small beside the others.
        stored = edge.stored[acts, np.newaxis] / np.abs(flow).max()
        terms = np.column_stack([wanted, stored])
    weights = np.linalg.lstsq(terms, flow, rcond=1e-6)[0]
    own = wanted @ weights[:2]
    if terms.shape[1] > 2:
        own = own - stored @ np.linalg.lstsq(stored, own, rcond=1e-6)[0]
    left = float(np.std(flow - terms @ weights) / max(float(np.std(own)), 1e-300))
    out, back = (
        slope if there and slope > 0.0 else None
        for slope, there in zip(weights[:2].tolist(), often, strict=True)
    )
    return out, back, left


def _supply(record: Record, rig: Rig) -> npt.NDArray[np.float64] | float:
    if SUPPLY_PRESSURE in record.columns:
        return record.column(SUPPLY_PRESSURE)
    return rig.values["supply.pressure_pa"]


def _pressures(
    record: Record, rig: Rig, opening: FloatArray, area: Areas
) -> tuple[FloatArray, FloatArray]:
    """Chamber pressures, Pa, shape (N,): measured, or those of a rod that moves without load.

    Without load A_a p_a = A_b p_b, and both edges pass the flow of one speed.
    """
    if has_pressures(record):
        return record.column(CHAMBER_PRESSURES[0]), record.column(CHAMBER_PRESSURES[1])
    supply, tank = rig.values["supply.pressure_pa"], rig.values["supply.tank_pressure_pa"]
    part = area.annulus / area.cap
    square = part**-2
    out_b = (supply + square * tank) / (part + square)
    back_b = (square * supply + tank) / (part + square)
    p_b = np.where(opening > 0.0, out_b, back_b)
    return np.asarray(part * p_b), np.asarray(p_b)

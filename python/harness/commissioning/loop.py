# SPDX-License-Identifier: MIT
"""Loop gains with margins over the interval of a servo, from calm to fast.

    G(s) = K wn^2 / (s (s^2 + 2 xi wn s + wn^2)) V(s) exp(-s T)

is Eq. (5) of docs/servo_model.md with the spool V and the delay T. Two controllers:

- P with velocity feed-forward, u = (k (r - y) + r') / K, L = k G / K (Merritt, Hydraulic Control
  Systems, Wiley 1967, ch. 8);
- a pole placement, which feeds back velocity and acceleration, too: it damps the pair of the oil
  spring to zeta at its own wn, and puts the third pole at -p. Comparing the coefficients of
  (s + p)(s^2 + 2 zeta wn s + wn^2) with those of the loop gives (Jelali, Kroll, Hydraulic
  Servo-systems, Springer 2003, ch. 7)

    k_p = p / K,   k_v = 2 zeta p / (K wn),   k_a = (p + 2 (zeta - xi) wn) / (K wn^2).

  Spool and delay turn what is fed back, by V exp(-j wn T) at wn. There the sum of velocity and
  acceleration is turned back, which makes other k_v and k_a; without spool and delay, these.

Margins are the worst over a grid of the intervals, not over its corners alone: with a spool as fast
as the oil spring the worst case may lie between them.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..base.numbers import FloatArray
from ..diagnosis.schema import Estimate

ComplexArray = npt.NDArray[np.complex128]

# Margins of the fastest loop: 6 dB and 45 degrees (Astrom, Hagglund, Advanced PID Control, ISA
# 2006, sec. 4.6: gain margins of 2 to 5 and phase margins of 30 to 60 degrees).
LEAST_GAIN_MARGIN, LEAST_PHASE_MARGIN = 2.0, 45.0
# The calmest loop is so much slower than the fastest.
CALM = 0.25
# Of the speed that the middle of the interval allows, the worst case must leave this share.
LEAST_SHARE = 0.25
# A loop that is slower, in 1/s, is none that a commissioner would take home.
SLOWEST = 0.3
FASTEST = 500.0
# Dampings of the pole placement that are tried, the best first.
DAMPINGS = (0.5, 0.35, 0.2, 0.1, 0.05)
# Frequencies over wn; the resonance of a servo with a damping of 0.01 is 0.02 wide.
_GRID = np.unique(np.concatenate([np.geomspace(1e-4, 30.0, 900), np.linspace(0.8, 1.25, 451)]))


@dataclass(frozen=True)
class Servo:
    """A servo as the design needs it; the delay of the controller's cycle comes on top."""

    gain: Estimate
    """K, m/(s V)."""
    omega_n: Estimate
    """rad/s."""
    xi: Estimate
    delay_s: float = 0.0
    valve_rad_s: Estimate | None = None
    """Natural frequency of the spool, rad/s; None where it counts as infinitely fast."""
    valve_damping: float = 0.9

    @property
    def middle(self) -> Servo:
        """The same without intervals."""
        valve = None if self.valve_rad_s is None else _point(self.valve_rad_s)
        gain, omega_n, xi = (_point(one) for one in (self.gain, self.omega_n, self.xi))
        return Servo(gain, omega_n, xi, self.delay_s, valve, self.valve_damping)

    def path(
        self, omega: FloatArray, delay_s: float, valve: float | FloatArray = 0.0
    ) -> ComplexArray:
        """Returns V(s) exp(-s T) at angular frequencies, with `delay_s` more; `valve` in rad/s."""
        spool = math.inf if self.valve_rad_s is None else self.valve_rad_s.value
        s = 1j * omega
        with np.errstate(invalid="ignore"):
            lag = s / np.where(np.asarray(valve) > 0.0, valve, spool)
        lagging: ComplexArray = lag**2 + 2.0 * self.valve_damping * lag + 1.0
        return np.asarray(np.exp(-s * (self.delay_s + delay_s)) / lagging)

    def cases(self) -> FloatArray:
        """Returns K, omega_n, xi and the spool's frequency over the grid, shape (cases, 4)."""
        valve = self.valve_rad_s or Estimate(math.inf, math.inf, math.inf)
        axes = (
            (self.gain.low, self.gain.high),
            np.linspace(self.omega_n.low, self.omega_n.high, 5),
            (self.xi.low, self.xi.value, self.xi.high),
            (valve.low, valve.value, valve.high),
        )
        return np.array(list(itertools.product(*(sorted({*map(float, axis)}) for axis in axes))))


def _point(estimate: Estimate) -> Estimate:
    return Estimate(estimate.value, estimate.value, estimate.value)


@dataclass(frozen=True)
class Margins:
    """Margins of a loop; those of the worst case of an interval."""

    gain: float
    """Factor by which the gain may rise, 1 and less for an unstable loop."""
    phase_deg: float
    """Lag that may be added at the crossings of the gain, degrees."""

    @property
    def gain_db(self) -> float:
        """The gain margin in dB."""
        return 20.0 * math.log10(max(self.gain, 1e-9))

    @property
    def enough(self) -> bool:
        """Whether they are those of the fastest loop or better."""
        return self.gain >= LEAST_GAIN_MARGIN and self.phase_deg >= LEAST_PHASE_MARGIN


UNSTABLE = Margins(0.0, -180.0)


@dataclass(frozen=True)
class Gains:
    """Gains of a controller, which feeds back the position error, velocity and acceleration."""

    pole: float
    """k in 1/s: position errors decay as exp(-k t)."""
    position: float
    """V/m."""
    velocity: float
    """V s/m."""
    acceleration: float
    """V s^2/m."""
    feed_forward: float
    """V s/m of the velocity of the reference."""
    damping: float | None
    """zeta of the pole placement; None for P."""
    worst: Margins
    """Over the interval of the servo."""
    middle: Margins
    """Of the values without their intervals."""
    fastest: float
    """The k of speed = 1, 1/s."""


def response(
    servo: Servo, delay_s: float, omega: FloatArray | None = None
) -> tuple[FloatArray, ComplexArray]:
    """Frequency responses of G over all cases of the servo.

    Parameters
    ----------
    servo
        the servo.
    delay_s
        delay of the controller, s, added to that of the servo.
    omega
        angular frequencies, rad/s, shape (n,); by default a grid for each case.

    Returns
    -------
    Frequencies and responses, both of shape (cases, n).
    """
    cases = servo.cases()
    gain, omega_n, xi, valve = (cases[:, i : i + 1] for i in range(4))
    at = omega_n * _GRID if omega is None else np.broadcast_to(omega, (len(cases), omega.size))
    s = 1j * at
    g = gain * omega_n**2 / (s * (s**2 + 2.0 * xi * omega_n * s + omega_n**2))
    return at, g * servo.path(at, delay_s, valve)


def margins(loop: ComplexArray) -> Margins:
    """Worst margins of loops with one integrator and otherwise stable parts, shape (cases, n).

    A loop is stable if 1 + L does not turn about zero (Nyquist).
    """
    turned = np.unwrap(np.angle(1.0 + loop), axis=1)
    if np.any(np.abs(turned[:, -1]) > 0.5 * math.pi) or np.any(np.abs(turned[:, 0]) > math.pi):
        return UNSTABLE
    size = np.abs(loop)
    angle = np.unwrap(np.angle(loop), axis=1)
    # The real axis is crossed to the left of zero where the imaginary part changes its sign there.
    left, right = loop[:, :-1], loop[:, 1:]
    share = np.clip(
        left.imag / np.where(left.imag == right.imag, 1.0, left.imag - right.imag), 0, 1
    )
    crossing = left.real + share * (right.real - left.real)
    crosses = (left.imag * right.imag <= 0.0) & (crossing < 0.0)
    deepest = np.max(np.where(crosses, -crossing, 0.0))
    # At a crossing of |L| = 1 the phase is linear in the logarithm of the gain.
    below, above = np.log(size[:, :-1]), np.log(size[:, 1:])
    unity = below * above <= 0.0
    part = below / np.where(below == above, 1.0, below - above)
    phase = np.where(unity, angle[:, :-1] + part * (angle[:, 1:] - angle[:, :-1]), 0.0)
    apart = np.degrees(np.abs(np.mod(phase, 2.0 * math.pi) - math.pi))
    closest = np.min(np.where(unity, apart, 180.0))
    return Margins(1.0 / deepest if deepest > 0.0 else math.inf, float(closest))


@dataclass(frozen=True, eq=False)
class _Design:
    """One kind of controller on one servo: loops and margins over k."""

    servo: Servo
    delay_s: float
    damping: float | None
    at: FloatArray
    plant: ComplexArray

    @classmethod
    def of(cls, servo: Servo, delay_s: float, damping: float | None) -> _Design:
        return cls(servo, delay_s, damping, *response(servo, delay_s))

    def feedback(self, k: float) -> tuple[float, float, float]:
        """Position, velocity and acceleration gain, V for m, m/s and m/s^2."""
        servo = self.servo
        gain, wn, xi = servo.gain.value, servo.omega_n.value, servo.xi.value
        if self.damping is None:
            return k / gain, 0.0, 0.0
        v = 2.0 * self.damping * k / (gain * wn)
        a = (k + 2.0 * (self.damping - xi) * wn) / (gain * wn**2)
        turned = (1j * wn * v - wn**2 * a) / complex(servo.path(np.array(wn), self.delay_s))
        turned_v = turned.imag / wn
        # So that the slow pole stays: without oil spring it is at k_p K / (1 + K k_v).
        p = k / gain * (1.0 + gain * turned_v) / (1.0 + gain * v)
        return p, turned_v, -turned.real / wn**2

    def margins(self, k: float) -> Margins:
        p, v, a = self.feedback(k)
        if not p > 0.0:
            return UNSTABLE
        s = 1j * self.at
        return margins((p + v * s + a * s**2) * self.plant)

    def fastest(self) -> float:
        """Largest k with enough margins, 1/s; 0 where there is none."""
        tried = np.geomspace(SLOWEST / 4.0, FASTEST, 32)
        good = 0.0
        for k in tried:
            if not self.margins(float(k)).enough:
                break
            good = float(k)
        if good in (0.0, tried[-1]):
            return good
        low, high = good, good * float(tried[1] / tried[0])
        for _ in range(8):
            k = math.sqrt(low * high)
            low, high = (k, high) if self.margins(k).enough else (low, k)
        return low


def gains_of(servo: Servo, cycle_s: float, speed: float, *, placed: bool) -> Gains | str:
    """Designs a loop; returns the reason where the model cannot carry one.

    Parameters
    ----------
    servo
        the servo with its intervals.
    cycle_s
        cycle time of the controller, s: one cycle to compute and half of one that is held.
    speed
        from 0, calm, to 1, fast: the largest k with a gain margin of 6 dB and a phase margin of 45
        degrees in the worst case; at 0 a quarter of that.
    placed
        whether to place the poles, which needs velocity and acceleration.
    """
    delay = 1.5 * cycle_s
    designs = [
        _Design.of(servo, delay, damping)
        for damping in ([one for one in DAMPINGS if one > servo.xi.value] if placed else [None])
    ]
    if not designs:
        return f"xi is {servo.xi.value:.2g}: P needs no more damping"
    reached = [design.fastest() for design in designs]
    fastest = max(reached)
    best = designs[reached.index(fastest)]
    of_middle = [best] if fastest > 0.0 else designs
    middle_k = max(_Design.of(servo.middle, delay, one.damping).fastest() for one in of_middle)
    if middle_k < SLOWEST:
        return (
            "margin not reachable: even with the values in the middle of their intervals no gain "
            f"of {SLOWEST:g} 1/s and more leaves 6 dB and 45 degrees. omega_n is "
            f"{servo.omega_n.value:.3g} rad/s, xi {servo.xi.value:.2g}{_spool(servo)}, the delay "
            f"{1e3 * (delay + servo.delay_s):.3g} ms: a faster valve or cycle would help"
        )
    if fastest < max(SLOWEST, LEAST_SHARE * middle_k):
        widths = {"K": servo.gain, "omega_n": servo.omega_n, "xi": servo.xi}
        widest = max(widths, key=lambda name: widths[name].high / max(widths[name].low, 1e-9))
        return (
            f"the interval of the model is too wide: the worst case in it allows {fastest:.2g} "
            f"1/s, its middle {middle_k:.2g} 1/s. The widest is {widest}, "
            f"{widths[widest].low:.3g} to {widths[widest].high:.3g}: take a record that shows it"
        )
    k = fastest * CALM ** (1.0 - speed)
    p, v, a = best.feedback(k)
    return Gains(
        k,
        p,
        v,
        a,
        1.0 / servo.gain.value + v,
        best.damping,
        best.margins(k),
        _Design.of(servo.middle, delay, best.damping).margins(k),
        fastest,
    )


def _spool(servo: Servo) -> str:
    return "" if servo.valve_rad_s is None else f", the spool {servo.valve_rad_s.value:.3g} rad/s"

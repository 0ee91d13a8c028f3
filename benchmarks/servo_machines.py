# SPDX-License-Identifier: MIT
"""Servos with a noisy position sensor, each made of a seed, for `servo_estimator.py`.

Half of them are linear, Eq. (5). The others have some of: flow by the square root of the pressure
drop, a dead band of 3 % of 10 V, Coulomb friction of 10 % of the largest force, less flow in one
direction, a constant load. Commands are PRBS, random steps, a multisine (open loop), and a P loop
with steps or with one sine that it can follow. Needs numba, which the extra `lab` brings.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numba import njit
from scipy.optimize import least_squares

FloatArray = npt.NDArray[np.float64]
COMMANDS = ("prbs", "steps", "multisine", "loop_steps", "loop_sine")
RUNS = ("none", "change", "hold", "delay", "glitch", "null")
LARGEST_V, DEAD_BAND_V, NULL_V = 10.0, 0.3, 0.3
CHANGED_GAIN, CHANGED_OMEGA_N = 1.5, 0.8
# A nonlinear servo of which a linear one explains less has no K that could be right.
LEAST_EXPLAINED = 0.7
# Steps of the integration, of 1 / omega_n. Its omega_n is too large by PIECE^2 / 24 = 4e-6 of it,
# far less than the narrowest interval.
PIECE = 0.01


@dataclass(frozen=True)
class Run:
    """A record, and the servo that it is of from each of these samples on: (K, omega_n, xi)."""

    seed: int
    linear: bool
    command_kind: str
    kind: str
    dt_s: float
    command: npt.NDArray[np.float32]
    position: npt.NDArray[np.float32]
    truth: tuple[tuple[int, float, float, float], ...]

    def true_at(self, samples: npt.NDArray[np.intp]) -> FloatArray:
        """Returns K, omega_n, xi at these samples, shape (3, n)."""
        begins = np.array([part[0] for part in self.truth])
        values = np.array([part[1:] for part in self.truth])
        return np.asarray(values[np.searchsorted(begins, samples, side="right") - 1].T)


@dataclass(frozen=True)
class _Servo:
    gain: float
    omega_n: float
    xi: float
    dt_s: float
    noise_m: float
    step_m: float
    dead_band_v: float = 0.0
    other_side: float = 1.0
    most: float = 0.0  # largest acceleration; 0: flow does not depend on it
    friction: float = 0.0
    load: float = 0.0


@njit(cache=True)
def _half_step(a, dt, flow, v, omega_n, most):  # type: ignore[no-untyped-def]
    """Returns the acceleration after dt; most > 0: flow by the root of the pressure drop."""
    if most <= 0.0:
        return a + dt * omega_n * omega_n * (flow - v)
    middle = a
    for part in (0.5, 1.0):
        drop = 1.0 - math.copysign(1.0, flow) * middle / most
        through = flow * math.copysign(math.sqrt(abs(drop)), drop)
        middle = a + part * dt * omega_n * omega_n * (through - v)
    return min(most, max(-most, middle))


@njit(cache=True)
def _simulated(
    command, reference, closed, kp, dt_s, changed_at, gain, omega_n, xi, dead_band, other_side,
    most, friction, load, null, late, held_from, held_to, noise, step_m,
):  # type: ignore[no-untyped-def]  # fmt: skip
    """Returns command, measured and true position; the accelerations are those of load pressure.

    Half a step of the acceleration, a step of the velocity, half a step of the acceleration (G.
    Strang, SIAM J. Numer. Anal. 5 (1968) 506), each by its midpoint: of second order.
    """
    count = noise.size
    sent, measured, true = np.zeros(count), np.zeros(count), np.zeros(count)
    x, v, a = 0.0, 0.0, load
    pieces = max(4, math.ceil(dt_s * omega_n / PIECE))
    dt = dt_s / pieces
    for k in range(count):
        if k == changed_at:
            gain, omega_n = 1.5 * gain, 0.8 * omega_n
        true[k] = x
        seen = x + noise[k]
        if step_m > 0.0:
            seen = step_m * math.floor(seen / step_m + 0.5)
        measured[k] = seen
        holds = held_from <= k < held_to
        if closed:
            u = kp * (reference[held_from if holds else k] - seen)
        else:
            u = 0.0 if holds else command[k]
        sent[k] = min(10.0, max(-10.0, u))
        acting = (sent[k - late] if k >= late else 0.0) - null
        if abs(acting) <= dead_band:
            acting = 0.0
        elif dead_band > 0.0:
            acting -= math.copysign(dead_band, acting)
        if acting < 0.0:
            acting *= other_side
        flow = gain * acting
        for _ in range(pieces):
            a = _half_step(a, 0.5 * dt, flow, v, omega_n, most)
            # The velocity drags itself along by the damping: v' = pull - 2 xi omega_n v
            pull, before = a - load, v
            share = xi * omega_n * dt
            if friction > 0.0:
                if v == 0.0:
                    pull = 0.0 if abs(pull) <= friction else pull - math.copysign(friction, pull)
                else:
                    pull -= math.copysign(friction, v)
            v = ((1.0 - share) * v + dt * pull) / (1.0 + share)
            if friction > 0.0 and v * before < 0.0:
                v = 0.0
            x += 0.5 * dt * (before + v)
            a = _half_step(a, 0.5 * dt, flow, v, omega_n, most)
    return sent, measured, true


@njit(cache=True)
def _moved(command, late, null, gain, step):  # type: ignore[no-untyped-def]
    """Returns what a linear servo moves in each sample, by the matrix of `_displacements`."""
    moved = np.zeros(command.size)
    v, a = 0.0, 0.0
    for k in range(command.size):
        demand = gain * ((command[k - late] if k >= late else 0.0) - null)
        moved[k] = step[0, 1] * v + step[0, 2] * a + step[0, 3] * demand
        v, a = (
            step[1, 1] * v + step[1, 2] * a + step[1, 3] * demand,
            step[2, 1] * v + step[2, 2] * a + step[2, 3] * demand,
        )
    return moved


def _displacements(
    command: FloatArray, late: int, gain: float, rate: float, xi: float, null: float
) -> FloatArray:
    """Returns what the linear servo moves in each sample; gain and rate are K dt and omega_n dt."""
    # Position, velocity, acceleration and the demanded velocity, which is held, over 1 / 1024 of a
    # sample: the series to degree 4 leaves (rate / 1024)^5 / 120. Then twice the time, ten times.
    system = np.zeros((4, 4))
    system[0, 1] = system[1, 2] = 1.0
    system[2, 1:] = -rate * rate, -2.0 * xi * rate, rate * rate
    step, term = np.eye(4), np.eye(4)
    for degree in range(1, 5):
        term = term @ system / (1024.0 * degree)
        step += term
    for _ in range(10):
        step = step @ step
    return np.asarray(_moved(command, late, null, gain, step))


def _fitted(
    command: FloatArray, true: FloatArray, late: int, start: tuple[float, float, float]
) -> tuple[float, float, float, float]:
    """Returns K dt, omega_n dt and xi of the linear servo nearest to a motion, and its share.

    Compared is the free run, by displacements. What the motion does not show, under one sine, stays
    at the values of small motion: a term as large as an error of 3 % holds it there.
    """
    moved = np.diff(true)
    scale = float(moved.std()) + 1e-30
    skipped = min(moved.size // 4, int(8.0 / start[1]) + 5)
    begin = np.array([*np.log(start), 0.0])

    def errors(at: FloatArray) -> FloatArray:
        gain, rate, xi = np.exp(at[:3])
        found = _displacements(command[: moved.size], late, gain, rate, xi, at[3])
        error = (found - moved)[skipped:] / scale
        return np.append(error, 0.03 * math.sqrt(error.size) * (at[1:3] - begin[1:3]))

    low = begin + np.array([-5.0, -1.5, -2.0, -3.0])
    high = begin + np.array([5.0, 1.5, 2.0, 3.0])
    found = least_squares(
        errors, begin, x_scale=[0.1, 0.1, 0.2, 0.3], bounds=(low, high), max_nfev=25
    )
    left = float(np.mean(found.fun[:-2] ** 2))
    share = 1.0 - left / float(np.mean((moved[skipped:] / scale) ** 2))
    gain, rate, xi = np.exp(found.x[:3])
    return float(gain), float(rate), float(xi), share


def _command(kind: str, rng: np.random.Generator, servo: _Servo, count: int) -> FloatArray:
    per_turn = 1.0 / servo.omega_n / servo.dt_s
    if kind == "prbs":
        hold = max(1, int(rng.uniform(1, 4) * per_turn))
        return np.repeat(rng.choice([-1.0, 1.0], count // hold + 1), hold)[:count] * rng.uniform(
            1, 5
        )
    if kind == "steps":
        out, at, size = np.zeros(count), 0, rng.uniform(2, 6)
        hold = rng.uniform(3, 20) * per_turn
        while at < count:
            end = at + max(1, int(rng.exponential(hold)))
            out[at:end], at = rng.uniform(-size, size), end
        return out
    time_s = servo.dt_s * np.arange(count)
    fastest = min(1.5 * servo.omega_n, 2.5 / servo.dt_s)
    omegas = np.geomspace(0.05 * servo.omega_n, fastest, 12)
    waves = np.sin(np.outer(omegas, time_s) + rng.uniform(0, 2 * np.pi, 12)[:, None]).sum(0)
    return np.asarray(waves / waves.std() * rng.uniform(1, 3))


def _reference(
    kind: str, rng: np.random.Generator, servo: _Servo, count: int, kp: float
) -> FloatArray:
    if kind == "loop_steps":
        period = max(rng.uniform(8, 30) / servo.omega_n, 4.0 / (kp * servo.gain))
        hold = max(1, int(period / servo.dt_s))
        sizes = rng.uniform(2, 12) / kp * rng.uniform(0.6, 1, count // hold + 1)
        return np.repeat(sizes * np.where(np.arange(sizes.size) % 2 == 0, 1, -1), hold)[:count]
    omega = rng.uniform(0.1, 0.6) * kp * servo.gain
    speed = rng.uniform(2, 6) * servo.gain
    return np.asarray(speed / omega * np.sin(omega * servo.dt_s * np.arange(count)))


def _made(rng: np.random.Generator, linear: bool, largest_v: float, base: _Servo) -> _Servo:
    if linear:
        return base
    has = np.zeros(5, dtype=bool)
    while not has.any():
        has = rng.random(5) < 0.6
    usual = base.omega_n * base.gain * largest_v
    most = max(rng.uniform(2, 4) * 2 * base.xi, rng.uniform(1.2, 3)) * usual
    reach = most if has[0] or has[4] else 2.5 * usual
    return _Servo(
        base.gain, base.omega_n, base.xi, base.dt_s, base.noise_m, base.step_m,
        dead_band_v=DEAD_BAND_V if has[1] else 0.0,
        other_side=rng.uniform(0.6, 0.9) if has[3] else 1.0,
        most=reach if has[0] or has[4] else 0.0,
        friction=0.1 * reach if has[2] else 0.0,
        load=rng.uniform(-0.5, 0.5) * reach if has[4] else 0.0,
    )  # fmt: skip


def runs_of(seed: int) -> list[Run]:
    """Returns the runs of one servo: odd seeds are nonlinear, and the commands take turns."""
    rng = np.random.default_rng([seed, 20261125])
    linear, kind = seed % 2 == 0, COMMANDS[seed // 2 % len(COMMANDS)]
    omega_n = 0.0
    while not 15.0 <= omega_n <= 600.0:
        dt_s, rate = (math.exp(rng.uniform(*np.log(ends))) for ends in ((1e-3, 0.05), (0.02, 2.5)))
        omega_n = rate / dt_s
    gain = math.exp(rng.uniform(*np.log((0.005, 0.5))))
    noise_m = math.exp(rng.uniform(*np.log((0.5e-6, 50e-6))))
    base = _Servo(
        gain, omega_n, rng.uniform(0.1, 0.9), dt_s, noise_m, noise_m * int(rng.integers(0, 3))
    )
    count = int(rng.uniform(20, 60) / dt_s)
    slowest = min(0.8 * base.xi * omega_n, 0.25 / dt_s, 0.4 * omega_n)
    kp = rng.uniform(0.4, 0.9) * slowest / gain
    closed = kind.startswith("loop")
    zeros = np.zeros(count)
    command = zeros if closed else _command(kind, rng, base, count)
    reference = _reference(kind, rng, base, count, kp) if closed else zeros
    servo = _made(rng, linear, 5.0 if closed else float(np.abs(command).max()), base)
    made = []
    for number, run in enumerate(RUNS):
        noise_rng = np.random.default_rng([seed, number])
        middle = count // 2
        held_to = middle + int(noise_rng.uniform(5, 10) / dt_s) if run == "hold" else -1
        late = 1 if run == "delay" else 0
        sent, measured, true = _simulated(
            command, reference, closed, kp, dt_s, middle if run == "change" else -1, gain, omega_n,
            servo.xi, servo.dead_band_v, servo.other_side, servo.most, servo.friction, servo.load,
            NULL_V if run == "null" else 0.0, late, middle if run == "hold" else -1, held_to,
            noise_rng.normal(0.0, noise_m, count), servo.step_m,
        )  # fmt: skip
        if run == "glitch":
            measured[middle + 7] += 60.0 * noise_m + 0.002
        parts = [(0, middle), (middle, count)] if run == "change" else [(0, count)]
        truth = []
        for part, (begin, end) in enumerate(parts):
            of_part = (1.0, 1.0) if part == 0 else (CHANGED_GAIN, CHANGED_OMEGA_N)
            start = (gain * dt_s * of_part[0], rate * of_part[1], servo.xi)
            share = 1.0
            if not linear:
                # The fit of a part begins in motion: what comes before it is skipped.
                first = max(0, begin - int(20.0 / start[1]))
                *start, share = _fitted(sent[first:end], true[first:end], late, start)  # type: ignore[assignment]
            if share > LEAST_EXPLAINED:
                truth.append((begin, start[0] / dt_s, start[1] / dt_s, start[2]))
        if len(truth) == len(parts):
            record = (sent.astype(np.float32), measured.astype(np.float32))
            made.append(Run(seed, linear, kind, run, dt_s, *record, tuple(truth)))
    return made

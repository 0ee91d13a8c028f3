# SPDX-License-Identifier: MIT
"""Distribution of the calibrated error above the noise floor over regimes, frequency and time.

The errors of an output are divided by the rms of the measured output about its window's mean, as in
the nrmse of the contract. A share is a part of the sum of squares,
from which the sum of squares of the noise floor is subtracted.

Whether the metering edges of the valve, which no pressure shows, can stand for a load force.

Quantisation of the position sensor: the record shows it without a fit.

It belongs to the noise floor, so that it does not shrink the gap.

Place of the structural gap by subsystem, regime, frequency and time, with contradictions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.fft import dct

from ...base.numbers import FloatArray
from ...catalogue.parameters import effects
from ...rigs import Rig
from ..data.floor import sensor_step
from ..data.regimes import drawn_windows, interval
from ..model.case import Case
from ..model.comparison import Compared
from ..schema import (
    SUBSYSTEM_TAKES_PART,
    SUBSYSTEMS,
    Band,
    Equation,
    Estimate,
    Regime,
    Span,
    Value,
    Where,
)
from .candidates import FittedCandidate
from .identifiability import conditions

# Conditions that hold for less than a hundredth of the time are not listed: that is 0.2 s of 20 s.
LEAST_TIME = 0.01
# Lower ends of the bands: drift; what a position loop follows; oil spring and valve; above both.
BANDS_HZ = (0.0, 2.0, 10.0, 50.0)
# A stretch of the record is listed if its windows, 2.5 s or more, hold 1.5 times their share of the
# gap.
SPAN_WINDOWS = 5
SPAN_EXCESS = 1.5


@dataclass(frozen=True)
class Maps:
    """Shares of the gap above the noise floor; empty where the errors do not exceed it."""

    regimes: tuple[Regime, ...] = ()
    frequency: tuple[Band, ...] = ()
    time: tuple[Span, ...] = ()


def maps(
    compared: Sequence[Compared],
    errors: Mapping[str, FloatArray],
    floors: Mapping[str, float],
    rig: Rig,
    *,
    seed: int = 0,
) -> Maps:
    """Computes the maps of the errors inside the windows of all records.

    Parameters
    ----------
    compared
        the records, in the order of the errors.
    errors
        simulated minus measured by output, shape (sum of the samples inside windows,), as
        `Problem.errors` gives them.
    floors
        standard deviation of the noise by output, in the unit of the output.
    rig
        the rig as configured.
    seed
        seed of the bootstrap over whole windows.
    """
    spread = {
        name: float(np.mean(np.concatenate([c.centred(c.outputs[name]) for c in compared]) ** 2))
        for name in errors
    }
    window = window_numbers_of(compared)
    shares = [(e, spread[name], floors[name] ** 2) for name, e in errors.items()]
    energy = np.sum([(e**2 - f) / s for e, s, f in shares], axis=0)
    by_window = np.asarray(np.bincount(window, energy), dtype=np.float64)
    if float(by_window.sum()) <= 0.0:
        return Maps()
    draws = drawn_windows(by_window.size, seed)
    regimes = []
    for condition, holds in conditions(compared, rig).items():
        of_time = float(np.mean(holds))
        if of_time >= LEAST_TIME:
            inside = np.asarray(np.bincount(window, energy * holds), dtype=np.float64)
            share = _share(inside, by_window, draws)
            regimes.append(Regime(condition, share.value, of_time, share.ci90))
    regimes.sort(key=lambda regime: -regime.share)
    return Maps(
        tuple(regimes),
        tuple(_bands(compared, shares, window, by_window, draws)),
        tuple(_spans(compared, by_window)),
    )


def window_numbers_of(compared: Sequence[Compared]) -> npt.NDArray[np.int64]:
    """Returns the window number of each sample inside windows, counted through all records."""
    numbers: list[npt.NDArray[np.int64]] = []
    offset = 0
    for record in compared:
        _, inside = np.unique(record.window[record.used], return_inverse=True)
        numbers.append(inside.astype(np.int64) + offset)
        offset = int(numbers[-1][-1]) + 1
    return np.concatenate(numbers)


def _share(part: FloatArray, whole: FloatArray, draws: npt.NDArray[np.int64]) -> Value:
    """Returns the share of `part` in `whole`, both summed over windows, inside [0, 1].

    The interval follows from a bootstrap over windows.
    """
    wholes = whole[draws].sum(axis=1)
    positive = wholes > 0.0
    drawn = part[draws].sum(axis=1)[positive] / wholes[positive]
    value = float(part.sum() / whole.sum())
    low, high = interval(drawn)
    value, low, high = np.clip([value, min(low, value), max(high, value)], 0.0, 1.0).tolist()
    return Value(value, (low, high))


def _bands(
    compared: Sequence[Compared],
    shares: Sequence[tuple[FloatArray, float, float]],
    window: npt.NDArray[np.int64],
    by_window: FloatArray,
    draws: npt.NDArray[np.int64],
) -> list[Band]:
    """Returns the share of each frequency band, from the cosine transform (DCT-II) of each window.

    The transform is orthonormal, so that its squares add up to those of the samples. It continues a
    window evenly, so that a drift over the window does not leak into all bands as with a Fourier
    transform (N. Ahmed, T. Natarajan, K. R. Rao, IEEE Trans. Comput. C-23, 1974).
    """
    nyquist = 0.5 / max(record.dt_s for record in compared)
    edges = [edge for edge in BANDS_HZ if edge < nyquist] + [nyquist]
    inside = np.zeros((len(edges) - 1, by_window.size))
    dts = np.concatenate(
        [np.full(np.count_nonzero(record.used), record.dt_s) for record in compared]
    )
    begins = np.flatnonzero(np.diff(window, prepend=-1))
    for number, (begin, end) in enumerate(zip(begins, [*begins[1:], window.size], strict=True)):
        # Coefficient k has k / 2 periods over the n samples of the window.
        hz = 0.5 * np.arange(end - begin) / ((end - begin) * dts[begin])
        band = np.minimum(np.searchsorted(edges, hz, side="right"), len(edges) - 1) - 1
        power = np.sum(
            [(dct(e[begin:end], norm="ortho") ** 2 - f) / s for e, s, f in shares], axis=0
        )
        inside[:, number] = np.bincount(band, power, minlength=len(edges) - 1)
    return [
        Band((float(low), float(high)), share.value, share.ci90)
        for low, high, part in zip(edges, edges[1:], inside, strict=False)
        for share in (_share(part, by_window, draws),)
    ]


def _spans(compared: Sequence[Compared], by_window: FloatArray) -> list[Span]:
    """Returns the stretches of the records that hold much more of the gap than others.

    They consist of runs of SPAN_WINDOWS windows, each with over SPAN_EXCESS times its mean share.
    """
    total, offset, spans = float(by_window.sum()), 0, []
    least_share = SPAN_EXCESS * SPAN_WINDOWS / by_window.size
    ones = np.ones(SPAN_WINDOWS)
    for compared_record in compared:
        samples = np.flatnonzero(compared_record.used)
        numbers, first = np.unique(compared_record.window[samples], return_index=True)
        ends = samples[np.append(first[1:], samples.size) - 1] + 1
        share = by_window[offset : offset + numbers.size] / total
        offset += numbers.size
        start_s = (
            0.0
            if compared_record.record.time_s is None
            else float(compared_record.record.time_s[0])
        )
        # Other blocks lie between those that are held out; a stretch does not reach across them.
        for part in np.split(np.arange(numbers.size), np.flatnonzero(np.diff(numbers) > 1) + 1):
            if part.size < SPAN_WINDOWS:
                continue
            exceeds = np.convolve(share[part], ones, mode="valid") > least_share
            member = np.convolve(exceeds, ones) > 0.5
            edges = np.flatnonzero(np.diff(np.concatenate([[False], member, [False]])))
            for begin, end in part[0] + edges.reshape(-1, 2):
                span_s = (
                    start_s + float(samples[first[begin]]) * compared_record.dt_s,
                    start_s + float(ends[end - 1]) * compared_record.dt_s,
                )
                gap_share = float(share[begin:end].sum())
                spans.append(Span(span_s, gap_share, compared_record.record.name))
    return spans


# Rounding makes most of the noise if its deviation is half of that of the noise. On the development
# records it was a twentieth to a ninth without the effect, and three quarters and more with it.
STEP_OF_FLOOR = 0.5
# More than twice the sensor noise in the rig file is no longer that noise.
STEP_OF_RIG_NOISE = 2.0
# Smallest step, share of the stroke: a resolution of fourteen bits over the stroke is usual.
LEAST_STEP = 6e-5
# Files hold the levels with four digits and more.
STEP_SCATTER = 1e-3

QUANTISATION = "sensor_quantisation"


def position_step(case: Case, exclude: Sequence[str] = ()) -> Estimate | None:
    """Returns the step of the position, m, if it is larger than a sensor has anyway, else None.

    Its rounding noise, q / sqrt(12) (W. R. Bennett, Bell Syst. Tech. J. 27(3), 1948), must make up
    most of the noise floor where that is lowest, since motion can hide the noise elsewhere, and
    exceed the sensor noise in the rig file. The step must be the same in all records.
    """
    if QUANTISATION in (*case.rig.effects(), *exclude) or "position_m" not in case.floors:
        return None
    steps = [sensor_step(record.column("position_m")) for record in case.records]
    step = min(steps)
    if step <= 0.0 or max(steps) > (1.0 + STEP_SCATTER) * step:
        return None
    noise = step / math.sqrt(12.0)
    rig_noise = case.rig.sensors.get("position_noise_m", 0.0)
    stroke = case.rig.values.get("cylinder.stroke_m") or _travel(case)
    if (
        noise < STEP_OF_FLOOR * case.floors["position_m"].low
        or noise < STEP_OF_RIG_NOISE * rig_noise
        or step < LEAST_STEP * stroke
    ):
        return None
    return Estimate(step, (1.0 - STEP_SCATTER) * step, (1.0 + STEP_SCATTER) * step)


def _travel(case: Case) -> float:
    positions = [record.column("position_m") for record in case.records]
    return float(max(p.max() for p in positions) - min(p.min() for p in positions))


# A subsystem with a twentieth of the gap hardly takes part in it.
SUBSYSTEM_SMALL = 0.05

# Parts whose shares are at least this share of the largest one explain the gap alike.
ALIKE = 0.5


def localise(
    case: Case,
    calibrated: FittedCandidate,
    best: FittedCandidate | None,
    *,
    equations: Sequence[Equation] = (),
    shares: Mapping[str, float] | None = None,
    laws: Sequence[tuple[str, float]] = (),
    others: Sequence[tuple[Sequence[str], float]] = (),
) -> Where:
    """Combines the shares of the equations, the selected effects and the maps of the gap.

    Parameters
    ----------
    case
        rig and records.
    calibrated
        the fit without effects.
    best
        the fit with the selected effects; None, or a fit without effects, where there are none.
    equations
        what each equation lacks beside the rig without effects.
    shares
        share of the held-out gain by id of the effect; by default all are equal.
    laws
        subsystem and share of the held-out gain of each law without a name.
    others
        sets that the data cannot tell from the selected one, with the odds of each against it.
    """
    problem = case.problem(held_out=True)
    floors = {name: floor.value for name, floor in case.floors.items()}
    mapped = maps(problem.records, problem.errors(calibrated.x), floors, case.rig)
    of_equations = _by_subsystem(equations)
    selected = best.effects if best is not None else ()
    if selected or laws:
        answers = [(_effect_shares(selected, shares, laws), 1.0)]
        answers += [(_effect_shares(effects, None), odds) for effects, odds in others]
        subsystem = _mean(answers)
        notes = _contradictions(subsystem, of_equations)
    else:
        subsystem, notes = of_equations, _undecided(of_equations)
    all_subsystems = {name: subsystem.get(name, 0.0) for name in SUBSYSTEMS} if subsystem else {}
    return Where(
        all_subsystems,
        mapped.regimes,
        mapped.frequency,
        mapped.time,
        tuple(equations),
        tuple(notes),
    )


def _by_subsystem(equations: Sequence[Equation]) -> dict[str, float]:
    subsystem: dict[str, float] = {}
    for equation in equations:
        subsystem[equation.subsystem] = subsystem.get(equation.subsystem, 0.0) + equation.share
    return subsystem


def _effect_shares(
    selected: Sequence[str],
    shares: Mapping[str, float] | None,
    laws: Sequence[tuple[str, float]] = (),
) -> dict[str, float]:
    """Returns the shares of the subsystems of these effects; a negative share counts as zero."""
    weights = {effect: max(shares.get(effect, 0.0), 0.0) if shares else 1.0 for effect in selected}
    total = sum(weights.values()) + sum(share for _, share in laws)
    if total <= 0.0:
        weights, total = dict.fromkeys(selected, 1.0), float(len(selected))
    parts = [(effects()[effect].subsystem, weight) for effect, weight in weights.items()]
    subsystem: dict[str, float] = {}
    for name, weight in (*parts, *laws):
        subsystem[name] = subsystem.get(name, 0.0) + weight / total
    return subsystem


def _mean(answers: Sequence[tuple[Mapping[str, float], float]]) -> dict[str, float]:
    """Returns the mean of the shares of several answers, each with its weight."""
    total = sum(weight for _, weight in answers)
    return {
        name: sum(shares.get(name, 0.0) * weight for shares, weight in answers) / total
        for name in SUBSYSTEMS
    }


def _contradictions(named: Mapping[str, float], of_equations: Mapping[str, float]) -> list[str]:
    """Returns a sentence where the equation that asks most for a term has no effect named in it.

    An equation counts alone, so that a second effect beside a larger one does not show there.
    """
    missing = [
        name
        for name, share in of_equations.items()
        if share >= SUBSYSTEM_TAKES_PART and share == max(of_equations.values())
    ]
    missing = [name for name in missing if named.get(name, 0.0) < SUBSYSTEM_SMALL]
    return [
        "With a single term of free form, the gap would rather be explained in another part of the "
        f"machine: {name}, {100.0 * of_equations[name]:.0f} %."
        for name in missing
    ]


def _undecided(of_equations: Mapping[str, float]) -> list[str]:
    """Returns a sentence where several parts of the machine explain the gap alike."""
    if not of_equations:
        return ["No term of any equation would explain a part of the gap."]
    largest = max(of_equations.values())
    near = [name for name, share in of_equations.items() if share >= ALIKE * largest]
    if len(near) == 1:
        return []
    return [
        "The data do not show in which of these parts of the machine the gap lies: "
        f"{', '.join(near)}."
    ]

# SPDX-License-Identifier: MIT
"""What may lie between a simulated trace and a measured one: delay, lags, play, another scale.

A trace cannot be run again. What acts on the outputs alone can still be tried on it, and so can
delay and lag of the command, as far as the machine is linear: there they act on the outputs alike.
The effects are those of the simulator, from the same code.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
from scipy.optimize import minimize_scalar

import ehsid

from ...base.numbers import FloatArray
from ...rigs import Rig
from ..model.comparison import Compared

POSITION = "position_m"
# Usual damping of a servo valve; a trace does not tell it beside the bandwidth.
DAMPING = 0.8


@dataclass(frozen=True)
class Term:
    """Something of one size that changes a trace; its size is searched between `low` and `high`."""

    id: str
    """That of an effect, or "scale" or "lead", which are none."""
    parameter: str
    low: float
    high: float
    neutral: float
    """The size at which it changes nothing, or next to nothing."""
    logarithmic: bool = True


TERMS = MappingProxyType(
    {
        term.id: term
        for term in (
            Term("transport_delay", "delay_s", 2e-4, 0.2, 0.0),
            Term("valve_lag", "bandwidth_hz", 1.0, 400.0, np.inf),
            Term("sensor_lag", "time_constant_s", 2e-4, 0.2, 0.0),
            Term("sensor_backlash", "half_width_m", 1e-6, 1e-2, 0.0),
            Term("lead", "lead_s", 2e-4, 0.2, 0.0),
            Term("scale", "factor", 0.5, 2.0, 1.0, logarithmic=False),
        )
    }
)
# Each delays; a trace does not carry two of them.
TIMING = ("transport_delay", "valve_lag", "sensor_lag", "lead")

Sizes = Mapping[str, float]


def changed(trace: Mapping[str, FloatArray], sizes: Sizes, dt_s: float) -> dict[str, FloatArray]:
    """Returns the trace as it would be with these terms, by their ids.

    trace: simulated outputs by name, shape (N,) each.
    """
    outputs = dict(trace)
    if "lead" in sizes:
        outputs = {name: _earlier(values, sizes["lead"], dt_s) for name, values in outputs.items()}
    on_command = {
        "effects.transport_delay.delay_s": sizes.get("transport_delay", 0.0),
        "effects.valve_lag.bandwidth_hz": sizes.get("valve_lag", 0.0),
        "effects.valve_lag.damping": DAMPING if "valve_lag" in sizes else 0.0,
    }
    if any(on_command.values()):
        outputs = {name: _late(values, on_command, dt_s) for name, values in outputs.items()}
    on_sensor = {
        "effects.sensor_lag.time_constant_s": sizes.get("sensor_lag", 0.0),
        "effects.sensor_backlash.half_width_m": sizes.get("sensor_backlash", 0.0),
    }
    if any(on_sensor.values()):
        outputs[POSITION] = _sensed(outputs[POSITION], on_sensor, dt_s)
    outputs[POSITION] = sizes.get("scale", 1.0) * outputs[POSITION]
    return outputs


def _earlier(values: FloatArray, lead_s: float, dt_s: float) -> FloatArray:
    at = np.arange(values.size) * dt_s
    return np.asarray(np.interp(at + lead_s, at, values), dtype=np.float64)


def _values(effects: Mapping[str, float]) -> FloatArray:
    return Rig("trace", "simulator", {"valve.rated_command_v": 1.0}).plant_values(effects)


def _late(values: FloatArray, effects: Mapping[str, float], dt_s: float) -> FloatArray:
    """An output behind delay and lag of the command, which begin at rest."""
    moved = ehsid.outside_command(_values(effects), values - values[0], dt_s=dt_s)
    return np.asarray(moved + values[0], dtype=np.float64)


def _sensed(position: FloatArray, effects: Mapping[str, float], dt_s: float) -> FloatArray:
    """The position behind effects of its sensor."""
    following = iter(position[1:].tolist())
    sensed, _ = ehsid.run_steps(
        lambda: [position[0]],
        lambda _h, _inputs: [next(following, position[-1])],
        ("command_v",),
        (POSITION,),
        _values(effects),
        np.zeros(position.size),
        dt_s=dt_s,
        substeps=1,
        measured=position,
        caught=np.zeros(position.size, np.uint8),
        gain=0.0,
        mass=0.0,
        stiffness=(0.0, 0.0),
        valve=(0.0, 0.0),
    )
    return np.asarray(sensed[:, 0], dtype=np.float64)


def begun_anew(outputs: Mapping[str, FloatArray], compared: Compared) -> dict[str, FloatArray]:
    """Returns the outputs with a position that begins each window where the machine was."""
    position = outputs[POSITION].copy()
    window = compared.window
    begins = np.flatnonzero((np.diff(window, prepend=-1) != 0) & (window >= 0))
    for begin in begins.tolist():
        inside = slice(begin, begin + int(np.count_nonzero(window == window[begin])))
        position[inside] += compared.aligned[begin, 0] - position[begin]
    return {**outputs, POSITION: position}


@dataclass(frozen=True, eq=False)
class TraceFit:
    """Errors of traces with terms, and the sizes with which the position's is least.

    All terms change the position, and the other outputs answer to values that a trace cannot fit.
    """

    parts: Sequence[tuple[Compared, Mapping[str, FloatArray]]]
    """Each record with its trace."""

    def simulated(self, sizes: Sizes) -> list[dict[str, FloatArray]]:
        """Returns for each record the outputs by name, shape (N,)."""
        return [
            begun_anew(changed(trace, sizes, compared.dt_s), compared)
            for compared, trace in self.parts
        ]

    def loss(self, sizes: Sizes) -> float:
        """Mean squared error of the position over its motion within windows."""
        error, spread = 0.0, 0.0
        for compared, trace in self.parts:
            position = changed({POSITION: trace[POSITION]}, sizes, compared.dt_s)
            made = begun_anew(position, compared)[POSITION]
            measured = compared.outputs[POSITION]
            error += float(np.sum(compared.inside(made - measured) ** 2))
            spread += float(np.sum(compared.centred(measured) ** 2))
        return error / spread

    def fitted(self, ids: Sequence[str]) -> dict[str, float]:
        """Sizes of these terms that leave least, each searched in turn until they rest."""
        sizes: dict[str, float] = {}
        for _ in range(1 if len(ids) == 1 else ROUNDS):
            for term in (TERMS[each] for each in ids):
                others = {name: size for name, size in sizes.items() if name != term.id}
                sizes[term.id] = self._size(term, others)
        return sizes

    def interval(self, sizes: Sizes, name: str) -> tuple[float, float]:
        """Ends of the interval of 90 % of a size: the fit on parts of the records, each left out.

        The others hold. This is a jackknife over PARTS parts (B. Efron, Ann. Statist. 7(1), 1979).
        """
        others = {other: size for other, size in sizes.items() if other != name}
        term, found = TERMS[name], []
        for part in range(PARTS):
            some = TraceFit([(_without(c, part), trace) for c, trace in self.parts])
            found.append(some._size(term, others))
        spread = np.std(found) * np.sqrt(PARTS - 1.0)
        return max(sizes[name] - SIGMAS_90 * spread, 0.0), sizes[name] + SIGMAS_90 * spread

    def _size(self, term: Term, others: Sizes) -> float:
        return least_size(term, lambda size: self.loss({**others, term.id: size}))


# Of the jackknife, and the deviations of an interval of 90 %.
PARTS, SIGMAS_90 = 8, 1.645


def _without(compared: Compared, part: int) -> Compared:
    """The record without every PARTS-th window, counted from `part`."""
    window = compared.window.copy()
    numbers = np.unique(window[window >= 0])
    window[np.isin(window, numbers[part::PARTS])] = -1
    return replace(compared, window=window)


# Of a search of several sizes in turn.
ROUNDS = 3
GRID = 13
# Of the logarithm of the size, or of the size where that is not searched by its logarithm.
RESOLUTION = 0.003


def least_size(term: Term, loss: Callable[[float], float]) -> float:
    """Returns the size with the least loss: the best of a grid, then between its neighbours."""
    to, back = (np.log, np.exp) if term.logarithmic else (_same, _same)
    grid = np.linspace(to(term.low), to(term.high), GRID)
    losses = [loss(float(back(place))) for place in grid]
    best = int(np.argmin(losses))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, GRID - 1)]
    found = minimize_scalar(
        lambda place: loss(float(back(place))),
        bounds=(low, high),
        method="bounded",
        options={"xatol": RESOLUTION},
    )
    place = float(found.x) if found.fun <= losses[best] else float(grid[best])
    return float(back(place))


def _same(value: npt.ArrayLike) -> FloatArray:
    return np.asarray(value, dtype=np.float64)

# SPDX-License-Identifier: MIT
"""What is said of a gap that only a trace shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from ...base.numbers import FloatArray
from ...catalogue.channels import POSITION
from ...catalogue.parameters import plain_name
from ..schema import Estimate, HowFar, Verdict

NEEDED = (
    "A trace cannot be run again. For causes inside the machine, such as friction, leakage or a "
    "dead band, ehsid needs the simulator itself, as an FMU or in Python: ehsid rig new "
    "--simulator FILE."
)
NOT_FROM_TRACES = "a trace cannot be run again with it: it needs the simulator itself"

# Terms that are no effects, in words.
_NO_EFFECTS = MappingProxyType(
    {"scale": "another scale of the motion", "lead": "a simulation that comes too late"}
)


def term_name(term: str) -> str:
    """Returns a term in words."""
    return _NO_EFFECTS.get(term) or plain_name(term)


def size_words(term: str, size: float) -> str:
    """Returns the size of a term in words."""
    if term == "scale":
        return f"factor {size:.4g}"
    if term == "valve_lag":
        return f"{size:.3g} Hz"
    if term == "sensor_backlash":
        return f"{1e3 * size:.3g} mm each side"
    return f"{1e3 * size:.3g} ms"


def set_words(sizes: Mapping[str, float]) -> str:
    """Returns the effects among terms with their sizes; the reasons tell the other terms."""
    return " with ".join(
        f"{term_name(name)} ({size_words(name, size)})"
        for name, size in sizes.items()
        if name not in _NO_EFFECTS
    )


def sentence_of(verdict: Verdict, sets: Sequence[Mapping[str, float]], far: HowFar) -> str:
    """Returns the verdict on two traces in one sentence.

    sets: terms with their sizes that explain the gap alike, best first.
    """
    gaps = far.per_output
    position = f"{100.0 * gaps[POSITION][0]:.2g} %"
    if verdict == "no_gap":
        return f"The simulated trace follows the position to {position} of its motion."
    if not sets:
        others = [100.0 * gap[0] for name, gap in gaps.items() if name != POSITION]
        more = f", the other outputs by {max(others):.2g} % at most," if others else ""
        return (
            f"The simulated position differs by {position} of its motion{more} and the cause lies "
            "in what a trace does not tell: neither delay, lag nor play of the sensor makes up "
            "most of it."
        )
    before, _, after = gaps[POSITION]
    removed = f"{100.0 * (before - after) / before:.0f} % of the position's error"
    if len(sets) > 1:
        *most, last = map(set_words, sets)
        return (
            f"Two traces do not tell apart {', '.join(most)} and {last}; the first removes "
            f"{removed}."
        )
    return (
        f"Between the simulated and the measured position lies {set_words(sets[0])}, which removes "
        f"{removed}."
    )


def reasons_of(
    best: Mapping[str, float],
    drifts: Mapping[str, tuple[float, float]],
    step: Estimate | None,
    step_share: float,
) -> tuple[str, ...]:
    """Returns what the verdict rests on, and what a trace cannot tell.

    best: terms with their sizes that remove some of the gap. drifts: for each record by name, how
    far the measured position is from the simulated one on average, m, and how fast that grows, m/s.
    """
    said = []
    if "scale" in best:
        more = "farther" if best["scale"] > 1.0 else "less far"
        said.append(
            f"The machine moves {more} than the simulation, by a factor of {best['scale']:.4g}. A "
            "value, such as the flow of the valve or the supply pressure, friction, or the scale "
            "of the position sensor can make it; two traces do not tell which."
        )
    if "lead" in best:
        said.append(
            f"The simulation comes {size_words('lead', best['lead'])} after the machine: it has a "
            "delay or a lag that the machine lacks, or the logs are not at one time."
        )
    if "sensor_backlash" in best:
        said.append(
            "Friction of the seals looks the same as play of the sensor in a position: the oil "
            "gives way before the rod moves. Only a simulator with a force input tells them apart."
        )
    if {"transport_delay", "valve_lag"} & best.keys():
        said.append(
            "A delay or lag of the command was tried on the outputs, which is the same only where "
            "the machine is nearly linear."
        )
    if step is not None:
        said.append(
            f"The position sensor shows steps of {1e6 * step.value:.3g} um, which make up "
            f"{100.0 * step_share:.2g} % of the squared error."
        )
    for name, (offset, drift) in drifts.items():
        said.append(
            f"{name}: the measured position is on average {1e3 * offset:+.3g} mm from the "
            f"simulated one, and this changes by {1e3 * drift:+.3g} mm/s. The comparison begins "
            "anew in each window, so that neither counts: a simulation in open loop drifts."
        )
    return (*said, NEEDED)


def drift_of(difference: FloatArray, dt_s: float) -> tuple[float, float]:
    """Mean of a difference, and its slope over time, 1/s."""
    slope = np.polyfit(np.arange(difference.size) * dt_s, difference, 1)[0]
    return float(np.mean(difference)), float(slope)

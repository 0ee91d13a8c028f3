# SPDX-License-Identifier: MIT
"""Effects on which the records give no evidence, with the reason.

An effect that acts only where a record has not been is not shown to be absent.

Operating conditions of a servo: a description with its limits, and when each one holds.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType

import numpy as np
import numpy.typing as npt
from scipy.signal import find_peaks

from ...base.numbers import FloatArray, plain_number
from ...catalogue.channels import CHAMBER_PRESSURES, POSITION
from ...catalogue.parameters import effects as catalogue
from ...catalogue.parameters import missing_part, names_of
from ...rigs import Rig
from ...signals.simulation import command_limit, measured_states
from ..data.regimes import NEAR_NULL, SLOW_SHARE, Regimes
from ..data.repeats import areas
from ..model.comparison import OUTPUTS, Compared
from ..schema import CannotJudge
from .candidates import FittedCandidate

# Regimes that a record must visit before it can show or exclude an effect.
# Flow saturation and supply droop bend the flow curve by the square of the command. At 30 % of the
# rated command, a limit at full opening takes 3 % of the flow.
LARGE_COMMAND = 0.3
# Share of the time that gives a few independent errors. One window of half a second in twenty
# seconds is a fortieth.
LEAST_SHARE = 0.02
# Friction and play show at reversals of the motion. One reversal may be an accident; two in each
# direction are a pattern.
LEAST_REVERSALS = 4
# A lag of 2 ms turns the phase at this frequency by 2 degrees, which is 4 % of a sine.
FAST_HZ = 3.0
# A load spring looks like a constant force until the rod has moved. Over a tenth of the stroke its
# force changes by a tenth.
LEAST_TRAVEL = 0.1
# The least drift of the flow gain that counts has changed the flow by 0.25 % after this time, s: as
# much as the position over a window of half a second is known to.
LEAST_SECONDS = 5.0
# The compliance of air goes with p^-1.77. Over a factor of two in pressure it changes 3.4-fold;
# over a smaller range, air looks like another bulk modulus.
PRESSURES_VARY = 2.0
# At rest the chambers have the supply pressure together, about half of it each. A relief valve
# shows only where one of them is driven above that; share of the supply pressure.
HIGH_PRESSURE = 0.6
# A make-up valve opens below the tank pressure. That of a rig file is right within a half.
LOW_PRESSURE = 1.5


def _large_commands(regimes: Regimes) -> str | None:
    if regimes.largest_command >= LARGE_COMMAND:
        return None
    return f"command never above {100.0 * regimes.largest_command:.0f} % of rated"


def _about_null(regimes: Regimes) -> str | None:
    if regimes.near_null >= LEAST_SHARE:
        return None
    return f"command near null for {100.0 * regimes.near_null:.1f} % of the time only"


def _command_rests(regimes: Regimes) -> str | None:
    if regimes.resting >= LEAST_SHARE:
        return None
    return f"the command rests for {100.0 * regimes.resting:.1f} % of the time only"


def _command_turns(regimes: Regimes) -> str | None:
    if regimes.command_reversals >= LEAST_REVERSALS:
        return None
    return f"the command turns {regimes.command_reversals} times only"


def _motion_turns(regimes: Regimes) -> str | None:
    if regimes.motion_reversals >= LEAST_REVERSALS:
        return None
    return f"the rod turns {regimes.motion_reversals} times only"


def _slow_motion(regimes: Regimes) -> str | None:
    if regimes.slow >= LEAST_SHARE:
        return None
    return f"slow motion for {100.0 * regimes.slow:.1f} % of the time only"


def _fast_commands(regimes: Regimes) -> str | None:
    if regimes.fast_power_hz >= FAST_HZ:
        return None
    return f"the command has no power above {regimes.fast_power_hz:.1f} Hz"


def _wide_travel(regimes: Regimes) -> str | None:
    if regimes.travel is None or regimes.travel >= LEAST_TRAVEL:
        return None
    return f"the rod covers {100.0 * regimes.travel:.0f} % of the stroke only"


def _pressures_vary(regimes: Regimes) -> str | None:
    low, high = regimes.lowest_pressure_pa, regimes.highest_pressure_pa
    if low is None or high is None or high >= PRESSURES_VARY * low:
        return None
    return f"chamber pressures stay within {low:.2g} to {high:.2g} Pa: air is like softer oil there"


def _long_record(regimes: Regimes) -> str | None:
    if regimes.seconds >= LEAST_SECONDS:
        return None
    return f"the record lasts {regimes.seconds:.1f} s only"


def _high_pressures(regimes: Regimes) -> str | None:
    share = regimes.highest_of_supply
    if share is None or share >= HIGH_PRESSURE:
        return None
    return f"no chamber above {100.0 * share:.0f} % of the supply pressure"


def _low_pressures(regimes: Regimes) -> str | None:
    share = regimes.lowest_of_tank
    if share is None or share <= LOW_PRESSURE:
        return None
    return (
        "no chamber pressure came near to the tank pressure; the lowest one was "
        f"{share:.1f} times as high"
    )


# Outputs of which an effect needs all, or one, and the reason why it cannot be told without.
_UNMEASURED: Mapping[str, tuple[Callable[[Iterable[bool]], bool], Sequence[str], str]] = (
    MappingProxyType(
        {
            "chamber_pressures": (
                all,
                CHAMBER_PRESSURES,
                "not both chamber pressures are measured and vary",
            ),
            "another_output": (
                any,
                tuple(name for name in OUTPUTS if name != POSITION),
                "only the position is measured, and a late reading of it looks the same as a late "
                "command",
            ),
        }
    )
)


def unmeasured_effects(outputs: Collection[str], effects: Sequence[str]) -> list[CannotJudge]:
    """Returns the effects that no motion can show with these outputs, with the reason.

    They are not tried: a fit has nothing that depends on their sizes.

    Parameters
    ----------
    outputs
        names of the compared outputs.
    effects
        ids of the effects to check, in the order of the result.
    """
    return [
        CannotJudge(effect, why)
        for effect in effects
        for need in catalogue()[effect].needs
        if need in _UNMEASURED
        for enough, needed, why in (_UNMEASURED[need],)
        if not enough(name in outputs for name in needed)
    ]


# Reason why a record does not show an effect, by what the effect needs; None where it does.
_MISSING: Mapping[str, Callable[[Regimes], str | None]] = MappingProxyType(
    {
        "command_reversals": _command_turns,
        "motion_reversals": _motion_turns,
        "slow_motion": _slow_motion,
        "wide_travel": _wide_travel,
        "large_commands": _large_commands,
        "commands_about_null": _about_null,
        "resting_commands": _command_rests,
        "fast_commands": _fast_commands,
        "varying_pressures": _pressures_vary,
        "long_record": _long_record,
        "high_pressures": _high_pressures,
        "low_pressures": _low_pressures,
    }
)

_LARGER_SHOWS_MORE = (
    "largest_command",
    "near_null",
    "resting",
    "slow",
    "command_reversals",
    "motion_reversals",
    "travel",
    "fast_power_hz",
    "highest_of_supply",
    "seconds",
)


def unidentifiable_effects(
    regimes: Sequence[Regimes], effects: Sequence[str], plant: str = "ehs"
) -> list[CannotJudge]:
    """Returns the effects that no record can show, each with what the records lack.

    Parameters
    ----------
    regimes
        operating regimes of each record; it is enough if one record visits a regime.
    effects
        ids of the effects to check, in the order of the result.
    plant
        plant of the rig: an effect on a part that it does not have cannot be identified either.
    """
    unidentifiable = []
    for effect in effects:
        part = missing_part(catalogue()[effect], plant)
        if part is not None:
            unidentifiable.append(CannotJudge(effect, f'a plant "{plant}" has no {part}'))
            continue
        missing = [
            reason
            for need in catalogue()[effect].needs
            if need in _MISSING
            and (reason := _missing_everywhere(_MISSING[need], regimes)) is not None
        ]
        if missing:
            unidentifiable.append(CannotJudge(effect, "; ".join(missing)))
    return unidentifiable


def _missing_everywhere(
    need: Callable[[Regimes], str | None], regimes: Sequence[Regimes]
) -> str | None:
    """Returns the reason that holds for all records where every record has one, else None."""
    reasons = [need(regime) for regime in regimes]
    if not reasons or any(reason is None for reason in reasons):
        return None
    # Each reason is about one regime. Only pressures that vary are about two, of one record.
    return need(_furthest(regimes)) or reasons[0]


def _furthest(regimes: Sequence[Regimes]) -> Regimes:
    """Returns the regimes of all records together: of each the one that shows most."""

    def largest(name: str) -> float | None:
        return max(filter(None, (getattr(one, name) for one in regimes)), default=None)

    together = {name: largest(name) for name in _LARGER_SHOWS_MORE}
    first = regimes[0]
    shown = {name: value for name, value in together.items() if value is not None}
    lowest = min(filter(None, (one.lowest_of_tank for one in regimes)), default=None)
    return replace(first, **shown, lowest_of_tank=lowest)  # type: ignore[arg-type]


def effects_hardly_shown(
    candidate: FittedCandidate, regimes: Sequence[Regimes], plant: str
) -> list[CannotJudge]:
    """Returns the effects of a candidate of which the records show little, each once."""
    shown = (
        *extrapolated_effects(candidate.values, regimes, candidate.effects),
        *unidentifiable_effects(regimes, candidate.effects, plant),
    )
    return list({each.id: each for each in reversed(shown)}.values())


def extrapolated_effects(
    values: Mapping[str, float], regimes: Sequence[Regimes], effects: Sequence[str]
) -> list[CannotJudge]:
    """Returns the fitted effects whose size lies outside the range of the records, with the reason.

    Such a size is extrapolated from the beginning of a curve, or is hidden by noise. Other effects
    can look the same there.

    Parameters
    ----------
    values
        fitted values of the plant, by full name.
    regimes
        operating regimes of each record.
    effects
        ids of the effects that were fitted.
    """
    command = max(record.largest_command for record in regimes)
    floor = min(record.position_floor_m for record in regimes)
    pressure = max(filter(None, (record.highest_pressure_pa for record in regimes)), default=None)
    nearest = min(record.positions_m[0] for record in regimes)
    furthest = max(record.positions_m[1] for record in regimes)
    extrapolated = []
    for effect in effects:
        info = catalogue()[effect]
        if info.reach == "all":
            continue
        names = names_of(info)
        # Widths that the command must leave are all parameters but those of the law's form.
        widths = [n for n, p in zip(names, info.parameters, strict=True) if p.power != 0.0]
        size = max(values[name] for name in (widths if info.reach == "within" else names[:1]))
        reason = None
        if info.reach == "begins_at" and size > command:
            reason = (
                f"it would begin at {100.0 * size:.0f} % of full opening, the command never asks "
                f"for more than {100.0 * command:.0f} %"
            )
        elif info.reach == "within" and size >= command:
            reason = (
                f"it would be {100.0 * size:.0f} % wide, the command never goes beyond "
                f"{100.0 * command:.0f} %"
            )
        elif info.reach == "high_pressures" and pressure is not None and size > pressure:
            reason = f"it would crack at {size:.3g} Pa, no chamber goes above {pressure:.3g} Pa"
        elif info.reach == "positions" and size > furthest:
            reason = f"it would begin at {size:.4g} m, the rod never goes beyond {furthest:.4g} m"
        elif info.reach == "positions" and size < nearest:
            reason = (
                f"it would begin at {size:.4g} m, the rod is always beyond {nearest:.4g} m: a "
                "spring looks the same there"
            )
        elif info.reach == "sensor_noise" and abs(size) < floor:
            reason = f"{abs(size):.2g} m are below the sensor's noise of {floor:.2g} m"
        if reason is not None:
            extrapolated.append(CannotJudge(effect, reason))
    return extrapolated


# Smallest reversals that count, share of the range of the signal, as in `regimes`. AFTER_TURN_S is
# the time after a reversal in which a servo settles: some periods of its oil spring.
TURN_OF_COMMAND = 0.05
TURN_OF_ROD = 0.02
AFTER_TURN_S = 0.1
# Free gas and entrained air have an influence below some five atmospheres.
LOW_PRESSURE_PA = 5e5

BoolArray = npt.NDArray[np.bool_]


def conditions(records: Sequence[Compared], rig: Rig) -> dict[str, BoolArray]:
    """Returns the samples where each condition holds, by its description, record after record.

    Only samples inside windows count. Limits are computed from all records together. Conditions on
    pressures are included only where every record has both.
    """
    states = np.concatenate(
        [measured_states(compared.record)[compared.used] for compared in records]
    )
    command = np.concatenate(
        [compared.record.column("command_v")[compared.used] for compared in records]
    )
    position, speed = states[:, 0], states[:, 1]
    largest = float(np.abs(command).max())
    limit = command_limit(rig)
    null = NEAR_NULL * (limit if np.isfinite(limit) else largest)
    slow = SLOW_SHARE * float(np.abs(speed).max())
    low, high = np.min(position) + np.ptp(position) * np.array([1.0, 2.0]) / 3.0
    holding: dict[str, BoolArray] = {
        f"|command| < {plain_number(null, 3)} V": np.abs(command) < null,
        f"|command| > {plain_number(0.5 * largest, 3)} V": np.abs(command) > 0.5 * largest,
        f"|velocity| < {plain_number(slow, 2)} m/s": np.abs(speed) < slow,
        f"velocity > {plain_number(slow, 2)} m/s": speed > slow,
        f"velocity < {plain_number(-slow, 2)} m/s": speed < -slow,
        f"position < {plain_number(low, 3)} m": position < low,
        f"position {plain_number(low, 3)} to {plain_number(high, 3)} m": (
            (position >= low) & (position <= high)
        ),
        f"position > {plain_number(high, 3)} m": position > high,
    }
    for source, column, share in (
        ("command", "command_v", TURN_OF_COMMAND),
        ("rod", "position_m", TURN_OF_ROD),
    ):
        holding[f"up to {AFTER_TURN_S:g} s after a turn of the {source}"] = np.concatenate(
            [
                after_turns(
                    compared.record.column(column),
                    share,
                    round(AFTER_TURN_S / compared.dt_s),
                )[compared.used]
                for compared in records
            ]
        )
    if rig.plant == "ehs" and not np.isnan(states[:, 2:]).any():
        holding |= _of_pressures(states[:, 2], states[:, 3], rig.values)
    return holding


def _of_pressures(
    a: FloatArray, b: FloatArray, values: Mapping[str, float]
) -> dict[str, BoolArray]:
    cap, annulus = areas(values)
    load = a * cap - b * annulus
    half = 0.5 * float(np.abs(load).max())
    return {
        "load against extension (p_a A_a > p_b A_b)": load > 0.0,
        "load with extension (p_a A_a < p_b A_b)": load < 0.0,
        f"|load| > {plain_number(half, 3)} N": np.abs(load) > half,
        f"a chamber below {LOW_PRESSURE_PA / 1e6:g} MPa": np.minimum(a, b) < LOW_PRESSURE_PA,
    }


def after_turns(signal: FloatArray, share: float, samples: int) -> BoolArray:
    """Marks each turn of a signal and the given number of samples after it, shape (N,).

    A turn is a peak or a trough with a prominence of at least this share of the signal's range.
    """
    least = share * float(np.ptp(signal))
    marks = np.zeros(signal.size)
    if least > 0.0:
        for signed in (signal, -signal):
            marks[find_peaks(signed, prominence=least)[0]] = 1.0
    return np.convolve(marks, np.ones(samples + 1))[: signal.size] > 0.5

# SPDX-License-Identifier: MIT
"""Which effects a record cannot speak of, and why: not visited is not absent."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType

from ehsid.harness.gap.findings import CannotJudge
from ehsid.harness.gap.regimes import Regimes
from ehsid.harness.gap.thresholds import (
    FAST_HZ,
    LARGE_COMMAND,
    LEAST_REVERSALS,
    LEAST_SHARE,
    LEAST_TRAVEL,
)


def _large_commands(regimes: Regimes) -> str | None:
    if regimes.largest_command >= LARGE_COMMAND:
        return None
    return f"command never above {100.0 * regimes.largest_command:.0f} % of rated"


def _about_null(regimes: Regimes) -> str | None:
    if regimes.near_null >= LEAST_SHARE:
        return None
    return f"command near null for {100.0 * regimes.near_null:.1f} % of the time only"


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


# What each effect needs; those not named show in any motion.
_NEEDS: Mapping[str, tuple[Callable[[Regimes], str | None], ...]] = MappingProxyType(
    {
        "transport_delay": (_fast_commands,),
        "valve_hysteresis": (_command_turns,),
        "valve_lag": (_fast_commands,),
        "valve_flow_saturation": (_large_commands,),
        "valve_dead_band": (_about_null,),
        "supply_droop": (_large_commands,),
        "coulomb_friction": (_motion_turns,),
        "stribeck_friction": (_motion_turns, _slow_motion),
        "load_spring": (_wide_travel,),
        "sensor_lag": (_fast_commands,),
        "sensor_backlash": (_motion_turns,),
    }
)


def cannot_judge(regimes: Sequence[Regimes], effects: Sequence[str]) -> list[CannotJudge]:
    """Effects for which something is missing in every record, with what is.

    Parameters
    ----------
    regimes
        of each record; what one of them visits is visited.
    effects
        ids that are asked for, in the order of the answer.
    """
    found = []
    for effect in effects:
        missing = []
        for need in _NEEDS.get(effect, ()):
            reasons = [need(one) for one in regimes]
            stated = [reason for reason in reasons if reason is not None]
            if len(stated) == len(reasons) and stated:
                missing.append(stated[0])
        if missing:
            found.append(CannotJudge(effect, "; ".join(missing)))
    return found

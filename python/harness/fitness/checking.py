# SPDX-License-Identifier: MIT
"""Checks a rig against a record: each comparison after those that it depends on."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..catalogue.channels import COMMAND, POSITION, SUPPLY_PRESSURE
from ..diagnosis.data.gate import check_saturated, check_spikes, usable_part
from ..diagnosis.data.gate_ranges import check_clock, longer
from ..diagnosis.schema import Remark
from ..records import Record
from ..rigs import Rig
from ..rigs.carried import simulator_notes
from .finding import (
    Finding,
    RecordCheck,
    Status,
    command_findings,
    doubted_units,
    finding,
    judged,
    measured_supply,
    sign_findings,
    stroke_finding,
    untold,
)
from .motion import Areas, FlowGain, Motion, areas, expected_speed, flow_gain, has_pressures, motion
from .ringing import Edges, edges, moved_mass, ringing_finding

LEAST_SAMPLES = 200
# How well the comparisons themselves are, relative. Chamber pressures give the flow of each edge,
# but edges and dead bands of a real valve differ by some per cent; without pressures, the load
# changes the flow.
FLOW_METHOD, FLOW_METHOD_NO_PRESSURES = 0.06, 0.15
PART_METHOD = 0.03
SUPPLY_METHOD = 0.03
# A mass is told where twice its deviation is below this share of it.
MASS_KNOWN = 0.5
# Delays that differ by this share, or by this time, are the same, s.
DELAY_SHARE, DELAY_S = 0.5, 0.002
# Correlation of speed and command from which a delay is compared.
DELAY_RELATED = 0.8
HIDDEN_SPOOL = (250.0, 0.9)
RATED = "valve.rated_command_v"


def check_rig(record: Record, rig: Rig) -> RecordCheck:
    """Compares a rig with a record, before anything is fitted.

    Parameters
    ----------
    record
        with `command_v` and `position_m`; of a record with gaps the longest stretch counts,
        without spans in which the supply is down.
    rig
        of any plant; only "ehs" has all comparisons.

    Raises
    ------
    ValueError
        the record has no time, is too short, or command or position is constant.
    """
    part, supply = _usable(record, rig)
    assert part.dt_s is not None
    moved = motion(part, rig)
    half = moved.kernel.half
    time = part.dt_s * np.arange(half, half + moved.speed.size, dtype=np.float64)
    notes = _notes(part, rig, supply)
    off = [finding("supply", Status.does_not_fit, one.what) for one in supply if one.serious]
    if off:
        findings = [*off, untold("all else", "the supply must be up first")]
        return RecordCheck(record.name, tuple(findings), notes, time, moved.speed, None)
    findings = sign_findings(part, rig)
    wrong_way = any(one.status is Status.does_not_fit for one in findings)
    findings += stroke_finding(part, rig, moved)
    findings += command_findings(part, rig, moved)
    findings += measured_supply(part, rig)
    expected = None
    if wrong_way:
        findings.append(untold("flow, areas and mass", "the signs must be right first"))
    elif doubted := doubted_units(findings):
        units = "the units of" if len(doubted) > 1 else "the unit of"
        found = f"{units} {', '.join(doubted)} must be right first"
        findings.append(untold("supply, areas, flow and mass", found))
    elif rig.plant == "ehs":
        area = areas(rig)
        opened = not any(
            one.value == RATED and one.status is Status.does_not_fit for one in findings
        )
        findings += _hydraulics(part, rig, moved, area, opened)
        expected = expected_speed(part, rig, moved, area)
    elif rig.plant == "axis":
        findings.append(_mass(part, rig, Areas(0.0, 0.0, 0.0, 0.0)))
    # What the lag of a user's simulator accounts for is not known before it runs.
    if not wrong_way and rig.plant != "simulator":
        findings.append(_delay(part, rig, moved))
        findings += ringing_finding(part, rig)
    return RecordCheck(record.name, tuple(findings), notes, time, moved.speed, expected)


def _usable(record: Record, rig: Rig) -> tuple[Record, list[Remark]]:
    """The part that is compared, with a remark on what the supply excludes; else ValueError."""
    where = record.source or record.name
    if record.dt_s is None:
        raise ValueError(
            f"{where}: there is no time: expected a column 'time_s'; name it, or give --dt SECONDS"
        )
    part, supply = usable_part(record, rig)
    if len(part) < LEAST_SAMPLES:
        raise ValueError(
            f"{where}: {len(part)} samples without a gap: expected at least {LEAST_SAMPLES}; "
            f"{longer(record, LEAST_SAMPLES)}"
        )
    for name in (COMMAND, POSITION):
        if np.ptp(part.column(name)) == 0.0:
            raise ValueError(
                f"{where}, column '{name}': it is constant: expected a machine that moves; "
                "record with an excitation, or check the sensor"
            )
    return part, supply


def _notes(record: Record, rig: Rig, supply: Sequence[Remark]) -> tuple[str, ...]:
    """What else is to be known, and what this record cannot show."""
    left_out = [remark for remark in supply if not remark.serious]
    remarks = [
        *left_out,
        *check_clock(record),
        *check_saturated(record, rig),
        *check_spikes(record, rig),
    ]
    notes = [remark.what for remark in remarks]
    if rig.plant == "ehs" and not has_pressures(record):
        notes.append(
            "without chamber pressures the record cannot tell the areas, the mass, or a supply "
            "pressure apart from the valve's flow"
        )
    return (*notes, *simulator_notes(rig))


def _hydraulics(
    record: Record, rig: Rig, moved: Motion, area: Areas, opened: bool
) -> list[Finding]:
    """Supply, areas, flow and mass: each with what the ones before have shown.

    `opened` says whether the rated command fits, without which a flow means nothing.
    """
    found = []
    at_edges = edges(record, rig, moved, area)
    if SUPPLY_PRESSURE not in record.columns:
        found.append(_supply(rig, at_edges))
    ratio = _areas(record, rig, moved, area, at_edges)
    found.append(ratio)
    gain = flow_gain(record, rig, moved, area) if at_edges is None else at_edges.gain
    if ratio.status is Status.does_not_fit:
        later = "the areas of the rig must be right first"
        return [*found, untold("flow", later, "valve.rated_flow_m3_s"), untold("mass", later)]
    flow = (
        _flow(record, rig, gain)
        if opened
        else untold("flow", "the rated command must be right first", "valve.rated_flow_m3_s")
    )
    return [*found, flow, _mass(record, rig, area)]


def _supply(rig: Rig, at_edges: Edges | None) -> Finding:
    key, check = "supply.pressure_pa", "supply"
    if at_edges is None or at_edges.supply_pa is None:
        return untold(
            check,
            "neither a supply pressure nor chamber pressures in motion both ways are in the record",
            key,
        )
    says, seen = rig.values[key], at_edges.supply_pa
    shown = (
        f"the chamber pressures fit a supply of {1e-5 * seen:.4g} bar, the rig says "
        f"{1e-5 * says:.4g} bar"
    )
    bad = f"{shown}: set {key} to {seen:.4g} (factor {seen / says:.3g})"
    tolerance = 2.0 * math.hypot(rig.sigma(key), SUPPLY_METHOD)
    return judged(check, key, seen / says, tolerance, (shown, bad))


def _areas(record: Record, rig: Rig, moved: Motion, area: Areas, at_edges: Edges | None) -> Finding:
    check, key = "areas", "cylinder.bore_m"
    says = area.annulus / area.cap
    if at_edges is None:
        return untold(
            check, f"rod side over cap side is {says:.3f}; it takes chamber pressures", key
        )
    part = at_edges.part
    shown = (
        f"the pressures fit a ratio of rod side to cap side of {part:.3f}, the rig has {says:.3f}"
    )
    bore, rod = rig.values[key], rig.values["cylinder.rod_m"]
    deviation = math.hypot(PART_METHOD, rig.sigma(key), rig.sigma("cylinder.rod_m"))
    tolerance = 2.0 * deviation
    unexplained = at_edges.gain.unexplained
    wider = 2.0 * math.hypot(deviation, unexplained)
    if math.log1p(tolerance) < abs(math.log(part / says)) <= math.log1p(wider):
        return untold(
            check,
            f"{shown}, which may have another reason: the command moves faster than the valve or "
            f"the sampling follows, and {100.0 * unexplained:.2g} % of the motion stay unexplained "
            "by the flow through the valve. A record with steps, or a slower one, tells the areas",
            key,
        )
    return judged(
        check,
        key,
        part / says,
        tolerance,
        (shown, shown + _remedy(record, rig, moved, part, bore, rod)),
    )


def _remedy(record: Record, rig: Rig, moved: Motion, part: float, bore: float, rod: float) -> str:
    """The bore and the rod that give a ratio of the areas, the better one first."""
    if part > 0.97:
        return ": both sides look equal, as with a rod on both sides; check bore and rod"
    if rod == 0.0:
        return ": the sides differ, so the rod is on one side only; check bore and rod"
    found = []
    for name, now in (("cylinder.bore_m", bore), ("cylinder.rod_m", rod)):
        value, needs = _changed(record, rig, moved, name, part)
        # The better remedy is the one with which the flow fits, too.
        far = math.inf if needs is None else abs(math.log(needs))
        text = f"{name} to {value:.4g} (factor {value / now:.3g})"
        if needs is not None:
            text += f", and the speeds need {needs:.3g} times the rated flow"
        found.append((far, text))
    found.sort()
    return f": set {found[0][1]}; or {found[1][1]}"


def _changed(
    record: Record, rig: Rig, moved: Motion, name: str, part: float
) -> tuple[float, float | None]:
    """Diameter that makes the ratio of the areas fit, and the rated flow then over that of the rig.

    The ratio hardly depends on the diameters; a second time with the new one settles it.
    """
    value, needs = rig.values[name], None
    other = rig.values["cylinder.rod_m" if name == "cylinder.bore_m" else "cylinder.bore_m"]
    for _ in range(2):
        thin = math.sqrt(max(1.0 - part, 1e-3))
        value = other / thin if name == "cylinder.bore_m" else other * thin
        changed = rig.with_values({name: value})
        at_edges = edges(record, changed, moved, areas(changed))
        if at_edges is None:
            break
        part, flow = at_edges.part, at_edges.gain.mean
        needs = None if flow is None else flow / rig.values["valve.rated_flow_m3_s"]
    return value, needs


def _flow(record: Record, rig: Rig, gain: FlowGain) -> Finding:
    check, key = "flow", "valve.rated_flow_m3_s"
    says, seen = rig.values[key], gain.mean
    if seen is None:
        return untold(check, "the valve is hardly opened; record with larger commands", key)
    ways = ", ".join(
        f"{_flow_text(value)} {way}"
        for way, value in (("extending", gain.extending), ("retracting", gain.retracting))
        if value is not None
    )
    shown = (
        f"the speeds fit a rated flow of {_flow_text(seen)} ({ways}), the rig says "
        f"{_flow_text(says)}"
    )
    factor = seen / says
    bad = (
        f"{shown}: change {key} by the factor {factor:.3g}, to {seen:.4g}; or, if the flow is "
        f"right, valve.rated_command_v by {1.0 / factor:.3g}"
    )
    if has_pressures(record):
        bad += f", or both diameters by {factor**-0.5:.3g}"
        method = FLOW_METHOD
    else:
        bad += (
            f", supply.pressure_pa by {factor**2:.3g}, or cylinder.bore_m; chamber pressures would "
            "tell them apart"
        )
        method = FLOW_METHOD_NO_PRESSURES
    # The speed goes with the flow, the square root of the supply, and the area.
    supply = 0.0 if has_pressures(record) else 0.5 * rig.sigma("supply.pressure_pa")
    tolerance = 2.0 * math.hypot(method, rig.sigma(key), supply, 2.0 * rig.sigma("cylinder.bore_m"))
    return judged(check, key, factor, tolerance, (shown, bad))


def _flow_text(flow: float) -> str:
    return f"{6e4 * flow:.3g} l/min"


def _mass(record: Record, rig: Rig, area: Areas) -> Finding:
    key = "axis.mass_kg" if rig.plant == "axis" else "load.mass_kg"
    check, says = "mass", rig.values[key]
    if rig.plant == "ehs" and not has_pressures(record):
        return untold(check, f"the rig says {says:.4g} kg; it takes chamber pressures", key)
    found = moved_mass(record, rig, area)
    if found is None or found.value <= 0.0 or 2.0 * found.deviation > MASS_KNOWN * found.value:
        return untold(
            check,
            f"the rig says {says:.4g} kg; next to friction and noise, the accelerations of this "
            "record are too small to weigh it",
            key,
        )
    seen = found.value
    shown = (
        f"force over acceleration is {seen:.4g} kg (within {2.0 * found.deviation:.2g} kg), the "
        f"rig says {says:.4g} kg"
    )
    bad = f"{shown}: change {key} by the factor {seen / says:.3g}"
    if rig.plant == "axis":
        bad += f", or axis.force_per_volt by {says / seen:.3g}"
    tolerance = 2.0 * math.hypot(rig.sigma(key), found.deviation / seen, 0.05)
    better = abs(math.log(seen / says)) > 2.0 * found.deviation / seen + 0.1
    good = f"{shown}, hardly known: {key} = {seen:.4g} is better" if better else shown
    return judged(check, key, seen / says, tolerance, (good, bad))


def _delay(record: Record, rig: Rig, moved: Motion) -> Finding:
    check, key = "response", "effects.valve_lag.bandwidth_hz"
    if rig.plant == "axis":
        return untold(check, "a drive's speed follows its force, not its command")
    if moved.delay_s is None or moved.related < DELAY_RELATED:
        return untold(check, "speed and command are too little related to tell a delay", key)
    assert record.dt_s is not None
    values = rig.values
    bandwidth, damping = (
        (values[key], values.get("effects.valve_lag.damping", HIDDEN_SPOOL[1]))
        if values.get(key)
        else HIDDEN_SPOOL
    )
    # A lag of second order delays slow commands by 2 zeta / omega.
    lag = damping / (math.pi * bandwidth)
    expected = (
        lag
        + values.get("effects.transport_delay.delay_s", 0.0)
        + values.get("effects.sensor_lag.time_constant_s", 0.0)
    )
    share = max(DELAY_SHARE, 2.0 * rig.sigma(key)) if values.get(key) else DELAY_SHARE
    seen, far = moved.delay_s, max(share * expected, DELAY_S, record.dt_s)
    shown = (
        f"the speed follows the command after {1e3 * seen:.3g} ms, valve and delays of the rig "
        f"account for {1e3 * expected:.3g} ms"
    )
    if abs(seen - expected) <= far:
        return finding(check, Status.fits, shown, key)
    spool = seen - (expected - lag)
    text = f"{shown} (within {1e3 * far:.2g} ms)"
    if spool > 0.0:
        text += (
            f": the valve may have a bandwidth of {damping / (math.pi * spool):.3g} Hz, set {key}"
        )
    if seen > expected:
        text += f"; or there is a delay of {1e3 * (seen - expected):.3g} ms, "
        text += "effects.transport_delay.delay_s"
    return finding(check, Status.does_not_fit, text, key)

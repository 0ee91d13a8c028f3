# SPDX-License-Identifier: MIT
"""Gate for the supply over the time: spans in which the pump was off, or far below its pressure.

Three signs show them, and the first one for which a record has the channels counts. A droop under
flow is none: it is an effect of the catalogue, and stays above SUPPLY_LOW.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter1d

from ...base.arrays import FloatArray
from ...catalogue.channels import CHAMBER_PRESSURES, SUPPLY_PRESSURE
from ...records import Record
from ...rigs import Rig
from ..schema import Remark
from .cylinder import full_speed
from .gate_ranges import PRESSURE_UNIT

# The supply is down below this share of its pressure for this time, and up again from SUPPLY_AGAIN
# on. A droop under flow leaves more: with a source that loses 35 % at full flow, 65 % remain. A
# supply that never reaches a quarter of what the rig says is that of a pump which is off.
SUPPLY_LOW = 0.6
SUPPLY_LOW_S = 0.2
SUPPLY_AGAIN = 0.9
SUPPLY_OFF = 0.25
# The signals are smoothed over this time: below it, compression of the oil also makes pressures.
SUPPLY_SMOOTHED_S = 0.05
# Without its sensor, the end of a span is known up to the time in which a pump comes up, s.
SUPPLY_SETTLED_S = 0.5
# A rod stands below this share of the full speed. It does not follow a valve that is opened by more
# than STALL_OPENING if it has less than this share of the speed of that opening, for so long that
# it would have gone as far as at full speed in STALL_S. A dead band holds it shorter.
STANDS = 0.02
STALL_OPENING = 0.05
STALL_SPEED = 0.2
STALL_S = 0.06
# Share of the time for which the rod follows such openings elsewhere.
FOLLOWS = 0.9
# Through an opening above this, flows of the valve are large beside any leakage.
WIDE_OPENING = 0.25

Mask = npt.NDArray[np.bool_]


def powered_part(record: Record, rig: Rig) -> tuple[slice, list[Remark]]:
    """Returns the longest part of a record in which the supply is up, and a remark on the rest.

    Parameters
    ----------
    record
        without gaps, with `command_v` and `position_m`.
    rig
        of any plant; only "ehs" has a supply.

    Returns
    -------
    The whole record where nothing is to be left out, and also where the supply is never up; the
    remark is then serious.
    """
    whole = slice(0, len(record))
    if rig.plant != "ehs" or record.dt_s is None or len(record) * record.dt_s < SUPPLY_LOW_S:
        return whole, []
    says = rig.values["supply.pressure_pa"]
    if SUPPLY_PRESSURE in record.columns:
        top = float(np.quantile(record.column(SUPPLY_PRESSURE), 0.98))
        if PRESSURE_UNIT * says <= top < SUPPLY_OFF * says:
            text = (
                f"the supply is measured at {_bar(top)} at most, where the rig says {_bar(says)}: "
                "the pump was off in the whole record, or the column has another unit"
            )
            return whole, [Remark(record.name, text, serious=True)]
        found = _measured(record, top)
    elif all(name in record.columns for name in CHAMBER_PRESSURES):
        found = _by_chambers(record, rig, _Motion.of(record, rig))
    else:
        found = _by_motion(record, _Motion.of(record, rig))
    if not found.down.any():
        return whole, []
    kept = max(_runs(~found.down), key=lambda run: run.stop - run.start, default=slice(0, 0))
    return kept, [_remark(record, found, kept, says)]


@dataclass(frozen=True)
class _Found:
    """Samples at which the supply is down, and the pressure that shows it, Pa; NaN without one."""

    down: Mask
    seen: FloatArray


@dataclass(frozen=True)
class _Motion:
    """Opening of the valve as a share of the full one, and speed as a share of the full speed."""

    opening: FloatArray
    speed: FloatArray

    @property
    def stalls(self) -> Mask:
        """Where the valve is opened and the rod hardly moves, or moves the other way."""
        size, along = np.abs(self.opening), self.speed * np.sign(self.opening)
        return np.asarray((size > STALL_OPENING) & (along < STALL_SPEED * size))

    @classmethod
    def of(cls, record: Record, rig: Rig) -> _Motion:
        assert record.dt_s is not None
        values = rig.values
        opening = np.clip(record.column("command_v") / values["valve.rated_command_v"], -1.0, 1.0)
        position = _smoothed(record.column("position_m"), record.dt_s)
        speed = _smoothed(np.gradient(position, record.dt_s), record.dt_s) / full_speed(values)
        return cls(_smoothed(opening, record.dt_s), speed)


def _measured(record: Record, top: float) -> _Found:
    """By the measured supply: below SUPPLY_LOW of its upper level, as long as it is not up again.

    The level is that of the record, because the value of the rig may be wrong.
    """
    assert record.dt_s is not None
    column = record.column(SUPPLY_PRESSURE)
    share = _smoothed(column, record.dt_s) / top
    return _Found(_down(share < SUPPLY_LOW, share >= SUPPLY_AGAIN, record.dt_s), column)


def _by_chambers(record: Record, rig: Rig, motion: _Motion) -> _Found:
    """By the chamber pressures, whatever the load, the opening and the rated flow are.

    Both edges have one opening and pass the flow of one speed (Merritt, Hydraulic Control Systems,
    Wiley 1967, ch. 6), so that their drops are as the squares of the areas:

        p_s = p_a + (p_b - p_t) (A_a / A_b)^2  extending,
        p_s = p_b + (p_a - p_t) (A_b / A_a)^2  retracting
    """
    assert record.dt_s is not None
    says, tank = rig.values["supply.pressure_pa"], rig.values["supply.tank_pressure_pa"]
    ratio = 1.0 - (rig.values["cylinder.rod_m"] / rig.values["cylinder.bore_m"]) ** 2
    p_a, p_b = (_smoothed(record.column(name), record.dt_s) for name in CHAMBER_PRESSURES)
    out, back = p_a + (p_b - tank) / ratio**2, p_b + (p_a - tank) * ratio**2
    stands = np.abs(motion.speed) < STANDS
    # Of a rod that stands both sums are bounds from above, if the valve is open.
    seen = np.where(stands, np.maximum(out, back), np.where(motion.speed > 0.0, out, back))
    opened = np.abs(motion.opening) > STALL_OPENING
    share = np.asarray(seen / says)
    # Edges may differ from each other: what the record shows at its best in a direction counts.
    for way in (motion.speed >= STANDS, motion.speed <= -STANDS):
        if (way & opened).any():
            share[way] /= min(float(np.quantile(share[way & opened], 0.9)), 1.0)
    # External leakage, too, lowers both pressures at small openings, but the rod follows there.
    low = (share < SUPPLY_LOW) & (motion.stalls | (np.abs(motion.opening) > WIDE_OPENING))
    up = np.where(stands, share >= 1.0, share >= SUPPLY_AGAIN)
    if np.quantile(share, 0.98) < SUPPLY_LOW:
        low = np.zeros(low.size, dtype=bool)  # another unit, or another machine
    down = _settled(_down(low, up, record.dt_s), record.dt_s)
    return _Found(down, np.where(low, seen, np.nan))


def _by_motion(record: Record, motion: _Motion) -> _Found:
    """By a rod that does not follow a valve which is as far open as elsewhere, where it does."""
    assert record.dt_s is not None
    size, stalls = np.abs(motion.opening), motion.stalls
    moves = (np.abs(motion.speed) > STANDS) & ~stalls
    down = np.zeros(size.size, dtype=bool)
    position = record.column("position_m")
    margin = STANDS * float(np.ptp(position))
    for run in _runs(_down(size * stalls, moves, record.dt_s, STALL_S)):
        here = np.flatnonzero(stalls[run]) + run.start
        usual = float(np.median(size[here]))
        elsewhere = (size > 0.5 * usual) & (size <= usual)
        elsewhere[run] = False
        # The rod follows no smaller opening elsewhere: a dead band or another valve.
        follows = elsewhere.any() and float(np.mean(moves[elsewhere])) > FOLLOWS
        extends = float(np.mean(motion.opening[here])) > 0.0
        beyond = (
            position.max() - position[run].max()
            if extends
            else (position[run].min() - position.min())
        )
        # Where the rod never goes farther it may stand at a stop.
        down[run] = follows and beyond > margin
    return _Found(_settled(down, record.dt_s), np.full(size.size, np.nan))


def _down(low: Mask | FloatArray, up: Mask, dt_s: float, least_s: float = SUPPLY_LOW_S) -> Mask:
    """Runs that nothing shows to be up again, and of which enough samples are low, by weight."""
    down = np.zeros(low.size, dtype=bool)
    for run in _runs(~up | (low > 0.0)):
        down[run] = float(np.sum(low[run])) * dt_s >= least_s
    return down


def _settled(down: Mask, dt_s: float) -> Mask:
    """Adds to each span the time that a pump takes to come up, or has taken to go down."""
    further = round(SUPPLY_SETTLED_S / dt_s)
    wider = down.copy()
    for run in _runs(down):
        wider[max(run.start - further, 0) : run.stop + further] = True
    return wider


def _runs(mask: Mask) -> list[slice]:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]])))
    return [slice(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


def _smoothed(column: FloatArray, dt_s: float) -> FloatArray:
    length = max(1, 2 * round(0.5 * SUPPLY_SMOOTHED_S / dt_s) + 1)
    return np.asarray(uniform_filter1d(column, length, mode="nearest"), dtype=np.float64)


def _remark(record: Record, found: _Found, kept: slice, says: float) -> Remark:
    assert record.dt_s is not None
    start = 0.0 if record.time_s is None else float(record.time_s[0])
    spans = ", ".join(
        f"{start + run.start * record.dt_s:.4g} to {start + run.stop * record.dt_s:.4g} s"
        for run in _runs(found.down)[:3]
    )
    share = f"in {100.0 * float(np.mean(found.down)):.2g} % of the record ({spans})"
    seen = found.seen[found.down & np.isfinite(found.seen)]
    if not seen.size:
        what = f"the rod does not follow the command {share}, although it does elsewhere"
    elif SUPPLY_PRESSURE in record.columns:
        what = f"the supply is measured at {_bar(float(np.median(seen)))} (median) {share}"
    else:
        what = f"the chamber pressures show a supply of {_bar(float(np.median(seen)))} {share}"
    ends = [start + place * record.dt_s for place in (kept.start, kept.stop)]
    return Remark(
        record.name,
        f"{what}, where the rig says {_bar(says)}: the pump was off, started or throttled, or the "
        f"valve was shut off. It is left out: {ends[0]:.4g} to {ends[1]:.4g} s are used, the "
        "longest part with the supply up",
    )


def _bar(pressure_pa: float) -> str:
    return f"{1e-5 * pressure_pa:.3g} bar"

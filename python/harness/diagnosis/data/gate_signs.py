# SPDX-License-Identifier: MIT
"""Gate for signs: direction of command and position, and assignment of the pressure ports.

Gate for the supply over the time: spans in which the pump was off, or far below its pressure.

Three signs show them, and the first one for which a record has the channels counts. A droop under
flow is none: it is an effect of the catalogue, and stays above SUPPLY_LOW.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.ndimage import uniform_filter1d
from scipy.signal import savgol_filter

from ...base.numbers import FloatArray
from ...catalogue.channels import CHAMBER_PRESSURES, SUPPLY_PRESSURE
from ...records import Record
from ...records.mapping import how_to_exchange
from ...rigs import Rig
from ..schema import Remark
from .floor import SPRING_HIDES_NOISE
from .gate_ranges import PRESSURE_UNIT
from .repeats import areas, full_speed, oil_spring_hz

# With a correlation of command and speed below minus this value, the signs are certainly opposite.
# Oil springs and limit cycles turn the phase, but on the whole by less than half a turn.
OPPOSITE = 0.3
# The position is smoothed over this time for the force balance; an oil spring of 20 Hz is kept.
FORCE_SMOOTHED_S = 0.02
# The chamber pressures may be exchanged if the exchange leaves less than this share of the force
# that the columns as named leave unexplained.
EXCHANGED = 0.3
# A sign is certain where the value is this many of its standard deviations: because a refusal must
# be certain, a false one may occur in some ten thousand records only. The deviations come from this
# many blocks of a record.
PORTS_DEVIATIONS = 4.0
BLOCKS = 10


def _slopes(record: Record, order: int) -> FloatArray:
    """Derivative of the position from a parabola fitted over FORCE_SMOOTHED_S, in SI units."""
    assert record.dt_s is not None
    length = max(5, 2 * round(0.5 * FORCE_SMOOTHED_S / record.dt_s) + 1)
    return np.asarray(
        savgol_filter(
            record.column("position_m"), length, polyorder=2, deriv=order, delta=record.dt_s
        ),
        dtype=np.float64,
    )


def _deviation(values: FloatArray) -> FloatArray:
    """Deviation from the mean, in units of the largest value, so that squares are of order one."""
    scaled = values / np.abs(values).max()
    return np.asarray(scaled - scaled.mean(), dtype=np.float64)


def correlation(first: FloatArray, second: FloatArray) -> float:
    """Returns the correlation coefficient of two signals in any unit.

    `np.corrcoef` squares the values without scaling, which loses very small and very large ones.

    Parameters
    ----------
    first, second
        shape (N,); each has a value other than zero.

    Returns
    -------
    float
        -1 to 1; 0 where a signal is constant.
    """
    a, b = _deviation(first), _deviation(second)
    size = np.sqrt((a @ a) * (b @ b))
    return float(a @ b / size) if size > 0.0 else 0.0


def jackknife(terms: FloatArray, force: FloatArray) -> tuple[FloatArray, list[FloatArray]]:
    """Weights of least squares, from all samples and from all but each of BLOCKS blocks.

    Neighbouring samples are not independent; blocks of a tenth of the record nearly are (B. Efron,
    The Jackknife, the Bootstrap and Other Resampling Plans, SIAM 1982).

    Parameters
    ----------
    terms, force
        shape (N, n) and (N,), terms of order one.
    """
    blocks = np.array_split(np.arange(force.size), BLOCKS)
    squares = [terms[block].T @ terms[block] for block in blocks]
    products = [terms[block].T @ force[block] for block in blocks]

    def weights(left_out: int | None) -> FloatArray:
        kept = [index for index in range(BLOCKS) if index != left_out]
        square = np.sum([squares[index] for index in kept], axis=0)
        product = np.sum([products[index] for index in kept], axis=0)
        return np.asarray(np.linalg.lstsq(square, product, rcond=1e-12)[0])

    return weights(None), [weights(index) for index in range(BLOCKS)]


def check_directions(record: Record, rig: Rig) -> Iterator[Remark]:
    """Checks that a positive command extends the rod, by the correlation of command and speed."""
    command, speed = record.column("command_v"), _slopes(record, 1)
    if np.ptp(command) == 0.0 or np.ptp(speed) == 0.0:
        return
    # The means are subtracted, because the mean command may hold a load.
    coefficient = correlation(command, speed)
    if coefficient > -OPPOSITE:
        return
    yield Remark(
        record.name,
        f"the rod moves against the command (correlation {coefficient:.2f}): position counts "
        "from the cap end, and a positive command must extend; change the sign of one of them",
        serious=True,
    )


def check_ports(record: Record, rig: Rig) -> Iterator[Remark]:
    """Compares the force balance with the pressures as named and with the pressures exchanged.

    They are exchanged for certain only where the columns as named contradict mechanics and the
    other way round agrees with it: a load has a positive mass, and its friction takes power.
    """
    if rig.plant != "ehs" or any(name not in record.columns for name in CHAMBER_PRESSURES):
        return
    p_a, p_b = (record.column(name) for name in CHAMBER_PRESSURES)
    if np.ptp(p_a) == 0.0 or np.ptp(p_b) == 0.0 or np.ptp(record.column("position_m")) == 0.0:
        return
    spring_hz = oil_spring_hz(rig)
    assert record.dt_s is not None
    if spring_hz is not None and spring_hz * record.dt_s > SPRING_HIDES_NOISE:
        return  # the positions do not show the acceleration that the pressures cause
    cap, annulus = areas(rig.values)
    as_named = _balance(record, cap * p_a - annulus * p_b)
    exchanged = _balance(record, cap * p_b - annulus * p_a)
    fits_better = exchanged.residual < EXCHANGED * as_named.residual
    contradicts = max(as_named.mass, as_named.friction) < -PORTS_DEVIATIONS
    agrees = exchanged.mass > PORTS_DEVIATIONS and exchanged.friction > -PORTS_DEVIATIONS
    if agrees and (fits_better or (contradicts and exchanged.friction > PORTS_DEVIATIONS)):
        yield Remark(
            record.name,
            "pressure_a_pa and pressure_b_pa are exchanged: only the other way round do they "
            "balance the motion; A is the cap side. Exchange the two columns: "
            f"{how_to_exchange(record, rig.columns, *CHAMBER_PRESSURES)}",
            serious=True,
        )
    elif min(as_named.mass, as_named.friction) < -PORTS_DEVIATIONS:
        yield Remark(
            record.name,
            "the net force of pressure_a_pa and pressure_b_pa acts against the motion, as if "
            "the load had a negative mass or its friction gave power; check which pressure is "
            "which, and the bore and the rod in the rig file",
        )


@dataclass(frozen=True)
class _Balance:
    """Force balance: rms of the residual, N; mass and power of friction in their deviations."""

    residual: float
    mass: float
    friction: float


def _balance(record: Record, force: FloatArray) -> _Balance:
    """Fits the force balance, with the deviations of a jackknife over blocks of the record.

    m a + b v + F_c sgn v + k y + F_0 = F,   power of friction = mean of (b v + F_c sgn v) v
    """
    speed, acceleration = _slopes(record, 1), _slopes(record, 2)
    terms = np.column_stack(
        [acceleration, speed, np.sign(speed), record.column("position_m"), np.ones(len(record))]
    )
    size = np.abs(terms).max(axis=0)
    terms = terms / np.where(size > 0.0, size, 1.0)
    scaled_force = force / np.abs(force).max()
    power = np.array([np.mean(terms[:, 1] * speed), np.mean(terms[:, 2] * speed)])
    whole, parts = jackknife(terms, scaled_force)

    def signs(weights: FloatArray) -> FloatArray:
        return np.array([weights[0], power @ weights[1:3]])

    deviations = np.sqrt((BLOCKS - 1) * np.var([signs(part) for part in parts], axis=0))
    mass, friction = signs(whole) / np.maximum(deviations, 1e-300)
    residual = float(np.std(scaled_force - terms @ whole) * np.abs(force).max())
    return _Balance(residual, float(mass), float(friction))


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
        if top <= 0.0:
            return whole, []  # no level to compare with; `check_pressures` says so
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

# SPDX-License-Identifier: MIT
import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT

from ehsid.harness.diagnosis.data import gate_ranges, gate_signs
from ehsid.harness.diagnosis.data.gate import gate, longest_stretch, spikes, stretch, usable_part
from ehsid.harness.diagnosis.data.gate_signs import correlation
from ehsid.harness.diagnosis.data.repeats import oil_spring_hz
from ehsid.harness.records import Origin, Taken, make_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

RIGS = ROOT / "examples" / "rigs"
DT_S = 1e-3
N = 6000
BENCH = read_rig(RIGS / "bench.toml")
NOISE = {
    "position_noise_m": 5e-6,
    "pressure_a_noise_pa": 1e4,
    "pressure_b_noise_pa": 1e4,
    "supply_pressure_noise_pa": 1e4,
}
RIG = Rig("bench", "ehs", BENCH.values, sensors=NOISE)
Columns = dict[str, np.ndarray]
AMPLITUDE = 3.0


def columns_of(seed: int = 1, samples: int = N) -> Columns:
    rng = np.random.default_rng(seed)
    command = multisine(samples, DT_S, band_hz=(0.5, 10.0), peak=AMPLITUDE, rng=rng)
    noise = draw_noise(RIG, samples, rng)
    run = simulate(RIG, command, dt_s=DT_S, substeps=4, noise=noise, position0_m=0.1).record
    names = ("command_v", "position_m", "pressure_a_pa", "pressure_b_pa", "supply_pressure_pa")
    assert run.time_s is not None
    return {"time_s": run.time_s, **{name: run.column(name).copy() for name in names}}


CLEAN = columns_of()


def remarks(change: Callable[[Columns], None], rig: Rig = RIG) -> list[tuple[str, bool]]:
    columns = {name: column.copy() for name, column in CLEAN.items()}
    change(columns)
    result = gate([make_record(columns, name="one")], rig)
    assert all(remark.record == "one" for remark in result)
    return [(remark.what, remark.serious) for remark in result]


def test_how_a_log_was_read_is_a_remark() -> None:
    taken = Taken("position_m", "Stroke", "mm", 1e-3, 0.0, "by its name")
    origin = Origin("spreadsheet, sheet 'Data'", (taken,), ("rows 3 to 5 are left out",))
    found = gate([make_record(CLEAN, name="one", origin=origin)], RIG)
    assert [remark.what for remark in found] == [
        "read as spreadsheet, sheet 'Data': position_m from 'Stroke' in mm",
        "rows 3 to 5 are left out",
    ]
    assert not any(remark.serious for remark in found)


def test_clean_records_have_no_remarks() -> None:
    records = [make_record(CLEAN, name="one"), make_record(columns_of(2), name="two")]
    assert gate(records, RIG) == ()


def test_a_record_of_a_motor_passes() -> None:
    rig = read_rig(RIGS / "axis.toml")
    rng = np.random.default_rng(3)
    command = multisine(N, DT_S, band_hz=(0.5, 10.0), peak=3.0, rng=rng)
    assert gate([simulate(rig, command, dt_s=DT_S).record], rig) == ()


def _set(name: str, function: Callable[[np.ndarray], np.ndarray]) -> Callable[[Columns], None]:
    def change(columns: Columns) -> None:
        columns[name] = function(columns[name])

    return change


def _each(*names: str, by: float) -> Callable[[Columns], None]:
    def change(columns: Columns) -> None:
        for name in names:
            columns[name] = columns[name] * by

    return change


def _exchanged(columns: Columns) -> None:
    columns["pressure_a_pa"], columns["pressure_b_pa"] = (
        columns["pressure_b_pa"],
        columns["pressure_a_pa"],
    )


def _part(samples: int) -> Callable[[Columns], None]:
    def change(columns: Columns) -> None:
        for name in columns:
            columns[name] = columns[name][:samples]

    return change


def _thinned(columns: Columns) -> None:
    for name in columns:
        columns[name] = columns[name][::20]


def _frozen(column: np.ndarray) -> np.ndarray:
    column[2000:2400] = column[2000]
    return column


def _spiked(column: np.ndarray) -> np.ndarray:
    column[[500, 2500, 4000]] += 2e-3
    return column


def _clipped(column: np.ndarray) -> np.ndarray:
    return np.minimum(column, np.quantile(column, 0.95))


def _wavering(time: np.ndarray) -> np.ndarray:
    return time + 4e-6 * np.random.default_rng(0).uniform(-1.0, 1.0, time.size)


def _drifting(time: np.ndarray) -> np.ndarray:
    return np.append(0.0, np.cumsum(DT_S * np.linspace(0.998, 1.002, time.size - 1)))


UNIT = "perhaps it is in another unit: --map '{}={} [{}]'".format


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "words", "serious"),
    [
        (_part(2000), "2 s without a gap are too short: the diagnosis needs 2.3 s", True),
        (_set("command_v", lambda c: 0.0 * c + 1.0), "command_v is constant", True),
        (_set("position_m", lambda c: 0.0 * c + 0.1), "position_m is constant", True),
        (
            _set("position_m", lambda c: 0.1 + 1e-6 * np.random.default_rng(0).normal(size=N)),
            "there is no motion to compare",
            True,
        ),
        (
            _set("pressure_a_pa", lambda c: 0.0 * c + 5e6),
            "pressure_a_pa is constant",
            False,
        ),
        (
            _set("command_v", lambda c: 10.0 * c),
            "beyond the rated 10 V for 31 %",
            False,
        ),
        (
            _set("command_v", lambda c: 100.0 / AMPLITUDE * c),
            "with per cent, rated is 100",
            True,
        ),
        (_each("position_m", by=1e3), UNIT("position_m", "position_m", "mm"), True),
        (_each("position_m", by=1e2), UNIT("position_m", "position_m", "cm"), True),
        # Farther than the stroke, but nearly as fast as the valve allows in metres.
        (_each("position_m", by=4.0), "is too short, or the unit of the column is wrong", True),
        (_each("pressure_a_pa", by=1e-5), UNIT("pressure_a_pa", "pressure_a_pa", "bar"), True),
        (
            _each("supply_pressure_pa", by=1e-6),
            UNIT("supply_pressure_pa", "supply_pressure_pa", "MPa"),
            True,
        ),
        (_set("position_m", lambda c: c - 0.15), "not counted from the cap end", True),
        (_set("position_m", lambda c: c - c.min() - 0.004), "4 mm beyond an end", False),
        (_set("position_m", lambda c: c - np.quantile(c, 0.2)), "at an end of its stroke", False),
        (_set("supply_pressure_pa", lambda c: 0.8 * c), "(-20 %), beyond its uncertainty", False),
        (_set("pressure_a_pa", lambda c: c - c.min() - 9e4), "add 101325 Pa", False),
        (_set("pressure_a_pa", lambda c: c - c.min() - 9e5), "the sensor's zero and sign", True),
        (_set("pressure_a_pa", lambda c: 3.0 * c), "above what a supply of 1.2e+07 Pa", False),
        (_set("pressure_a_pa", _frozen), "pressure_a_pa froze 1 times, for 0.4 s", False),
        (_set("position_m", _frozen), "position_m froze 1 times, for 0.4 s", False),
        (_set("position_m", _spiked), "position_m has 3 spikes", False),
        (_set("pressure_b_pa", _clipped), "pressure_b_pa stays at its largest value", False),
        (_set("position_m", _clipped), "position_m stays at its largest value", False),
        (_set("command_v", np.negative), "the rod moves against the command", True),
        (_set("position_m", lambda c: 0.3 - c), "the rod moves against the command", True),
        (_exchanged, "are exchanged", True),
        (_set("time_s", _wavering), "the time between samples wavers by 0.3", False),
        (_set("time_s", _drifting), "the clock drifts: the sampling time changes by 0.36 %", False),
        (lambda c: c.pop("time_s"), "there is no column 'time_s'", True),
        (lambda c: c.pop("position_m"), "there is no column 'position_m'", True),
        (_thinned, "too rarely for the oil spring", False),
    ],
)
def test_each_fault_is_named(change: Callable[[Columns], None], words: str, serious: bool) -> None:
    result = remarks(change)
    matching = [remark for remark in result if words in remark[0]]
    assert [remark[1] for remark in matching] == [serious], result
    # Serious remarks come first. A fault that is not serious has no serious remark.
    assert [remark[1] for remark in result] == sorted(
        (remark[1] for remark in result), reverse=True
    )
    assert serious or not any(remark[1] for remark in result)


def test_with_equal_areas_the_mass_shows_exchanged_ports() -> None:
    rig = RIG.with_values({"cylinder.rod_m": 0.0})
    rng = np.random.default_rng(5)
    command = multisine(N, DT_S, band_hz=(0.5, 10.0), peak=3.0, rng=rng)
    noise = draw_noise(rig, N, rng)
    run = simulate(rig, command, dt_s=DT_S, substeps=4, noise=noise).record
    assert run.time_s is not None
    columns = {"time_s": run.time_s, **dict(run.columns)}
    assert gate([make_record(columns)], rig) == ()
    _exchanged(columns)
    (result,) = gate([make_record(columns)], rig)
    assert result.serious
    assert "are exchanged" in result.what


def test_a_mass_that_the_record_hardly_shows_refuses_nothing() -> None:
    """Friction takes all of the net force, 5.8 kN and -1.2 kN, as in a pump-controlled cylinder."""
    rng = np.random.default_rng(8)
    time = DT_S * np.arange(N)
    position = 0.15 + 0.05 * np.sin(2.0 * np.pi * 0.5 * time)
    speed = np.gradient(position, DT_S)
    cap = 0.25 * np.pi * RIG.values["cylinder.bore_m"] ** 2
    annulus = cap - 0.25 * np.pi * RIG.values["cylinder.rod_m"] ** 2
    force = np.where(speed > 0.0, 5.8e3, -1.2e3)
    rod = np.full(N, 3e6)
    columns = {
        "time_s": time,
        "command_v": 10.0 * speed + 0.01 * rng.standard_normal(N),
        "position_m": position + 5e-6 * rng.standard_normal(N),
        "pressure_a_pa": (force + annulus * rod) / cap + 1e4 * rng.standard_normal(N),
        "pressure_b_pa": rod + 1e4 * rng.standard_normal(N),
    }
    assert not any("exchanged" in each.what for each in gate([make_record(columns)], RIG))


def test_forces_against_the_motion_are_remarked_on_but_not_refused() -> None:
    """The rod of the rig file is so thick that the net force has the wrong sign of friction."""
    columns = {name: column.copy() for name, column in CLEAN.items()}
    mean = columns["pressure_a_pa"].mean()
    columns["pressure_a_pa"] = 2.0 * mean - columns["pressure_a_pa"]
    (remark,) = (
        each
        for each in gate([make_record(columns)], RIG)
        if "acts against the motion" in each.what or "exchanged" in each.what
    )
    assert not remark.serious


@pytest.mark.parametrize(
    ("as_named", "exchanged", "serious"),
    [
        # Residual in N, then mass and power of friction in their standard deviations.
        ((100.0, -9.0, -9.0), (100.0, 9.0, 9.0), [True]),
        ((1000.0, 9.0, 9.0), (100.0, 9.0, 0.0), [True]),
        ((1000.0, 9.0, 9.0), (100.0, 2.0, 9.0), []),
        ((100.0, -9.0, -1.0), (100.0, 9.0, 9.0), [False]),
        ((100.0, -1.0, -9.0), (100.0, 9.0, 9.0), [False]),
        ((100.0, -9.0, -9.0), (100.0, 9.0, 1.0), [False]),
        ((100.0, -3.0, -3.0), (100.0, 9.0, 9.0), []),
    ],
)
def test_exchanged_ports_are_refused_only_where_mass_and_friction_say_so(
    monkeypatch: pytest.MonkeyPatch,
    as_named: tuple[float, float, float],
    exchanged: tuple[float, float, float],
    serious: list[bool],
) -> None:
    balances = iter([gate_signs._Balance(*as_named), gate_signs._Balance(*exchanged)])
    monkeypatch.setattr(gate_signs, "_balance", lambda record, force: next(balances))
    remarks_on_ports = gate_signs.check_ports(make_record(CLEAN), RIG)
    assert [remark.serious for remark in remarks_on_ports] == serious


def test_ports_are_not_judged_where_the_sampling_hides_the_acceleration() -> None:
    columns = {name: column[::50].copy() for name, column in columns_of(samples=60_000).items()}
    _exchanged(columns)
    assert not any("pressure_a_pa and" in each.what for each in gate([make_record(columns)], RIG))


def test_a_gap_has_a_remark_and_the_longest_part_is_checked() -> None:
    is_present = np.r_[0:1500, 1900:N]
    columns = {name: column[is_present] for name, column in CLEAN.items()}
    record = make_record(columns, name="one")
    (result,) = gate([record], RIG)
    assert not result.serious
    assert "missing at 1 places, the longest for 0.401 s after 1.499 s" in result.what
    part = longest_stretch(record)
    assert len(part) == N - 1900
    assert part.time_s is not None
    assert part.time_s[0] == CLEAN["time_s"][1900]
    assert len(part.segments) == 1
    first = stretch(record, record.segments[0])
    assert np.array_equal(first.column("position_m"), CLEAN["position_m"][:1500])
    # If all parts are too short, there is a serious remark.
    is_present = np.concatenate([np.arange(k, k + 900) for k in range(0, N - 900, 1000)])
    short = make_record({name: column[is_present] for name, column in CLEAN.items()}, name="one")
    (serious,) = (remark for remark in gate([short], RIG) if remark.serious)
    assert serious.what == (
        "0.9 s without a gap are too short: the diagnosis needs 2.3 s, the first 0.3 s and 4 "
        "windows; there are 5 gaps, the longest of 0.101 s after 0.899 s, so the record is in "
        "6 pieces: find out why the logger left rows out, or give a part without a gap"
    )


def test_single_missing_rows_are_named_as_the_cause_and_not_the_length() -> None:
    columns = {name: np.delete(column, np.s_[50::97]) for name, column in CLEAN.items()}
    rows = N - columns["time_s"].size
    (serious,) = (each for each in gate([make_record(columns)], RIG) if each.serious)
    assert serious.what == (
        "0.096 s without a gap are too short: the diagnosis needs 2.3 s, the first 0.3 s and 4 "
        f"windows; {rows} single rows are missing, so the record is in {rows + 1} "
        "pieces: read it with --dt 0.001, which interpolates holes of up to 3 rows"
    )
    # A record that is too short even as a whole must be longer.
    brief = make_record({name: column[:1000] for name, column in columns.items()})
    (serious,) = (each for each in gate([brief], RIG) if each.serious)
    assert serious.what.endswith("record for longer")


def test_records_that_differ_in_noise_or_sampling_are_named() -> None:
    noisier = columns_of(2)
    noisier["pressure_a_pa"] += 1e5 * np.random.default_rng(0).standard_normal(N)
    (result,) = gate([make_record(CLEAN, name="one"), make_record(noisier, name="two")], RIG)
    assert result.record == ""
    # The message has two digits; the medians scatter by 2.5 %.
    numbers = re.match(
        r"the noise of pressure A is (\S+) bar in 'two' and (\S+) bar in 'one'", result.what
    )
    assert numbers is not None
    assert [float(number) for number in numbers.groups()] == pytest.approx([1.0, 0.1], rel=0.1)
    halved = {name: column[::2] for name, column in columns_of(2).items()}
    result = gate([make_record(CLEAN, name="one"), make_record(halved, name="two")], RIG)[-1]
    assert "sampled every 1 to 2 ms" in result.what


def test_noise_near_vacuum_is_no_fault_of_the_sensor() -> None:
    def near_vacuum(column: np.ndarray) -> np.ndarray:
        low_pressure = np.maximum(column - np.quantile(column, 0.1), 0.0) + 2e3
        return low_pressure + 1e4 * np.random.default_rng(0).standard_normal(N)

    assert remarks(_set("pressure_a_pa", near_vacuum)) == []


@given(
    seed=st.integers(0, 1000),
    size=st.floats(60.0, 1e4),
    sign=st.sampled_from([-1.0, 1.0]),
    index=st.integers(60, 3900),
    frequency=st.floats(0.1, 40.0),
)
def test_spikes_are_marked_and_motion_is_not(
    seed: int, size: float, sign: float, index: int, frequency: float
) -> None:
    rng = np.random.default_rng(seed)
    # The motion has up to a thousand times the noise at up to 40 Hz. Within the five samples of the
    # median its curvature is smaller than the spike.
    amplitude = min(1000.0, 20.0 / (2.0 * np.pi * frequency * 2.0 * DT_S) ** 2)
    signal = amplitude * np.sin(2.0 * np.pi * frequency * np.arange(4000) * DT_S)
    signal += rng.standard_normal(4000)
    assert not spikes(signal).any()
    signal[index] += sign * size
    if size > 200.0:
        assert np.flatnonzero(spikes(signal)).tolist() == [index]


@pytest.mark.parametrize("unit", [1e-300, 1.0, 1e150, 1e300])
def test_a_correlation_does_not_depend_on_the_unit(unit: float) -> None:
    # Both functions sum 400 products, with an error of a few 1e-16 of the sum of their sizes.
    rng = np.random.default_rng(3)
    speed = rng.standard_normal(400)
    noisy = speed + rng.standard_normal(400)
    wanted = np.corrcoef(speed, noisy)[0, 1]
    assert correlation(unit * noisy, speed) == pytest.approx(wanted, rel=1e-12)
    assert correlation(speed, -unit * noisy) == pytest.approx(-wanted, rel=1e-12)
    assert correlation(np.full(400, unit), speed) == 0.0


@given(
    data=st.data(),
    n=st.integers(2, 400),
    dt_s=st.sampled_from([1e-4, 1e-3, 0.05, 1.0]),
    plant=st.sampled_from(["bench", "axis", "linear"]),
    scale=st.sampled_from([0.0, 1e-300, 1e-6, 1.0, 1e7, 1e90]),
)
def test_the_gate_never_raises(
    data: st.DataObject, n: int, dt_s: float, plant: str, scale: float
) -> None:
    rng = np.random.default_rng(data.draw(st.integers(0, 1000)))
    names = ["command_v", "position_m", "pressure_a_pa", "pressure_b_pa", "supply_pressure_pa"]
    names_in_record = data.draw(
        st.lists(st.sampled_from([*names, "velocity_m_s", "spool"]), min_size=1)
    )
    columns = {name: scale * rng.standard_normal(n) for name in names_in_record}
    if data.draw(st.booleans()):
        time = np.arange(n) * dt_s
        if data.draw(st.booleans()):
            time[n // 2 :] += 10.0 * dt_s
        columns["time_s"] = time
    rig = read_rig(RIGS / f"{plant}.toml")
    record = make_record(columns, name="one")
    for remark in gate([record, record], rig):
        assert remark.record in ("", "one")
        # A remark states the fault and a remedy.
        assert len(remark.what) > 40
    # A record that is too short or lacks a column always has a serious remark.
    if (
        n * dt_s < 2.3
        or "time_s" not in columns
        or not {"command_v", "position_m"} <= set(names_in_record)
    ):
        assert any(remark.serious for remark in gate([record], rig))


def test_the_oil_spring_is_that_of_the_linear_servo() -> None:
    linear = read_rig(RIGS / "linear.toml")
    # Equal chambers at mid-stroke, Eq. (1) of the servo model:
    # w^2 = beta (A^2/V + A^2/V) / m with V = V_t/2.
    v = linear.values
    half = 0.5 * v["linear.volume_m3"]
    area = v["linear.area_m2"]
    bore = np.sqrt(4.0 * area / np.pi)
    rig = RIG.with_values(
        {
            "cylinder.bore_m": bore,
            "cylinder.rod_m": 0.0,
            "cylinder.dead_volume_a_m3": half - area * 0.5 * BENCH.values["cylinder.stroke_m"],
            "cylinder.dead_volume_b_m3": half - area * 0.5 * BENCH.values["cylinder.stroke_m"],
            "load.mass_kg": v["linear.mass_kg"],
            "fluid.bulk_modulus_pa": v["linear.bulk_modulus_pa"],
        }
    )
    assert oil_spring_hz(rig) == pytest.approx(oil_spring_hz(linear))
    assert oil_spring_hz(read_rig(RIGS / "axis.toml")) is None


def _pumped(low: float, begin_s: float, end_s: float, droop: bool = False) -> Columns:
    """A record of the textbook model, alone: its supply is `low` of its pressure in a span.

    The flow of both edges is turbulent, and the rod has no mass and no load: p_a = r p_b with r the
    area at the rod side over that at the cap side. As both edges pass the flow of one speed,

        p_s - p_a = (p_b - p_t) / r^2  extending,  p_s - p_b = (p_a - p_t) r^2  retracting
    """
    values = RIG.values
    says, tank = values["supply.pressure_pa"], values["supply.tank_pressure_pa"]
    time_s = np.arange(4000) * 2e-3
    opening = 0.35 * np.sin(2.0 * np.pi * 0.5 * time_s) + 0.2 * np.sin(2.0 * np.pi * 1.3 * time_s)
    share = np.where((time_s >= begin_s) & (time_s < end_s), low, 1.0)
    if droop:
        share = 1.0 - low * np.abs(opening) / np.abs(opening).max()
    supply = np.maximum(share * says, tank * 1.25)
    r = 1.0 - (values["cylinder.rod_m"] / values["cylinder.bore_m"]) ** 2
    out_b = (supply + tank / r**2) / (r + 1.0 / r**2)
    back_b = (supply + tank * r**2) / (1.0 + r**3)
    p_b = np.where(opening > 0.0, out_b, back_b)
    area = 0.25 * np.pi * values["cylinder.bore_m"] ** 2
    drop = np.where(opening > 0.0, supply - r * p_b, r * p_b - tank)
    flow = values["valve.rated_flow_m3_s"] * opening
    flow = flow * np.sqrt(np.maximum(drop, 0.0) / values["valve.rated_pressure_drop_pa"])
    rng = np.random.default_rng(4)
    noise = rng.standard_normal((4, time_s.size)) * np.array([[5e-6], [1e4], [1e4], [1e4]])
    position = 0.5 * values["cylinder.stroke_m"] + np.cumsum(flow) * 2e-3 / area
    return {
        "time_s": time_s,
        "command_v": opening * values["valve.rated_command_v"],
        "position_m": position + noise[0],
        "pressure_a_pa": r * p_b + noise[1],
        "pressure_b_pa": p_b + noise[2],
        "supply_pressure_pa": supply + noise[3],
    }


_PRESSURES = ("supply_pressure_pa", "pressure_a_pa", "pressure_b_pa")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("low", "begin_s", "end_s", "without", "used_s", "words"),
    [
        (0.01, 0.0, 2.2, 0, (2.2, 8.0), "the supply is measured at"),
        (0.01, 0.0, 2.2, 1, (2.2, 8.0), "the chamber pressures show a supply of"),
        (0.01, 0.0, 2.2, 3, (2.2, 8.0), "the rod does not follow the command"),
        (0.01, 3.0, 4.6, 0, (4.6, 8.0), "the supply is measured at"),
        (0.01, 3.0, 4.6, 1, (4.6, 8.0), "the chamber pressures show a supply of"),
        (0.01, 5.6, 8.0, 0, (0.0, 5.6), "the supply is measured at"),
        (0.01, 5.6, 8.0, 1, (0.0, 5.6), "the chamber pressures show a supply of"),
        (0.01, 5.6, 8.0, 3, (0.0, 5.6), "the rod does not follow the command"),
        (0.5, 0.0, 3.0, 0, (3.0, 8.0), "the supply is measured at"),
        (0.5, 0.0, 3.0, 1, (3.0, 8.0), "the chamber pressures show a supply of"),
    ],
)
def test_spans_with_the_supply_down_are_named_and_left_out(
    low: float, begin_s: float, end_s: float, without: int, used_s: tuple[float, float], words: str
) -> None:
    """With its sensor, from the chamber pressures, and from the motion alone."""
    columns = _pumped(low, begin_s, end_s)
    for name in _PRESSURES[:without]:
        del columns[name]
    record = make_record(columns, name="one")
    part, found = usable_part(record, RIG)
    assert [remark.serious for remark in found] == [False]
    assert found[0].what.startswith(words)
    assert found[0] in gate([record], RIG)
    assert part.time_s is not None
    # A rest beside the span, and the time of a pump, are left out too where it is not measured.
    room = 0.1 if without == 0 else 1.0
    assert used_s[0] - 0.1 <= part.time_s[0] <= used_s[0] + room
    assert used_s[1] - room <= part.time_s[-1] <= used_s[1] + 0.1


@pytest.mark.parametrize("without", [0, 1, 3])
@pytest.mark.parametrize("lost", [0.0, 0.1, 0.35])
def test_a_droop_under_flow_is_no_pump_that_is_off(lost: float, without: int) -> None:
    columns = _pumped(lost, 0.0, 8.0, droop=True)
    for name in _PRESSURES[:without]:
        del columns[name]
    record = make_record(columns, name="one")
    part, found = usable_part(record, RIG)
    assert found == []
    assert part is record


def test_a_pump_that_is_off_in_the_whole_record_is_refused() -> None:
    remarks = gate([make_record(_pumped(0.02, 0.0, 8.0), name="one")], RIG)
    assert [remark.serious for remark in remarks] == [True]
    assert "the pump was off in the whole record" in remarks[0].what


@pytest.mark.parametrize(
    ("value", "down"), [(1.98, 1.9), (1.9, 1.9), (0.0999, 0.099), (24.0, 24.0), (137.0, 130.0)]
)
def test_an_advised_sampling_time_is_never_longer_than_what_is_needed(
    value: float, down: float
) -> None:
    assert gate_ranges._rounded_down(value) == pytest.approx(down)

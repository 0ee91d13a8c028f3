# SPDX-License-Identifier: MIT
"""The whole of it: a machine with the effect under u' does what the machine did under u."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from sources import ROOT

import ehsid
from ehsid.harness.records import Record, RecordError, make_record, read_record
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.injection import InjectError, inject, injectable
from ehsid.harness.signals.injection.effects import COMMAND, OWN, POSITION, PRESSURES
from ehsid.harness.signals.simulation import simulate

FloatArray = npt.NDArray[np.float64]
RIGS = ROOT / "examples" / "rigs"
EMPS = ROOT / "tests" / "python" / "data" / "emps"
DT_S = 1e-3
ROUNDING_OF_EDGES = 1e-4  # of full opening: the least that the simulator takes

SIZES = {
    "load_force": {"force_n": -12.0},
    "gain": {"factor": 1.3},
    "valve_dead_band": {"overlap": 0.04},
    "valve_dead_band_sides": {"overlap_a": 0.05, "overlap_b": 0.02},
    "valve_null_bias": {"offset": -0.03},
    "valve_lag": {"bandwidth_hz": 30.0, "damping": 0.7},
    "valve_hysteresis": {"half_width": 0.03},
    "transport_delay": {"delay_s": 0.006},
    "position_bias": {"offset_m": 2e-3},
    "sensor_backlash": {"half_width_m": 1e-4},
    "sensor_nonlinearity": {"amplitude_m": 3e-4, "period_m": 0.05},
    "sensor_lag": {"time_constant_s": 0.004},
    "position_delay": {"delay_s": 0.003},
    "position_sensor_delay": {"delay_s": 0.003},
    "sensor_quantisation": {"step_m": 5e-5},
    "pressure_sensor_gain": {"gain_a": 1.05, "gain_b": 0.97},
    "pressure_sensor_offset": {"offset_a_pa": 3e5, "offset_b_pa": 0.0},
    "pressure_sensor_lag": {"time_constant_s": 0.005},
}


def machine(name: str) -> Rig:
    """Of the examples, without effects of its own, its spool where it is told to be."""
    rig = read_rig(RIGS / f"{name}.toml")
    values = {f"effects.{parameter}": 0.0 for parameter in ("coulomb_friction.force_n",)}
    values |= {"effects.valve_lag.bandwidth_hz": 0.0, "effects.valve_lag.damping": 0.0}
    values |= {"nuisance.spool_bandwidth_hz": 0.0, "nuisance.edge_rounding": ROUNDING_OF_EDGES}
    return rig.with_values(values)


def command(rig: Rig) -> FloatArray:
    """Rest, for a delay to begin in, then two sines through zero, with turns away from it."""
    time_s = np.arange(1500) * DT_S
    shape = 2.0 * np.sin(2.0 * np.pi * 1.7 * time_s) + 1.2 * np.sin(2.0 * np.pi * 6.1 * time_s)
    shape *= np.sin(0.5 * np.pi * np.clip((time_s - 0.02) / 0.3, 0.0, 1.0)) ** 2
    return np.asarray(shape if rig.plant == "axis" else 0.6 * shape)


def told(effect: str, sizes: dict[str, float], rig: Rig) -> dict[str, float]:
    """The same effect as a value of the simulator."""
    if effect == "gain":
        flow = {"ehs": "valve.rated_flow_m3_s", "axis": "axis.force_per_volt"}
        name = flow.get(rig.plant, "linear.flow_gain_m3_s")
        return {name: rig.values[name] * sizes["factor"]}
    return {f"effects.{effect}.{name}": value for name, value in sizes.items()}


def with_effects(rig: Rig, effects: dict[str, dict[str, float]], command: Record) -> Record:
    """What the simulator with these effects makes of the command of a record."""
    values = {k: v for name, sizes in effects.items() for k, v in told(name, sizes, rig).items()}
    return simulate(rig.with_values(values), command.column("command_v"), dt_s=DT_S).record


ROUND_TRIPS = [
    (plant, effect)
    for plant in ("bench", "linear", "axis")
    for effect in COMMAND
    if effect in injectable(read_rig(RIGS / f"{plant}.toml").plant)
]


@pytest.mark.slow
@pytest.mark.parametrize(("plant", "effect"), ROUND_TRIPS)
def test_simulator_with_the_effect_does_under_the_new_command_what_it_did(
    plant: str, effect: str
) -> None:
    rig = machine(plant)
    record = simulate(rig, command(rig), dt_s=DT_S).record
    sizes = SIZES[effect]
    injected = inject(record, rig, {effect: sizes})
    made = injected.record
    assert (not injected.answer.not_exact) == (effect != "valve_lag")
    with_effect = rig.with_values(told(effect, sizes, rig))
    again = simulate(with_effect, made.column("command_v"), dt_s=DT_S, substeps=40).record
    first = simulate(rig, command(rig), dt_s=DT_S, substeps=40).record.column("position_m")
    first = first[: len(again)]
    wrong = np.abs(again.column("position_m") - first).max() / np.ptp(first)
    # The same machine with the effect under the old command: the effect is no small one.
    felt = simulate(with_effect, command(rig), dt_s=DT_S, substeps=40).record
    assert np.abs(felt.column("position_m")[: first.size] - first).max() > 0.01 * np.ptp(first)
    if effect == "valve_lag":
        # A spool that is right on average swings within a sample; and starts at rest, as the
        # other does, but for what the inverse looks ahead.
        assert wrong < 1e-4
    elif effect in ("valve_dead_band", "valve_dead_band_sides", "gain") and plant != "axis":
        # The opening is off by the rounding of the edges at most, against a command of 0.12 (rms):
        # so is the speed.
        assert wrong < 2.0 * ROUNDING_OF_EDGES / 0.12
    else:
        assert wrong < 1e-9


def test_spool_of_the_simulator_gets_the_old_command_behind_play_and_delay() -> None:
    rig = machine("linear")
    record = simulate(rig, command(rig), dt_s=DT_S).record
    effects = {name: SIZES[name] for name in ("valve_hysteresis", "transport_delay")}
    made = inject(record, rig, effects).record
    spool = with_effects(rig, effects, made)
    # Command k acts from t_k on: the spool shows it at the next sample.
    wanted = 0.1 * command(rig)[: len(spool) - 1]
    np.testing.assert_allclose(spool.column("spool")[1:], wanted, rtol=0.0, atol=1e-14)


def test_spool_that_was_measured_goes_where_overlap_and_bias_want_it() -> None:
    rig = machine("linear")
    record = simulate(rig, command(rig), dt_s=DT_S).record
    effects = {name: SIZES[name] for name in ("valve_dead_band", "valve_null_bias")}
    made = inject(record, rig, effects).record
    again = with_effects(rig, effects, made)
    # The simulator's spool is at zero before the first command.
    np.testing.assert_allclose(
        made.column("spool")[1:], again.column("spool")[1:], rtol=0.0, atol=1e-14
    )


def test_all_effects_at_once_act_in_the_order_of_the_catalogue() -> None:
    """Delay, play, bias, overlap, then gain: undone one by one, forwards, by the definitions."""
    rig = machine("bench")
    volts = command(rig)
    columns = {"time_s": np.arange(volts.size) * DT_S, "command_v": volts, "position_m": volts}
    names = ("transport_delay", "valve_hysteresis", "valve_null_bias", "valve_dead_band", "gain")
    made = inject(make_record(columns), rig, {name: SIZES[name] for name in names})
    u = np.concatenate([np.zeros(6), made.record.column("command_v")])[: volts.size] / 10.0
    held, through = 0.0, np.empty_like(u)
    for k, value in enumerate(u):
        held = min(max(held, value - 0.03), value + 0.03)
        through[k] = held
    opening = through - 0.03
    opening = np.sign(opening) * np.maximum(np.abs(opening) - 0.04, 0.0)
    # Before the first command the delay lets nothing through, not even what undoes the bias.
    np.testing.assert_allclose(10.0 * 1.3 * opening[6:], volts[6:], rtol=0.0, atol=1e-14)
    assert made.answer.samples == {
        "source": 1500,
        "dropped_at_start": 0,
        "dropped_at_end": 6,
        "written": 1494,
    }
    assert made.answer.not_exact == ()


def emps() -> tuple[Record, Rig]:
    rig = read_rig(EMPS / "emps.rig.toml")
    return read_record(EMPS / "emps.csv", layout=rig.columns), rig


def test_late_position_is_a_late_command() -> None:
    record, rig = emps()
    late = inject(record, rig, {"position_delay": {"delay_s": 0.004}})
    early = inject(record, rig, {"transport_delay": {"delay_s": 0.004}})
    for name in ("command_v", "position_m"):
        np.testing.assert_array_equal(late.record.column(name), early.record.column(name))
    assert late.answer.effects == early.answer.effects == {"transport_delay": {"delay_s": 0.004}}
    assert late.answer.outside == ()


def test_late_position_beside_pressures_is_that_of_its_sensor() -> None:
    rig = machine("bench")
    record = simulate(rig, command(rig), dt_s=DT_S).record
    for name in ("position_delay", "position_sensor_delay"):
        made = inject(record, rig, {name: {"delay_s": 0.004}})
        assert made.answer.effects == {"position_sensor_delay": {"delay_s": 0.004}}
        assert made.answer.outside == ()
        np.testing.assert_array_equal(
            made.record.column("pressure_a_pa"), record.column("pressure_a_pa")[4:]
        )


def test_readings_of_pressures_are_those_of_a_machine_with_such_sensors() -> None:
    rig = machine("bench")
    record = simulate(rig, command(rig), dt_s=DT_S).record
    effects = {name: SIZES[name] for name in SIZES if name.startswith("pressure_sensor_")}
    assert len(effects) == 3
    made, simulated = inject(record, rig, effects), with_effects(rig, effects, record)
    assert made.answer.effects == effects
    for name in ("command_v", "position_m", "pressure_a_pa", "pressure_b_pa"):
        found = made.record.column(name)
        # Between the samples a pressure is not quite straight, which the filter sees.
        atol = 1e-3 * np.ptp(found) if "pressure" in name else 1e-12
        np.testing.assert_allclose(found, simulated.column(name), rtol=0.0, atol=atol)
    without = make_record(
        {
            "time_s": record.time_s,
            **{n: record.column(n) for n in ("command_v", "position_m", "pressure_a_pa")},
        }
    )
    with pytest.raises(InjectError, match="has no pressure_b_pa: take a record with both"):
        inject(without, rig, effects)


def test_what_is_not_asked_stays_as_it_was() -> None:
    record, rig = emps()
    made = inject(record, rig, {"load_force": {"force_n": 7.0}})
    assert made.record.time_s is not None
    np.testing.assert_array_equal(made.record.time_s, record.time_s)
    for name in ("position_m", "reference_m"):
        np.testing.assert_array_equal(made.record.column(name), record.column(name))
    np.testing.assert_allclose(
        35.15 * made.record.column("command_v") - 7.0,
        35.15 * record.column("command_v"),
        rtol=0.0,
        atol=1e-13,
    )
    sensed = inject(record, rig, {"sensor_lag": {"time_constant_s": 0.005}}).record
    np.testing.assert_array_equal(sensed.column("command_v"), record.column("command_v"))


def test_answer_tells_source_sizes_and_factor() -> None:
    record, rig = emps()
    answer = inject(record, rig, {"gain": {"factor": 1.1}}).answer
    assert answer.parameters == {"axis.force_per_volt": 1.1}
    assert answer.effects == {}
    assert answer.source == "emps.csv"
    assert answer.sha256 == record.sha256
    assert answer.command["rated_v"] is None
    assert answer.command["largest_v_before"] == pytest.approx(4.32566)
    assert answer.command["largest_v"] == pytest.approx(4.32566 / 1.1)


def test_command_beyond_rated_is_told() -> None:
    rig = machine("bench")
    volts = np.array([0.0, 5.0, 9.8, 9.8, -5.0, 0.0])
    columns = {"time_s": np.arange(6) * DT_S, "command_v": volts, "position_m": volts}
    answer = inject(make_record(columns), rig, {"valve_dead_band": {"overlap": 0.05}}).answer
    assert answer.command["share_beyond_rated"] == pytest.approx(2.0 / 6.0)
    assert any("beyond the rated 10 V for 33 %" in remark for remark in answer.remarks)


def test_own_effect_of_the_rig_on_the_wrong_side_is_told() -> None:
    rig = read_rig(RIGS / "bench.toml")
    columns = {"time_s": np.arange(50) * DT_S, "command_v": np.ones(50), "position_m": np.ones(50)}
    answer = inject(make_record(columns), rig, {"valve_dead_band": {"overlap": 0.05}}).answer
    assert len(answer.not_exact) == 1
    assert "'valve_lag'" in answer.not_exact[0]


@pytest.mark.parametrize("plant", ["ehs", "axis", "linear"])
def test_all_that_can_be_put_in_is_of_the_catalogue_or_told_apart(plant: str) -> None:
    known = {
        effect.id: {p.name: (p.minimum, p.maximum) for p in effect.parameters}
        for effect in ehsid.effects()
    }
    there = injectable(plant)
    assert set(there) <= {*COMMAND, *POSITION, *PRESSURES}
    for effect, ranges in there.items():
        assert ranges == (OWN[effect] if effect in OWN else known[effect])
    assert ("valve_dead_band" in there) == (plant != "axis")
    assert ("load_force" in there) == (plant == "axis")


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({}, "no effect is named; name one with --effect; there are: load_force, gain"),
        ({"valve_dead_band": {"overlap": 0.03}}, "does not act on plant 'axis'"),
        ({"coulomb_friction": {"force_n": 9.0}}, "changes what the machine does"),
        ({"transport_dely": {"delay_s": 0.01}}, "did you mean 'transport_delay'"),
        ({"transport_delay": {}}, "'transport_delay': delay_s is missing: expected 0 to 0.2"),
        ({"transport_delay": {"delay_s": 0.3}}, "= 0.3: expected 0 to 0.2"),
        ({"transport_delay": {"delay_s": float("nan")}}, "expected 0 to 0.2"),
        ({"transport_delay": {"delay_s": 0.0}}, "that is no effect"),
        ({"transport_delay": {"delay_s": 0.01, "size": 1.0}}, "has no parameter 'size'"),
    ],
)
def test_what_cannot_be_put_in_is_refused(effects: dict[str, Any], message: str) -> None:
    record, rig = emps()
    with pytest.raises(InjectError, match=message):
        inject(record, rig, effects)


def test_effect_that_the_rig_has_already_is_refused() -> None:
    rig = read_rig(RIGS / "bench.toml")
    columns = {"time_s": np.arange(50) * DT_S, "command_v": np.ones(50), "position_m": np.ones(50)}
    with pytest.raises(InjectError, match="has 'valve_lag' already"):
        inject(make_record(columns), rig, {"valve_lag": SIZES["valve_lag"]})


def test_records_that_cannot_be_used_are_refused() -> None:
    _, rig = emps()
    effects = {"gain": {"factor": 1.1}}
    volts = np.sin(np.arange(200.0))
    with pytest.raises(InjectError, match="has no time_s"):
        inject(make_record({"command_v": volts, "position_m": volts}), rig, effects)
    time_s = np.arange(200) * DT_S
    time_s[100:] += 0.5
    holed = make_record({"time_s": time_s, "command_v": volts, "position_m": volts})
    with pytest.raises(InjectError, match="has 1 gaps"):
        inject(holed, rig, effects)
    with pytest.raises(RecordError, match="position_m"):
        inject(make_record({"time_s": np.arange(200) * DT_S, "command_v": volts}), rig, effects)
    short = make_record({"time_s": np.arange(200) * DT_S, "command_v": volts, "position_m": volts})
    both = {"transport_delay": {"delay_s": 0.06}, "position_delay": {"delay_s": 0.06}}
    with pytest.raises(InjectError, match="more than half of the record"):
        inject(short, rig, both)

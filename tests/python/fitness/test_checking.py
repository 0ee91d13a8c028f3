# SPDX-License-Identifier: MIT
"""The check of a rig against records of a simulated bench, with right and wrong values."""

from __future__ import annotations

import runpy
from collections.abc import Mapping
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from sources import ROOT
from user_simulators import FOLDER, needs_linux64

from ehsid.harness.fitness import Finding, Status, check_rig
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import parse_rig, read_rig
from ehsid.harness.rigs.questions import answered, rig_file_text
from ehsid.harness.signals.excitation import multisine
from ehsid.harness.signals.simulation import draw_noise, simulate

BENCH = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
CHAMBERS = ("position_m", "pressure_a_pa", "pressure_b_pa")
ALL = (*CHAMBERS, "supply_pressure_pa", "spool")
SAMPLES = 4000


@cache
def run(noisy: bool, effects: tuple[tuple[str, float], ...] = ()) -> Record:
    rng = np.random.default_rng(11)
    command = multisine(SAMPLES, 1e-3, band_hz=(0.5, 15.0), rms=2.0, rng=rng)
    noise = draw_noise(BENCH, SAMPLES, rng) if noisy else None
    values = dict(effects)
    return simulate(BENCH, command, dt_s=1e-3, values=values, substeps=8, noise=noise).record


def part(record: Record, columns: tuple[str, ...], every: int) -> Record:
    assert record.time_s is not None
    names = ("command_v", *columns)
    return make_record(
        {
            "time_s": record.time_s[::every],
            **{name: record.column(name)[::every] for name in names},
        }
    )


def findings(record: Record, values: Mapping[str, float] | None = None) -> dict[str, Finding]:
    check = check_rig(record, BENCH.with_values(values or {}))
    return {finding.check: finding for finding in check.findings}


def wrong(found: Mapping[str, Finding]) -> list[str]:
    return [name for name, one in found.items() if one.status is Status.does_not_fit]


@pytest.mark.slow
@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("every", [1, 20])
@pytest.mark.parametrize("columns", [ALL, CHAMBERS, ("position_m",)], ids=len)
def test_nothing_is_said_against_the_right_rig(
    noisy: bool, every: int, columns: tuple[str, ...]
) -> None:
    found = findings(part(run(noisy), columns, every))
    assert wrong(found) == []
    assert found["flow"].status is Status.fits
    assert found["flow"].factor == pytest.approx(1.0, abs=0.06)


WRONG = {
    "stroke": ({"cylinder.stroke_m": 0.16}, "stroke", "cylinder.stroke_m", None),
    "supply": ({"supply.pressure_pa": 16e6}, "supply", "supply.pressure_pa", 0.75),
    "flow": ({"valve.rated_flow_m3_s": 6.33e-4 / 1.5}, "flow", "valve.rated_flow_m3_s", 1.5),
    "bore": ({"cylinder.bore_m": 0.07}, "areas", "cylinder.bore_m", 0.922),
    "mass": ({"load.mass_kg": 240.0}, "mass", "load.mass_kg", 0.5),
}


@pytest.mark.slow
@pytest.mark.parametrize("noisy", [pytest.param(False, marks=pytest.mark.thorough), True])
@pytest.mark.parametrize("columns", [ALL, CHAMBERS], ids=len)
@pytest.mark.parametrize(
    ("name", "every"),
    # The next test says what of the bore can be told at 50 Hz.
    [(name, every) for name in WRONG for every in (1, 20) if (name, every) != ("bore", 20)],
)
def test_the_wrong_value_is_said_and_no_other(
    name: str, columns: tuple[str, ...], every: int, noisy: bool
) -> None:
    values, check, key, factor = WRONG[name]
    found = findings(part(run(noisy), columns, every), values)
    assert wrong(found) == [check]
    assert found[check].value == key
    assert key in found[check].text
    if factor is not None:
        # Sampling and noise change the estimates by a few per cent.
        assert found[check].factor == pytest.approx(factor, rel=0.05)


@pytest.mark.parametrize("noisy", [False, True])
def test_a_wrong_bore_of_a_coarse_record_shows_in_the_flow(noisy: bool) -> None:
    """Samples at 50 Hz of a command of up to 15 Hz: the balances leave a tenth of the motion."""
    found = findings(part(run(noisy), CHAMBERS, 20), {"cylinder.bore_m": 0.07})
    assert wrong(found) == ["flow"]
    assert "both diameters by" in found["flow"].text
    assert found["areas"].status is Status.cannot_be_told
    assert "the sampling follows, and" in found["areas"].text


@pytest.mark.slow
@pytest.mark.parametrize("friction_n", [0.0, 900.0])
def test_areas_are_not_blamed_for_a_fast_command(friction_n: float) -> None:
    """A large cylinder on a valve that is slower than the command, as its rig has it."""
    answers = {
        "bore": "80 mm", "rod": "56 mm", "stroke": "500 mm", "supply": "160 bar",
        "rated-flow": "60 l/min", "mass": "450 kg",
    }  # fmt: skip
    rig = parse_rig(rig_file_text("press", "ehs", answered("ehs", answers)))
    samples = 6000
    command = multisine(samples, 2e-3, band_hz=(0.5, 25.0), peak=3.0, rng=np.random.default_rng(1))
    values = {"effects.coulomb_friction.force_n": friction_n} if friction_n else {}
    record = simulate(rig, command, dt_s=2e-3, values=values).record
    found = {one.check: one for one in check_rig(record, rig).findings}
    assert wrong(found) == []
    assert found["areas"].status is Status.cannot_be_told
    slower = multisine(samples, 2e-3, band_hz=(0.2, 2.0), peak=3.0, rng=np.random.default_rng(1))
    record = simulate(rig, slower, dt_s=2e-3, values=values).record
    found = {one.check: one for one in check_rig(record, rig).findings}
    assert found["areas"].status is Status.fits


@pytest.mark.slow
def test_a_wrong_bore_is_said_with_the_right_one() -> None:
    found = findings(part(run(True), CHAMBERS, 1), {"cylinder.bore_m": 0.07})
    assert "set cylinder.bore_m to 0.063" in found["areas"].text
    first, second = found["areas"].text.split("; or ")
    assert "set cylinder.bore_m" in first
    assert "1.01 times the rated flow" in first or "1 times the rated flow" in first
    assert "cylinder.rod_m" in second
    assert found["flow"].status is Status.cannot_be_told


def test_a_wrong_rated_command_shows_at_the_spool() -> None:
    found = findings(part(run(True), ALL, 1), {"valve.rated_command_v": 15.0})
    assert wrong(found) == ["rated command"]
    assert found["rated command"].factor == pytest.approx(10.0 / 15.0, rel=0.02)
    assert found["flow"].status is Status.cannot_be_told


@pytest.mark.slow
def test_a_slow_valve_in_the_rig_is_said() -> None:
    found = findings(part(run(True), CHAMBERS, 1), {"effects.valve_lag.bandwidth_hz": 15.0})
    assert wrong(found) == ["response"]
    assert "effects.valve_lag.bandwidth_hz" in found["response"].text


@pytest.mark.parametrize("every", [1, 20])
@pytest.mark.parametrize("noisy", [False, True])
def test_a_wrong_sign_is_said_and_nothing_is_made_of_it(noisy: bool, every: int) -> None:
    record = part(run(noisy), CHAMBERS, every)
    turned = make_record(
        {
            "time_s": record.time_s,
            **record.columns,
            "command_v": -record.column("command_v"),
        }
    )
    found = findings(turned)
    assert wrong(found) == ["direction"]
    assert "flow" not in found
    assert "mass" not in found


def test_exchanged_ports_are_said() -> None:
    record = part(run(True), CHAMBERS, 1)
    exchanged = make_record(
        {
            "time_s": record.time_s,
            **record.columns,
            "pressure_a_pa": record.column("pressure_b_pa"),
            "pressure_b_pa": record.column("pressure_a_pa"),
        }
    )
    assert "ports" in wrong(findings(exchanged))


@pytest.mark.parametrize(
    ("channel", "factor", "check", "unit"),
    [
        ("position_m", 1e3, "stroke", "mm"),
        ("pressure_a_pa", 1e-5, "pressures", "bar"),
        ("supply_pressure_pa", 1e-6, "pressures", "MPa"),
    ],
)
def test_while_a_unit_is_in_doubt_nothing_else_is_made_of_it(
    channel: str, factor: float, check: str, unit: str
) -> None:
    record = part(run(True), ALL[:4], 1)
    scaled = {**record.columns, channel: factor * record.column(channel)}
    found = findings(make_record({"time_s": record.time_s, **scaled}))
    assert f"perhaps it is in another unit: --map '{channel}={channel} [{unit}]'" in (
        found[check].text
    )
    assert wrong(found) == [check]
    assert "flow" not in found
    last = found["supply, areas, flow and mass"]
    assert last.text == f"the unit of {channel} must be right first"


@pytest.mark.slow
@pytest.mark.parametrize(
    "effect",
    [
        ("effects.coulomb_friction.force_n", 800.0),
        ("effects.load_force.force_n", 4000.0),
        ("effects.load_spring.stiffness_n_m", 3e4),
        ("effects.valve_dead_band.overlap", 0.03),
        ("effects.valve_null_bias.offset", 0.03),
        ("effects.internal_leakage.coefficient_m3_s_pa", 5e-12),
    ],
    ids=lambda effect: effect[0],
)
def test_effects_of_the_catalogue_are_no_wrong_values(effect: tuple[str, float]) -> None:
    """What the diagnosis looks for is not taken for a wrong number in the rig."""
    assert wrong(findings(part(run(True, (effect,)), CHAMBERS, 1))) == []


def test_without_pressures_what_cannot_be_told_is_said() -> None:
    found = findings(part(run(True), ("position_m",), 1), {"load.mass_kg": 240.0})
    for name in ("supply", "areas", "mass"):
        assert found[name].status is Status.cannot_be_told


def test_a_stop_inside_the_stroke_is_said() -> None:
    record = part(run(False), ("position_m",), 1)
    position = np.minimum(record.column("position_m"), 0.16)
    stopped = make_record(
        {"time_s": record.time_s, "command_v": record.column("command_v"), "position_m": position}
    )
    found = findings(stopped)["stroke"]
    assert found.status is Status.does_not_fit
    assert "a stop" in found.text


def test_an_axis_is_weighed() -> None:
    axis = read_rig(ROOT / "examples" / "rigs" / "axis.toml")
    rng = np.random.default_rng(2)
    command = multisine(SAMPLES, 1e-3, band_hz=(0.5, 15.0), rms=2.0, rng=rng)
    record = simulate(axis, command, dt_s=1e-3).record
    for mass, status in ((95.0, Status.fits), (190.0, Status.does_not_fit)):
        check = check_rig(record, axis.with_values({"axis.mass_kg": mass}))
        found = {one.check: one for one in check.findings}
        assert found["mass"].status is status


def test_signals_of_the_picture_have_one_length() -> None:
    check = check_rig(part(run(True), ALL, 1), BENCH)
    assert check.expected_m_s is not None
    assert check.time_s.shape == check.speed_m_s.shape == check.expected_m_s.shape
    # By right values the speeds agree within a few per cent of the motion.
    rest = np.std(check.expected_m_s - check.speed_m_s)
    assert rest < 0.1 * np.std(check.speed_m_s)


def test_the_document_has_the_words_and_the_picture_of_its_example() -> None:
    check = runpy.run_path(str(ROOT / "docs" / "pictures" / "make.py"))["too_small_flow"]()
    (wrong,) = (one for one in check.findings if one.status is Status.does_not_fit)
    document = " ".join((ROOT / "docs" / "rigs.md").read_text(encoding="utf-8").split())
    assert f"{wrong.check} does not fit {wrong.text}" in document
    assert "(pictures/rig_check.png)" in document


@needs_linux64
@pytest.mark.slow
@pytest.mark.parametrize("columns", [ALL, CHAMBERS, ("position_m",)], ids=len)
@pytest.mark.parametrize("left_out", [(), ("cylinder.stroke_m", "supply.pressure_pa")], ids=len)
def test_a_simulator_of_the_user_is_checked_without_what_it_does_not_tell(
    columns: tuple[str, ...], left_out: tuple[str, ...]
) -> None:
    rig = read_rig(FOLDER / "rig.toml")
    values = {key: value for key, value in rig.values.items() if key not in left_out}
    check = check_rig(part(run(True), columns, 1), replace(rig, values=values))
    found = {one.check: one for one in check.findings}
    assert found["direction"].status is Status.fits
    assert not {"areas", "flow", "mass", "response", "oil spring", "ports"} & set(found)
    assert any("cannot be judged" in note and "entrained air" in note for note in check.notes)


@needs_linux64
@pytest.mark.slow
def test_a_command_beyond_the_rated_one_of_a_simulator_is_found() -> None:
    rig = read_rig(FOLDER / "rig.toml")
    low = rig.with_values({"valve.rated_command_v": 1.0, "cylinder.stroke_m": 0.05})
    check = check_rig(part(run(True), CHAMBERS, 1), low)
    found = {one.check: one for one in check.findings}
    assert {"rated command", "stroke"} <= set(wrong(found))

# SPDX-License-Identifier: MIT
"""The edit test on machines whose true change is known: outcome, what is left, files."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from gap_cases import OFF, PRESSURES, RIG, record
from msgspec.structs import replace as replace_part
from published_schemas import check_file
from typer.testing import CliRunner
from user_simulators import FOLDER, needs_linux64

from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.catalogue.spellings import effect_values
from ehsid.harness.cli import cli
from ehsid.harness.diagnosis.data.gate import stretch
from ehsid.harness.diagnosis.edits import EditTest, Twin, edit_test, parse_edits
from ehsid.harness.diagnosis.edits.testing import ENDS, profile
from ehsid.harness.diagnosis.edits.twin import Comparison
from ehsid.harness.diagnosis.schema import (
    NOT_COMPARED,
    NOWHERE,
    DiagnosisFile,
    Effect,
    Provenance,
    Value,
    Which,
    file_text,
)
from ehsid.harness.diagnosis.user_simulator import engine_of
from ehsid.harness.records import Record, read_record, write_record
from ehsid.harness.rigs import Rig, read_rig, write_rig

BAND, FRICTION = "effects.valve_dead_band.overlap", "effects.coulomb_friction.force_n"
LEAK = "effects.internal_leakage.coefficient_m3_s_pa"
BOTH = {BAND: 0.04, FRICTION: 400.0}


def twin_of(
    effects: Mapping[str, Mapping[str, float]],
    rig: Rig = RIG,
    *,
    own_gap: float = 0.013,
    outputs: tuple[str, ...] = PRESSURES,
) -> Twin:
    """A diagnosis that found the truth, each size within 5 %."""
    named = tuple(
        Effect(name, 0.9, {one: Value(x, (0.95 * x, 1.05 * x)) for one, x in sizes.items()}, 1.0)
        for name, sizes in effects.items()
    )
    which = Which(named, (tuple(effects), ("load_force",)), (), (), None)
    settings = {"window_s": 0.5, "reset": "carry", "outputs": list(outputs)}
    file = DiagnosisFile(
        1,
        "effects",
        NOWHERE,
        which,
        replace_part(NOT_COMPARED, augmented=own_gap),
        {},
        Provenance("", (), settings, 1.0),
    )
    found = {
        key: x for name, sizes in effects.items() for key, x in effect_values(name, sizes).items()
    }
    return Twin("before", rig.with_values(found), file)


TWIN = twin_of(
    {"valve_dead_band": {"overlap": 0.04}, "coulomb_friction": {"force_n": 400.0}},
    RIG.with_values(OFF),
)


def after(values: Mapping[str, float]) -> Record:
    """A record of the machine with these effects in place of those before."""
    return record({**OFF, **values}, 7)


@cache
def without_band() -> Record:
    return after({FRICTION: 400.0})


def result_of(values: Mapping[str, float], *asked: str) -> EditTest:
    return edit_test(TWIN, [after(values)], parse_edits(asked, TWIN))[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("values", "outcome", "told", "share", "says"),
    [
        ({FRICTION: 400.0}, "it_was", ("valve_dead_band",), 0.0, "without it the twin leaves"),
        ({BAND: 0.02, FRICTION: 400.0}, "it_was", ("valve_dead_band",), 0.5, "it is left"),
        ({BAND: 0.04}, "it_was", ("coulomb_friction",), 0.0, "It was the Coulomb friction"),
        ({}, "it_was", ("valve_dead_band", "coulomb_friction"), 0.0, "without them the twin"),
        (BOTH, "not_it", None, 1.0, "and not the Coulomb friction: the record after"),
        ({**BOTH, LEAK: 2e-11}, "another_change", None, None, "of another kind: no edit of what"),
    ],
)
def test_a_change_is_told(
    values: dict[str, float], outcome: str, told: Any, share: float | None, says: str
) -> None:
    found = result_of(values)
    assert found.outcome == outcome
    assert says in found.sentence
    assert any("could not tell" in note for note in found.notes)
    if told is None:
        assert share is None or all(one.left.low <= 1.0 <= one.left.high for one in found.edits)
        return
    edit = found.edits[found.told]
    assert edit.effects == told
    assert edit.left.low <= share <= edit.left.high < edit.left.low + 0.15
    assert edit.gap_at_left < 1.5 * found.noise_floor
    assert edit.agrees == (share == 0.0)


@pytest.mark.slow
def test_half_of_it_agrees_where_half_was_asked_for() -> None:
    found = result_of({BAND: 0.02, FRICTION: 400.0}, "valve_dead_band=0.5")
    assert (found.edits[0].share, found.edits[0].agrees) == ((0.5,), True)


@pytest.mark.slow
def test_a_record_that_does_not_show_the_effect_tells_nothing() -> None:
    """A limit of the opening that no command reaches."""
    twin = twin_of({"valve_flow_saturation": {"limit": 0.9}}, RIG.with_values(OFF))
    for values in ({}, {"effects.valve_flow_saturation.limit": 0.9}):
        slow = stretch(record({**OFF, **values}, 3, seconds=6.0), slice(1500, 3000))
        found, _ = edit_test(twin, [slow], parse_edits((), twin))
        assert found.outcome == "cannot_tell"
        assert "command never above" in found.sentence


@pytest.mark.slow
def test_the_share_is_that_of_a_brute_scan() -> None:
    comparison = Comparison(TWIN, [after({BAND: 0.02, FRICTION: 400.0})])

    def nats(share: float) -> float:
        return comparison.simulate({"valve_dead_band": share}).nats

    left, span = profile(nats)
    shares = np.arange(0.4, 0.6, 0.004)
    costs = np.array([nats(share) for share in shares])
    inside = shares[costs <= costs.min() + ENDS]
    assert left.value == pytest.approx(shares[np.argmin(costs)], abs=0.005)
    assert (left.low, left.high) == pytest.approx((inside[0], inside[-1]), abs=0.006)
    scanned = [nats(share) for share in np.arange(0.0, 1.05, 0.1)]
    assert span == pytest.approx(max(scanned) - min(scanned))


@pytest.mark.parametrize("middle", [0.0, 0.31, 1.99])
def test_the_interval_of_a_parabola_is_that_of_a_normal_distribution(middle: float) -> None:
    left, _ = profile(lambda share: 0.5 * ((share - middle) / 0.1) ** 2)
    ends = max(middle - 0.16449, 0.0), min(middle + 0.16449, 2.0)
    assert (left.value, left.low, left.high) == pytest.approx((middle, *ends), abs=3e-3)
    left, span = profile(lambda share: 1.0)
    assert (left.low, left.high, span) == (0.0, 2.0, 0.0)
    left, _ = profile(lambda share: np.inf if share > 1.0 else share)
    assert (left.low, left.high) == (0.0, 1.0)


def test_half_of_an_effect_has_half_of_its_outputs() -> None:
    sizes = {name: {p.name: p.typical for p in info.parameters} for name, info in effects().items()}
    for name, info in effects().items():
        twin = twin_of({name: sizes[name]})
        values = twin.sizes({name: 0.8})
        for parameter in info.parameters:
            made = values[f"effects.{name}.{parameter.name}"]
            error = sizes[name][parameter.name] - parameter.neutral
            expected = parameter.neutral + error * 0.8**parameter.power
            assert made == pytest.approx(expected)
        assert set(twin.sizes({name: 0.0}).values()) == {0.0}
    lag = twin_of({"valve_lag": {"bandwidth_hz": 30.0, "damping": 0.8}})
    assert set(lag.sizes({"valve_lag": 0.01}).values()) == {0.0}  # faster than any valve


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A diagnosis and a record after the dead band was taken away."""
    (tmp_path / "before").mkdir()
    write_rig(TWIN.rig, tmp_path / "before" / "rig.augmented.toml")
    (tmp_path / "before" / "diagnosis.json").write_text(file_text(TWIN.file))
    write_record(without_band(), tmp_path / "after.csv")
    return tmp_path


def run(*words: str | Path) -> tuple[int, str]:
    outcome = CliRunner().invoke(cli, ["gap-edit", *map(str, words)], env={"COLUMNS": "200"})
    return outcome.exit_code, " ".join(outcome.output.split())


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_the_gaps_of_the_files_are_those_of_numpy(folder: Path) -> None:
    code, shown = run(folder / "before", folder / "after.csv", "--out", folder / "out")
    assert code == 0, shown
    check_file(folder / "out" / "edit.json")
    told = json.loads((folder / "out" / "edit.json").read_text("utf-8"))
    assert told["sentence"] in shown
    assert told["sentence"].split(":")[0] in (folder / "out" / "edit.html").read_text("utf-8")
    table = pl.read_csv(folder / "out" / "simulation.csv")
    window = table["window"].to_numpy()

    def nrmse(name: str, kind: str) -> float:
        measured, simulated = (table[f"{name}_{one}"].to_numpy() for one in ("measured", kind))
        means = np.bincount(window, measured) / np.bincount(window)
        spread = measured - means[window]
        return float(np.sqrt(np.mean((simulated - measured) ** 2) / np.mean(spread**2)))

    edit = told["edits"][told["told"]]
    for kind, gap, by_output in (
        ("found", told["found"], told["found_per_output"]),
        ("edited", edit["gap"], edit["per_output"]),
        ("left", edit["gap_at_left"], None),
    ):
        computed = {name: nrmse(name, kind) for name in PRESSURES}
        assert np.mean(list(computed.values())) == pytest.approx(gap, rel=1e-5)
        assert by_output is None or by_output == pytest.approx(computed, rel=1e-5)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["{0}", "{0}/after.csv"], "has no diagnosis.json: expected the folder of `ehsid gap"),
        (["{0}/before", "{0}/none.csv"], "none.csv"),
        (
            ["{0}/before", "{0}/after.csv", "--effect", "valve_deadband"],
            "'valve_deadband': {0}/before does not name it: expected one of valve_dead_band, "
            "coulomb_friction; did you mean 'valve_dead_band'?",
        ),
        (["{0}/before", "{0}/after.csv", "--effect", "coulomb_friction=half"], "write coulomb_"),
        (["{0}/before", "{0}/after.csv", "--effect", "coulomb_friction=-1"], "expected the share"),
    ],
)
def test_what_cannot_be_used_is_told(words: list[str], message: str, folder: Path) -> None:
    code, shown = run(*(word.format(folder) for word in words), "--out", folder / "out")
    assert code == 2
    assert message.format(folder) in shown
    assert not (folder / "out").exists()


def test_a_diagnosis_that_names_nothing_and_a_record_at_rest_are_told() -> None:
    file = replace_part(TWIN.file, verdict="no_gap", which=Which((), (), (), (), None))
    with pytest.raises(ValueError, match="the verdict is no_gap, and no effect is named"):
        Twin("before", RIG, file)
    moving = after(BOTH)
    still = replace(moving, columns={**moving.columns, "position_m": np.full(len(moving), 0.1)})
    with pytest.raises(ValueError, match="position_m is constant"):
        edit_test(TWIN, [still], parse_edits((), TWIN))


@pytest.mark.slow
@needs_linux64
def test_friction_at_the_port_of_an_fmu_still_acts() -> None:
    """The record has all of the 800 N that the twin has."""
    rig = read_rig(FOLDER / "rig.toml")
    twin = twin_of({"coulomb_friction": {"force_n": 800.0}}, rig, own_gap=0.05)
    with engine_of(rig) as engine:
        found, _ = edit_test(
            twin, [read_record(FOLDER / "coulomb.csv")], parse_edits((), twin), engine=engine
        )
    assert found.outcome == "not_it"
    assert found.edits[0].left.low <= 1.0 <= found.edits[0].left.high
    assert found.edits[0].gap > 1.5 * found.found

# SPDX-License-Identifier: MIT
"""Blind cases: rig and records do not depend on the effect except through the machine."""

import ast
import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from reality_runs import drawn_case
from sources import HARNESS, PYTHON, imported
from typer.testing import CliRunner

import ehsid
from ehsid.harness.records import read_record
from ehsid.harness.rigs import parse_rig, read_rig
from ehsid.lab.reality import machine as equations
from ehsid.lab.reality import make_case, write_case
from ehsid.lab.reality.__main__ import app
from ehsid.lab.reality.batch import draw_kind, write_cases
from ehsid.lab.reality.case import COLUMNS, KINDS, start_state
from ehsid.lab.reality.effects import ADDED_EFFECTS, CATALOGUE, EXCLUSIVE_PAIRS, sized
from ehsid.lab.reality.nominal_rig import UNCERTAINTY
from ehsid.lab.reality.unnamed import OUTSIDE
from ehsid.lab.reality.variants import GRADES

SHORT: dict[str, Any] = {"seconds": 1.0}


def test_the_parallel_runs_import_no_other_module_of_ehsid() -> None:
    """The package `reality` imports them, but no other module that computes: see test_walls."""
    parallel = imported(HARNESS / "base" / "parallel.py")
    assert not [name for name in parallel if name.startswith("ehsid")]


def test_compiled_functions_are_in_a_single_file() -> None:
    """The cache of numba does not detect changes in other files."""
    users = [
        path.name
        for path in sorted((PYTHON / "lab" / "reality").glob("*.py"))
        if any(
            isinstance(node, ast.FunctionDef)
            and any(
                isinstance(decorator, ast.Name) and decorator.id == "compiled"
                for decorator in node.decorator_list
            )
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        )
    ]
    assert users == ["machine.py"]


# Effects that the generator does not put into its machines.
NOT_MADE = {"spool_stiction", "line_resonance"}


@pytest.mark.slow
def test_the_catalogue_is_that_of_the_diagnosis() -> None:
    catalogue = {
        effect.id: {parameter.name.rsplit(".", 1)[-1] for parameter in effect.parameters}
        for effect in ehsid.effects()
    }
    drawn = {
        name: set(drawn_case(1, "plain", "one", [name]).answer["effects"][name])
        for name in {**CATALOGUE, **ADDED_EFFECTS}
    }
    assert drawn == {name: catalogue[name] for name in catalogue.keys() - NOT_MADE}
    for effect in ehsid.effects():
        assert (
            sized(dict.fromkeys(catalogue[effect.id], 3.0), 0.5)
            == {
                one.name: one.neutral + (3.0 - one.neutral) * 0.5**one.power
                for one in effect.parameters
            }
            or effect.id in NOT_MADE
        )
    subsystems = {effect.id: effect.subsystem for effect in ehsid.effects()}
    for name, effect in {**CATALOGUE, **ADDED_EFFECTS}.items():
        assert effect.subsystem == subsystems[name]
    assert not set(OUTSIDE) & set(catalogue)


@pytest.mark.slow
@pytest.mark.parametrize("grade", ["hard", pytest.param("wide", marks=pytest.mark.thorough)])
def test_the_same_arguments_make_the_same_case(grade: Any) -> None:
    first, second = (make_case(7, grade, "two", **SHORT) for _ in range(2))
    assert first.rig_toml == second.rig_toml
    assert first.answer == second.answer
    for name, column in first.train.items():
        np.testing.assert_array_equal(column, second.train[name])
    assert make_case(8, grade, "two", **SHORT).rig_toml != first.rig_toml


def arguments_of_runs(**options: Any) -> tuple[str, str, list[Any]]:
    """Name, text of the rig, and arguments of `run` other than the machine and its start."""
    run_arguments: list[Any] = []

    def spy(*arguments: Any) -> Any:
        run_arguments.append(arguments[2:])
        samples = arguments[3].size
        return np.zeros(samples), np.zeros((samples, 6))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(equations, "run", spy)
        case = make_case(21, **options, **SHORT)
    return case.name, case.rig_toml, run_arguments


@pytest.fixture(scope="module")
def without_effect() -> dict[str, tuple[str, str, list[Any]]]:
    """By grade: of wide machines the laws of friction, hysteresis, laps and supply are drawn."""
    return {grade: arguments_of_runs(grade=grade, kind="none") for grade in ("plain", "wide")}


@pytest.mark.slow
@pytest.mark.parametrize(
    "options",
    [{"effects": [name]} for name in CATALOGUE if name != "valve_lag"]
    + [{"kind": kind} for kind in KINDS if kind != "open"]
    + [{"kind": "open", "effects": [name]} for name in ("valve_stiction", "warming_oil")]
    + [
        {"grade": "wide", "effects": [name]}
        for name in ("valve_hysteresis", "valve_dead_band", "supply_droop", "coulomb_friction")
    ],
)
def test_only_the_machine_depends_on_the_effect(
    options: dict[str, Any], without_effect: dict[str, tuple[str, str, list[Any]]]
) -> None:
    name, rig, runs = without_effect[options.get("grade", "plain")]
    other_name, other_rig, other_runs = arguments_of_runs(**options)
    assert other_name == name
    assert other_rig == rig
    for arguments, other_arguments in zip(runs, other_runs, strict=True):
        for argument, other_argument in zip(arguments, other_arguments, strict=True):
            np.testing.assert_array_equal(argument, other_argument)


@pytest.mark.slow
@pytest.mark.parametrize("plant", ["ehs", "axis"])
@pytest.mark.parametrize("seed", range(5))
def test_true_values_lie_where_the_kind_says(seed: int, plant: str) -> None:
    sigmas = UNCERTAINTY[plant]  # type: ignore[index]
    for kind, low, high in (("none", 0.0, 0.0), ("one", 0.0, 2.0), ("params", 2.0, 3.0)):
        case = drawn_case(seed, "plain", kind, plant=plant)  # type: ignore[arg-type]
        true_values, nominal_values = case.answer["true"], case.answer["told"]
        rig = parse_rig(case.rig_toml)
        assert {name: rig.values[name] for name in nominal_values} == nominal_values
        deviations = {
            name: abs(true_values[name] / nominal_values[name] - 1.0) / rig.sigma(name)
            for name in sigmas
        }
        assert low - 1e-9 <= max(deviations.values()) <= high + 1e-9
        assert {name: rig.sigma(name) for name in sigmas} == dict(sigmas)


@pytest.mark.slow
@given(seed=st.integers(0, 10**6), grade=st.sampled_from(GRADES), kind=st.sampled_from(KINDS))
@settings(max_examples=settings.default.max_examples // 5)
def test_any_case_stays_inside_the_machine(seed: int, grade: Any, kind: Any) -> None:
    case = make_case(seed, grade, kind, sensors="pressures+supply+spool", seconds=2.0)
    rig = parse_rig(case.rig_toml)
    for record in (case.train, case.validate):
        assert all(np.all(np.isfinite(column)) for column in record.values())
        assert all(column.shape == (2000,) for column in record.values())
        stroke = rig.values["cylinder.stroke_m"]
        assert 0.0 < record["position_m"].min() <= record["position_m"].max() < stroke
        assert np.abs(record["command_v"]).max() <= rig.values["valve.rated_command_v"]
        for side in ("a", "b"):
            # A pressure is above zero, except for noise of 1.6e-3 of the supply pressure: 6 sigma.
            least = -0.01 * rig.values["supply.pressure_pa"]
            assert record[f"pressure_{side}_pa"].min() > least


@pytest.mark.slow
def test_kinds_have_their_number_of_effects() -> None:
    for kind, count in zip(KINDS, (1, 2, 0, 0, 1), strict=True):
        for seed in range(4):
            effects = drawn_case(seed, "plain", kind).answer["effects"]
            assert len(effects) == count
            assert frozenset(effects) not in EXCLUSIVE_PAIRS
            assert set(effects) <= set(OUTSIDE if kind == "open" else CATALOGUE)


def test_unknown_effects_and_wrong_numbers_are_refused() -> None:
    with pytest.raises(ValueError, match="'dead_band' is not known; there are valve_dead_band"):
        make_case(1, effects=["dead_band"], **SHORT)
    with pytest.raises(ValueError, match="kind 'two' has 2 effects, 1 are given"):
        make_case(1, kind="two", effects=["load_force"], **SHORT)


def test_given_sizes_are_used() -> None:
    case = make_case(3, effects={"valve_null_bias": {"offset": 0.0123}}, **SHORT)
    assert case.answer["effects"] == {"valve_null_bias": {"offset": 0.0123}}
    assert case.truth.null_bias == 0.0123


# From day to day two effects and one seed; all effects and two seeds in --all.
EVERY_DAY = ("coulomb_friction", "transport_delay")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("effect", "seeds"),
    [(effect, 1) for effect in EVERY_DAY]
    + [pytest.param(effect, 2, marks=pytest.mark.thorough) for effect in (*CATALOGUE, *OUTSIDE)],
)
def test_each_effect_stands_out_of_the_noise(effect: str, seeds: int) -> None:
    """The record differs by more than noise from a run without the effect on the same command."""
    options: dict[str, Any] = {"seconds": 3.0, "sensors": "pressures"}
    kind = "one" if effect in CATALOGUE else "open"
    excitation = ("prbs", "steps")
    ratios = []
    for seed in range(seeds):
        case = make_case(seed, "plain", kind, [effect], excitation=excitation, **options)  # type: ignore[arg-type]
        nominal_values, record = case.answer["told"], case.validate
        n = record["time_s"].size
        zeros = np.zeros(n)
        commands = record["command_v"] / nominal_values["valve.rated_command_v"]
        start = start_state(case.healthy, float(record["position_m"][0]))
        _, out = equations.run(
            case.healthy._replace(sensor_step_m=1e-9),
            *(start, 1e-3, commands, zeros, 0.0, 1e-9, zeros, zeros),
            *(np.zeros(n, dtype=np.bool_), 1),
        )
        windows = np.arange(500, n) // 500
        noise = {
            "position_m": 2e-5 * nominal_values["cylinder.stroke_m"],
            "pressure_a_pa": 1e-3 * nominal_values["supply.pressure_pa"],
        }
        for name, column in (
            ("position_m", equations.OUT_Y),
            ("pressure_a_pa", equations.OUT_P_A),
        ):
            error = (record[name] - out[:, column])[500:]
            if name == "position_m":
                means = np.bincount(windows, error) / np.maximum(np.bincount(windows), 1)
                error = error - means[windows]
            ratios.append(float(np.sqrt(np.mean(error**2))) / noise[name])
    assert max(ratios) > 3.0
    assert float(np.median(ratios)) > 2.0


def test_files_are_read_and_hold_no_answer(tmp_path: Path) -> None:
    case = make_case(4, "plain", "one", ["load_force"], sensors="pressures+supply+spool", **SHORT)
    write_case(case, tmp_path / case.name)
    names = sorted(path.name for path in (tmp_path / case.name).iterdir())
    assert names == ["rig.toml", "train.csv", "validate.csv"]
    rig = read_rig(tmp_path / case.name / "rig.toml")
    record = read_record(tmp_path / case.name / "train.csv", layout=rig.columns)
    np.testing.assert_allclose(record.time_s, case.train["time_s"], atol=1e-6)
    for name in list(case.train)[1:]:
        column = case.train[name]
        # The tolerance is half of the last digit in the file.
        digit = {"command_v": 1e-5, "position_m": 1e-7, "spool": 1e-5}.get(name, 1.0)
        np.testing.assert_allclose(record.column(name), column, atol=0.51 * digit, rtol=0.0)
    text = "".join(path.read_text(encoding="utf-8") for path in (tmp_path / case.name).iterdir())
    assert "load_force" not in text
    assert f"{case.answer['effects']['load_force']['force_n']:.6g}" not in text


@pytest.mark.thorough
@pytest.mark.usefixtures("two_processes")
def test_a_batch_writes_answers_to_a_separate_file(tmp_path: Path) -> None:
    write_cases(tmp_path / "cases", tmp_path / "answers.json", [1, 2], seconds=1.0)
    answers = json.loads((tmp_path / "answers.json").read_text(encoding="utf-8"))
    assert sorted(answers) == sorted(path.name for path in (tmp_path / "cases").iterdir())
    seeds = sorted(answer["seed"] for answer in answers.values())
    assert seeds == [1, 2]
    for name, answer in answers.items():
        case = make_case(
            answer["seed"], "plain", answer["kind"], sensors=answer["sensors"], seconds=1.0
        )
        assert case.name == name
        assert case.answer["effects"] == answer["effects"]
    with pytest.raises(ValueError, match="must not lie among the cases"):
        write_cases(tmp_path / "cases", tmp_path / "cases" / "x" / "answers.json", [1])


def test_mix_has_all_kinds_half_of_them_with_one_effect() -> None:
    kinds = [draw_kind(seed, "plain") for seed in range(2000)]
    # The standard error of a share of 0.5 of 2000 draws is 0.011; the tolerance is four of them.
    assert kinds.count("one") / 2000 == pytest.approx(0.5, abs=0.045)
    assert set(kinds) == set(KINDS)


@pytest.mark.parametrize("wrong", [["--grade", "soft"], ["--kind", "three"], ["--count", "0"]])
def test_wrong_use_ends_with_two_and_no_file(wrong: list[str], tmp_path: Path) -> None:
    arguments = ["--out", str(tmp_path / "c"), "--answers", str(tmp_path / "a.json"), *wrong]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 2
    assert wrong[0] in result.output
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_command_writes_cases(tmp_path: Path) -> None:
    arguments = ["--out", str(tmp_path / "c"), "--answers", str(tmp_path / "a.json")]
    result = CliRunner().invoke(app, [*arguments, "--count", "1", "--plant", "axis"])
    assert result.exit_code == 0, result.output
    (answer,) = json.loads((tmp_path / "a.json").read_text(encoding="utf-8")).values()
    assert answer["plant"] == "axis"
    assert len(list((tmp_path / "c").glob("*/rig.toml"))) == 1


@pytest.mark.slow
def test_columns_follow_the_sensors() -> None:
    for sensors, columns in COLUMNS.items():
        record = drawn_case(2, sensors=sensors).train
        assert tuple(record) == ("time_s", "command_v", "position_m", *columns)


@pytest.mark.slow
def test_sampling_period_is_free() -> None:
    fast = make_case(9, "plain", "none", dt_s=1e-4, seconds=0.1).train
    slow = make_case(9, "plain", "none", dt_s=0.02, seconds=1.0).train
    assert fast["time_s"].size == 1000
    assert slow["time_s"].size == 50
    assert math.isclose(float(slow["time_s"][-1]), 0.98)
    assert np.ptp(fast["position_m"]) > 0.0
    assert "numba" in sys.modules


@pytest.mark.thorough
def test_a_stiff_machine_gets_smaller_steps() -> None:
    """With the usual integration steps this machine diverged."""
    case = make_case(
        200162, "plain", "two", ["coulomb_friction", "sensor_lag"], "pressures", seconds=4.0
    )
    for record in (case.train, case.validate, case.transfer):
        assert all(np.isfinite(column).all() for column in record.values())

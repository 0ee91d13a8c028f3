# SPDX-License-Identifier: MIT
"""Machines from the folders of checks and from files of features, and what is refused."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from made_checks import diagnosis, made_answers, write_check
from made_machines import EFFECTS, drawn_machines, machine

from ehsid.lab.blind.making import Answer, Settings, write_seal
from ehsid.lab.calibration.fitting import read_features, write_features
from ehsid.lab.calibration.machines import Machine, distinct, read_case, read_checks

DELAY = {"delay_s": 5e-3}


def candidate(effects: list[str], left: float | None, small: float = 0.0) -> dict[str, Any]:
    """An entry of `which.candidates`; without `left` the decision did not weigh it."""
    return {
        "effects": effects,
        "score": 0.0,
        "held_out_shrinkage": 0.0,
        "left": left,
        "small": small,
        "price": 2.0 * small,
        "probability": None if left is None else 0.5,
    }


def weighed(answer: dict[str, Any], _: np.random.Generator) -> dict[str, Any]:
    """A diagnosis that weighs nothing, a delay and friction, and names a true delay."""
    named = {name: sizes for name, sizes in answer["effects"].items() if name == "transport_delay"}
    return diagnosis(
        "effects" if named else "no_gap",
        named,
        candidates=[
            candidate([], 1.0),
            candidate(["transport_delay"], 0.123456789, 0.25),
            candidate(["coulomb_friction"], 0.5),
            candidate(["transport_delay", "sensor_lag"], None),
        ],
    )


def answer(kind: str, **effects: dict[str, float]) -> dict[str, Any]:
    return {
        "kind": kind,
        "grade": "wide",
        "plant": "ehs",
        "sensors": "pressures",
        "excitation": ["steps", "prbs"],
        "effects": effects,
        "subsystem": [],
        "families": {"seals": "Dahl"},
    }


ANSWERS = {
    "a": answer("one", transport_delay=DELAY),
    "b": answer("one", stribeck_friction={}),
    "c": answer("two", transport_delay=DELAY, sensor_quantisation={}),
    "d": answer("one", sensor_quantisation={}),
    "e": answer("one", sensor_lag={}),
    "f": answer("open", transport_delay=DELAY),
    "g": answer("none"),
}
TRUE_SETS = {
    "a": (False, True, False),
    "b": (False, False, True),  # the other law of friction
    "c": (False, True, False),  # the record decides on quantisation
    "d": (True, False, False),
    "e": (False, False, False),  # the truth was not weighed
    "f": (False, False, False),
    "g": (True, False, False),
}


@pytest.fixture
def check(tmp_path: Path) -> Path:
    out = write_check(tmp_path / "check", ANSWERS, weighed)
    write_seal(out, Settings(count=len(ANSWERS)))
    return out


def test_the_truth_is_that_of_the_rules_of_scoring(check: Path) -> None:
    found = read_checks([check])
    assert {one.name: one.true_sets for one in found.machines} == TRUE_SETS
    assert [one.name for one in found.machines if one.outside] == ["e", "f"]
    assert found.left_out == {}


def test_a_machine_has_what_the_diagnosis_weighed(check: Path) -> None:
    one = read_case(check, "a", Answer(**ANSWERS["a"]))
    assert isinstance(one, Machine)
    assert [each.effects for each in one.sets] == [(), ("transport_delay",), ("coulomb_friction",)]
    assert (one.sets[1].left, one.sets[1].small, one.sets[1].price) == (0.12346, 0.25, 0.5)
    assert (one.left_by_none, one.pressures) == (1.0, True)
    assert one.traits == {"grade": "wide", "excitation": "prbs+steps", "seals": "Dahl"}
    (size,) = one.sizes
    assert size.effect == "transport_delay"
    assert size.estimate.low <= size.true <= size.estimate.high


def test_a_spring_is_right_where_the_truth_is_a_force_but_not_the_reverse() -> None:
    laws = ("load_force",), ("load_spring",)
    assert machine(("load_force",), *laws).true_sets == (False, True, True)
    assert machine(("load_spring",), *laws).true_sets == (False, False, True)


def test_cases_that_say_nothing_are_counted_by_reason(tmp_path: Path) -> None:
    made = iter([diagnosis("insufficient_data"), diagnosis("no_gap"), *[None] * 5])
    out = write_check(tmp_path / "check", ANSWERS, lambda one, rng: next(made) or weighed(one, rng))
    (out / "results" / "c" / "diagnosis.json").unlink()
    (out / "results" / "d" / "diagnosis.json").rename(out / "results" / "d" / "error.txt")
    write_seal(out, Settings())
    found = read_checks([out])
    assert [one.name for one in found.machines] == ["e", "f", "g"]
    assert found.left_out == {
        "insufficient_data": 1,
        "without probabilities": 1,
        "not finished": 1,
        "failed": 1,
    }


def test_answers_that_were_changed_are_refused(check: Path) -> None:
    path = check / "answers.json"
    path.write_text(path.read_text().replace("transport_delay", "lag"))
    with pytest.raises(ValueError, match=r"answers.json: differs from the digest in seal.json"):
        read_checks([check])


def test_a_folder_that_is_no_check_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"seal.json: there is no such file.*name a folder"):
        read_checks([tmp_path])


def test_a_machine_that_is_given_twice_is_refused() -> None:
    with pytest.raises(ValueError, match="machine m: given twice; expected each machine once"):
        distinct([machine(()), machine(("transport_delay",))])


def test_features_are_read_as_they_were_written(check: Path, tmp_path: Path) -> None:
    path = tmp_path / "features.jsonl"
    machines = [*read_checks([check]).machines, *drawn_machines(20, 1)]
    write_features(path, reversed(machines))
    assert read_features(path) == sorted(machines, key=lambda one: one.name)
    # A set of a generated machine is below a hundred bytes, and a machine has about ten.
    assert path.stat().st_size < 1500 * len(machines)


@given(st.text(min_size=1), st.floats(0.0, 1e300))
def test_features_keep_any_name_and_number(name: str, left: float) -> None:
    one = replace(
        machine(("transport_delay",), ("transport_delay",), name=name), families={name: name}
    )
    one = replace(one, sets=(one.sets[0], replace(one.sets[1], left=left)))
    with tempfile.TemporaryDirectory() as folder:
        write_features(Path(folder) / "features.jsonl", [one])
        assert read_features(Path(folder) / "features.jsonl") == [one]


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("{", "Input data was truncated"),
        ('{"name": 3}', r"Expected `str`, got `int` - at `\$.name`"),
        ('{"name": "a"}', "missing required field"),
        (None, "left -1, small 0: expected finite, >= 0"),
        ("no effect", "'lag' is no effect of the catalogue"),
        ("no set", "the set without effects is missing"),
        ("no sensors", "measured: 'smell', expected one of pressures, position only"),
        ('"\xff"', "Expected `object`"),
    ],
)
def test_a_line_that_is_no_machine_is_named(line: str | None, told: str, tmp_path: Path) -> None:
    path = tmp_path / "features.jsonl"
    write_features(path, drawn_machines(2, 1))
    good = path.read_text().splitlines()[0]
    left = good.split('"left":')[1].split(",")[0]
    wrong = {
        None: good.replace(left, "-1", 1),
        "no effect": good.replace(f'"{EFFECTS[0]}"', '"lag"'),
        "no set": good.replace('"effects":[]', '"effects":["transport_delay"]'),
        "no sensors": good.replace(machine_sensors(good), "smell"),
    }
    path.write_text(f"{good}\n\n{wrong.get(line, line)}\n")
    with pytest.raises(ValueError, match=rf"features.jsonl: line 3: not a machine.*{told}"):
        read_features(path)


def machine_sensors(line: str) -> str:
    return "pressures" if '"pressures"' in line else "position only"


def test_answers_of_every_kind_are_read(tmp_path: Path) -> None:
    made = made_answers(40)
    out = write_check(tmp_path / "check", made, weighed)
    write_seal(out, Settings())
    assert len(read_checks([out]).machines) == len(made)

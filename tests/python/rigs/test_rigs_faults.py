# SPDX-License-Identifier: MIT
"""Every single fault in a rig file is refused, and the message names the key.

bad_input/rigs.py has the files of a user who went wrong, with their whole messages.
"""

from __future__ import annotations

import copy
import pickle
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT

import ehsid
from ehsid.harness.rigs import Rig, RigError, parse_rig, read_rig, rig_text, write_rig

RIGS = ROOT / "examples" / "rigs"
PARAMETERS = {p.name: p for p in ehsid.plant_parameters()}
EFFECTS = {effect.id: effect for effect in ehsid.effects()}

FULL = tomllib.loads((RIGS / "bench.toml").read_text(encoding="utf-8"))
FULL["effects"] |= {
    effect.id: {p.name: p.typical for p in effect.parameters} for effect in EFFECTS.values()
}
FULL["nuisance"] = {"flow_exponent": 0.52, "presliding_m": 3e-5}
FULL["columns"] = {"position_m": {"name": "Stroke", "unit": "mm"}}
AXIS = tomllib.loads((RIGS / "axis.toml").read_text(encoding="utf-8"))
AXIS["uncertainty"] = {"axis.mass_kg": 0.1}

Keys = tuple[str, ...]


def leaves(table: dict[str, Any], parents: Keys = ()) -> list[Keys]:
    paths: list[Keys] = []
    for key, value in table.items():
        path = (*parents, key)
        paths += leaves(value, path) if isinstance(value, dict) else [path]
    return paths


def changed(document: dict[str, Any], keys: Keys) -> tuple[dict[str, Any], dict[str, Any]]:
    """A copy of the document, and the table in it that has the last key."""
    whole = copy.deepcopy(document)
    table = whole
    for key in keys[:-1]:
        table = table[key]
    return whole, table


def refused(document: dict[str, Any]) -> RigError:
    with pytest.raises(RigError) as caught:
        parse_rig(tomli_w.dumps(document), source="my.toml")
    message = str(caught.value)
    assert message.startswith("my.toml: ")
    # Each problem has its own line; several problems stand below the name of the file.
    any_number = len(caught.value.problems) > 1
    assert len(message.splitlines()) == len(caught.value.problems) + any_number
    return caught.value


LEAVES = [(FULL, keys) for keys in leaves(FULL)] + [(AXIS, keys) for keys in leaves(AXIS)]
NUMBERS = [(d, k) for d, k in LEAVES if k[-1] not in ("name", "plant", "unit")]
MACHINE = [(d, k) for d, k in NUMBERS if ".".join(k) in PARAMETERS]
NEEDED = [(d, k) for d, k in MACHINE if k[0] not in ("effects", "nuisance")] + [(FULL, ("plant",))]


def test_the_sound_documents_are_read() -> None:
    full, axis = parse_rig(tomli_w.dumps(FULL)), parse_rig(tomli_w.dumps(AXIS))
    # An effect is on even if one of its parameters is zero at its typical size.
    assert set(full.effects()) == set(EFFECTS)
    assert axis.plant == "axis"
    assert full.columns["position_m"].unit == "mm"


@given(place=st.sampled_from(NEEDED))
def test_a_missing_key_is_named(place: tuple[dict[str, Any], Keys]) -> None:
    document, keys = place
    whole, table = changed(document, keys)
    del table[keys[-1]]
    problems = refused(whole).problems
    assert any(f"'{'.'.join(keys)}' is missing" in problem for problem in problems)


@given(place=st.sampled_from(LEAVES), data=st.data())
def test_a_misspelt_key_is_named_with_the_right_one(
    place: tuple[dict[str, Any], Keys], data: st.DataObject
) -> None:
    document, keys = place
    right = keys[-1]
    at = data.draw(st.integers(0, len(right) - 1))
    wrong = right[:at] + data.draw(st.sampled_from(["", "x", "xx"])) + right[at + 1 :]
    whole, table = changed(document, keys)
    if wrong in table or wrong == right:
        return
    table[wrong] = table.pop(right)
    problems = refused(whole).problems
    assert any(wrong in problem and "not known" in problem for problem in problems) or (
        right == "name" and keys[0] == "columns"  # the message shows the whole entry instead
    )
    if len(right) > 4:  # a misspelt short name is not similar enough
        similar_key = re.sub("_(a|b)(?=_|$)", lambda side: {"a": "_b", "b": "_a"}[side[1]], right)
        assert any(right in problem or similar_key in problem for problem in problems)


@given(
    place=st.sampled_from(NUMBERS),
    wrong=st.sampled_from([True, "12", [1.0], {"a": 1.0}, 10**400, float("nan"), float("inf")]),
)
def test_what_is_no_number_is_named(place: tuple[dict[str, Any], Keys], wrong: object) -> None:
    document, keys = place
    whole, table = changed(document, keys)
    table[keys[-1]] = wrong
    assert keys[-1] in str(refused(whole))


@given(place=st.sampled_from(NUMBERS), side=st.sampled_from([-1.0, 1.0]))
def test_an_implausible_number_is_named_with_its_range(
    place: tuple[dict[str, Any], Keys], side: float
) -> None:
    document, keys = place
    name = ".".join(keys)
    whole, table = changed(document, keys)
    if keys[0] in ("uncertainty", "sensors"):
        table[keys[-1]] = -1.0
        assert keys[-1] in str(refused(whole))
        return
    parameter = PARAMETERS[name]
    span = parameter.maximum - parameter.minimum
    table[keys[-1]] = (parameter.maximum if side > 0 else parameter.minimum) + side * 0.01 * span
    expected = f"expected {parameter.minimum:g} to {parameter.maximum:g}"
    assert any(f"'{name}'" in p and expected in p for p in refused(whole).problems)


@pytest.mark.parametrize("effect", EFFECTS)
def test_an_axis_has_no_valve_and_no_oil(effect: str) -> None:
    sizes = {p.name: p.typical for p in EFFECTS[effect].parameters}
    document = AXIS | {"effects": {effect: sizes}}
    oil = EFFECTS[effect].subsystem in ("valve", "hydraulics")
    if oil or effect.startswith("pressure_sensor_"):
        assert f"'effects.{effect}': a plant \"axis\" has no" in str(refused(document))
    else:
        assert parse_rig(tomli_w.dumps(document)).effects() == (effect,)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"effects": {"coulomb": {}}}, "did you mean 'coulomb_friction'?"),
        ({"uncertainty": {"axis.mass_kg": 0.1}}, "'axis.mass_kg': the rig does not tell"),
        ({"uncertainty": {"effects.sensor_lag.time_constant_s": 0.1}}, "the rig does not tell"),
        ({"nuisance": {"presliding_m": 0.0}}, "expected 1e-06 to 0.0005 m"),
        ({"columns": {"position_m": {"unit": 1}}}, 'expected { name = "Stroke", unit = "mm" }'),
        ({"effects": 3}, "'effects' = 3: expected a section [effects]"),
        ({"a\nb": 3}, r"'a\nb' is not known"),
        ({"load": {"mass_kg": "x" * 10_000, "viscous_friction_n_s_m": 1.0}}, "xxx...: expected"),
    ],
)  # fmt: skip
def test_other_faults(change: dict[str, Any], message: str) -> None:
    bench = tomllib.loads((RIGS / "bench.toml").read_text(encoding="utf-8"))
    error = refused(bench | change)
    assert len(error.problems) == 1
    assert message in str(error)
    assert len(str(error)) < 300


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b'name = "a"\n[fluid\n', "line 2, column 7"),
        (b'name = "a"\nplant = """', "line 2, column 12, the end of the file"),
        (b'name = "a"\nx = "\xfc"\n', "line 2, column 6: byte 0xfc is not UTF-8"),
    ],
)
def test_a_syntax_error_is_reported_with_line_and_column(
    tmp_path: Path, content: bytes, message: str
) -> None:
    path = tmp_path / "r.toml"
    path.write_bytes(content)
    with pytest.raises(RigError) as caught:
        read_rig(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert message in str(caught.value)


def test_a_byte_order_mark_is_accepted(tmp_path: Path) -> None:
    path = tmp_path / "r.toml"
    path.write_bytes(b"\xef\xbb\xbf" + (RIGS / "bench.toml").read_bytes())
    assert read_rig(path).name == "bench"


def test_invalid_paths_are_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    bench = read_rig(RIGS / "bench.toml")
    for path in (tmp_path / "file" / "r.toml", tmp_path / "zero\x00byte"):
        with pytest.raises(RigError, match="cannot be read"):
            read_rig(path)
        with pytest.raises(RigError, match="cannot be written"):
            write_rig(bench, path)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_other_values_are_checked_with_those_that_stay() -> None:
    bench = read_rig(RIGS / "bench.toml")
    for values, message in (
        ({"cylinder.rod_m": 0.07}, "'cylinder.rod_m' = 0.07 must be below"),
        ({"axis.mass_kg": 9.0}, "has no such value"),
        ({"effects.supply_droop.source_resistance_pa_s_m3": 1e9}, "capacitance_m3_pa' is missing"),
        ({"load.mass": 1.0}, "did you mean 'load.mass_kg'?"),
    ):
        with pytest.raises(RigError) as caught:
            bench.with_values(values)
        assert message in str(caught.value)
    assert bench.with_values({"cylinder.rod_m": 0.07, "cylinder.bore_m": 0.1}).plant == "ehs"


def test_a_rig_with_everything_survives_writing(tmp_path: Path) -> None:
    for document in (FULL, AXIS):
        rig = parse_rig(tomli_w.dumps(document))
        write_rig(rig, tmp_path / "r.toml")
        rig_read = read_rig(tmp_path / "r.toml")
        for part in ("name", "plant", "values", "uncertainty", "sensors", "columns"):
            assert getattr(rig_read, part) == getattr(rig, part)


@pytest.mark.slow
@given(data=st.data())
def test_a_damaged_file_raises_no_other_error(data: st.DataObject) -> None:
    """A file with replaced, removed or added characters gives a valid rig or a RigError."""
    text = tomli_w.dumps(FULL)
    start = data.draw(st.integers(0, len(text) - 1))
    stop = data.draw(st.integers(start, min(start + 20, len(text))))
    inserted = data.draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=6))
    try:
        rig = parse_rig(text[:start] + inserted + text[stop:])
    except RigError:
        return
    assert isinstance(parse_rig(rig_text(rig)), Rig)


def test_an_error_survives_pickling() -> None:
    error = RigError("a.toml", ["one", "two"])
    unpickled = pickle.loads(pickle.dumps(error))
    assert str(unpickled) == str(error)
    assert unpickled.problems == error.problems

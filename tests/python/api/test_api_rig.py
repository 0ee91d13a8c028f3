# SPDX-License-Identifier: MIT
from pathlib import Path

import numpy as np
import pytest
from sources import ROOT

import ehsid
from ehsid.harness.rigs import parse_rig, read_rig
from ehsid.harness.rigs.questions import answered, rig_file_text

BENCH = ROOT / "examples" / "rigs" / "bench.toml"
PLATE = {
    "bore": "63 mm",
    "rod": "35 mm",
    "stroke": "300 mm",
    "supply": "120 bar",
    "rated_flow": "38 l/min",
    "rated_drop": "70 bar",
}


def test_a_rig_file_gives_the_rig_of_the_room() -> None:
    rig = ehsid.Rig.read(BENCH)
    room = read_rig(BENCH)
    assert dict(rig.values) == dict(room.values)
    assert (rig.name, rig.plant, rig.source) == ("bench", "ehs", BENCH)


def test_answers_give_the_rig_of_the_command() -> None:
    rig = ehsid.Rig.new(**PLATE, name="press", hoses=True, drop_over="both")
    answers = {name.replace("_", "-"): text for name, text in PLATE.items()}
    entries = answered("ehs", answers, hoses=True, drop_over_both=True)
    expected = parse_rig(rig_file_text("press", "ehs", entries))
    assert dict(rig.values) == dict(expected.values)
    assert rig.values["valve.rated_pressure_drop_pa"] == pytest.approx(35e5)
    assert rig.name == "press"


def test_numbers_are_in_si_units() -> None:
    texts = PLATE | {"mass": "120 kg", "rated_command": "10 V", "oil": "VG 46"}
    numbers = {
        "bore": 0.063,
        "rod": np.float64(0.035),
        "stroke": 0.3,
        "supply": 12e6,
        "rated_flow": 38e-3 / 60.0,
        "rated_drop": 7_000_000,
        "mass": 120,
        "rated_command": 10,
        "oil": 46,
    }
    expected = dict(ehsid.Rig.new(**texts).values)
    assert dict(ehsid.Rig.new(**numbers).values) == pytest.approx(expected, rel=1e-12)


def test_a_saved_rig_is_the_same_and_tells_the_origin_of_its_values(tmp_path: Path) -> None:
    rig = ehsid.Rig.new(**PLATE, name="press")
    path = rig.save(tmp_path / "press.toml")
    assert dict(ehsid.Rig.read(path).values) == dict(rig.values)
    assert "typical" in path.read_text(encoding="utf-8")
    heavier = rig.with_values({"load.mass_kg": 500.0})
    heavier.save(path)
    assert ehsid.Rig.read(path).values["load.mass_kg"] == 500.0
    assert rig.values["load.mass_kg"] != 500.0


def test_a_file_of_the_user_is_not_replaced(tmp_path: Path) -> None:
    path = tmp_path / "rig.toml"
    path.write_bytes(BENCH.read_bytes())
    with pytest.raises(ValueError, match=r"rig\.toml"):
        ehsid.Rig.read(path).with_values({"load.mass_kg": 1.0}).save(path)
    assert path.read_bytes() == BENCH.read_bytes()


def test_the_summary_has_units_of_people() -> None:
    rig = ehsid.Rig.read(BENCH)
    assert "63 mm" in rig.summary()
    assert "120 bar" in rig.summary()


@pytest.mark.parametrize(
    ("answers", "says"),
    [
        (PLATE | {"boar": "1 mm"}, ["'boar'", "did you mean 'bore'"]),
        ({"bore": "63 mm"}, ["still needed", "stroke"]),
        (PLATE | {"bore": "63 bar"}, ["diameter of the piston"]),
        (PLATE | {"bore": "63"}, ["bore='63'", "'50 mm', or a number in m", "unit is missing"]),
        (PLATE | {"bore": True}, ["bore=True", "a number in m"]),
        (PLATE | {"bore": None}, ["bore=None", "a number in m"]),
        (PLATE | {"bore": float("nan")}, ["bore=nan", "finite"]),
        (PLATE | {"bore": 63.0}, ["63.0", "to 2 m"]),
        (PLATE | {"rod": "80 mm"}, ["rod", "thinner than the bore"]),
        (PLATE | {"line_length": "1 m"}, ["line_length, line_bore", "both or neither"]),
        (PLATE | {"plant": "pump"}, ["plant='pump'", "ehs, axis"]),
        (PLATE | {"drop_over": "three"}, ["drop_over='three'", "'edge' or 'both'"]),
    ],
)
def test_answers_that_make_no_rig_are_refused(answers: dict[str, object], says: list[str]) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 -- the texts are in the table
        ehsid.Rig.new(**answers)  # type: ignore[arg-type]
    for text in says:
        assert text in str(caught.value)
    assert "--" not in str(caught.value)

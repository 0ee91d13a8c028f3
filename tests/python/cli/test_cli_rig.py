# SPDX-License-Identifier: MIT
"""`ehsid rig new` and `ehsid rig check` as a user calls them."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from published_schemas import check_file
from sources import ROOT
from typer.testing import CliRunner
from user_simulators import FOLDER, needs_linux64

from ehsid.harness.cli import cli
from ehsid.harness.rigs import read_rig

pytestmark = pytest.mark.usefixtures("blank_pictures")

KNOWN = {
    "--bore": "63 mm",
    "--rod": "35 mm",
    "--stroke": "300 mm",
    "--supply": "120 bar",
    "--rated-flow": "38 l/min",
}
OPTIONS = [word for pair in KNOWN.items() for word in pair]
BENCH = str(ROOT / "examples" / "rigs" / "bench.toml")


def said(*arguments: str, answers: str | None = None) -> str:
    outcome = CliRunner().invoke(cli, arguments, input=answers, env={"COLUMNS": "200"})
    assert outcome.exit_code == 0, outcome.output
    return " ".join(outcome.stdout.split())


def test_new_writes_a_rig_of_what_is_known(tmp_path: Path) -> None:
    out = tmp_path / "press.toml"
    shown = said("rig", "new", *OPTIONS, "--mass", "120 kg +- 30 %", "--out", str(out))
    rig = read_rig(out)
    assert rig.name == "press"
    assert rig.values["cylinder.bore_m"] == 0.063
    assert rig.sigma("load.mass_kg") == pytest.approx(0.3)
    assert "fluid.bulk_modulus_pa" in shown
    assert "typical" in shown
    assert f"ehsid rig check {out}" in shown
    text = out.read_text(encoding="utf-8")
    assert "given as 63 mm" in text
    assert "typical: effective value" in text


def test_a_drop_over_both_edges_is_halved(tmp_path: Path) -> None:
    out = tmp_path / "rig.toml"
    drop = ["--rated-drop", "70 bar"]
    shown = said("rig", "new", *OPTIONS, *drop, "--out", str(out))
    assert "taken for one edge" in shown
    assert read_rig(out).values["valve.rated_pressure_drop_pa"] == 7e6
    said("rig", "new", *OPTIONS, *drop, "--drop-over", "both", "--out", str(out))
    assert read_rig(out).values["valve.rated_pressure_drop_pa"] == 3.5e6


def test_an_accumulator_makes_the_supply_droop(tmp_path: Path) -> None:
    out = tmp_path / "rig.toml"
    given = ["--accumulator-volume", "1 l", "--accumulator-precharge", "90 bar"]
    shown = said("rig", "new", *OPTIONS, *given, "--out", str(out))
    rig = read_rig(out)
    # 1 l at 90 bar is 0.75 l at 120 bar; C = V / (1.2 p).
    capacitance = 0.75e-3 / (1.2 * 120e5)
    key = "effects.supply_droop.accumulator_capacitance_m3_pa"
    assert rig.values[key] == pytest.approx(capacitance)
    # 5 % of 120 bar at 38 l/min.
    resistance = rig.values["effects.supply_droop.source_resistance_pa_s_m3"]
    assert resistance == pytest.approx(6e5 / (38.0 / 6e4))
    assert "0.1579 bar per l/min" in shown
    assert "1 l, charged to 90 bar" in shown
    assert "supply_droop" not in read_rig(written(tmp_path, "without.toml")).effects()


def written(folder: Path, name: str, *options: str) -> Path:
    said("rig", "new", *OPTIONS, *options, "--out", str(folder / name))
    return folder / name


@pytest.mark.slow
@pytest.mark.parametrize("text", ["68", "VG 68", "ISO VG 68", "HLP 68", "hlp68"])
def test_the_oil_scales_the_typical_viscous_friction(tmp_path: Path, text: str) -> None:
    key = "load.viscous_friction_n_s_m"
    usual = read_rig(written(tmp_path, "usual.toml")).values[key]
    assert read_rig(written(tmp_path, "same.toml", "--oil", "46")).values[key] == usual
    thick = read_rig(written(tmp_path, "thick.toml", "--oil", text))
    assert thick.values[key] == pytest.approx(usual * 68.0 / 46.0)
    assert thick.sigma(key) == 1.0


def test_help_says_for_which_plant_an_option_is_needed() -> None:
    shown = " ".join(said("rig", "new", "--help").replace("│", " ").split())
    assert "whose motor turns the command into a force); needed with --plant axis" in shown
    assert "'120 kg +- 20 %' for a rough guess); needed with --plant axis" in shown
    assert "(from end to end); needed with --plant ehs" in shown


@pytest.mark.slow
def test_numbers_without_units_are_said(tmp_path: Path) -> None:
    shown = said("rig", "new", *OPTIONS, "--mass", "120", "--out", str(tmp_path / "rig.toml"))
    assert "taken as 120 kg for --mass" in shown


def test_on_a_terminal_it_asks_for_what_is_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ehsid.harness.cli.rig_new._on_a_terminal", lambda: True)
    out = tmp_path / "rig.toml"
    answers = {
        "rod": ["thick", "35 mm"],  # asked again
        "stroke": ["", "300 mm"],  # needed
        "supply": ["120 bar"],
        "rated-flow": ["38 l/min"],
        "rated-drop": ["70 bar"],
    }
    # What is left: fifteen questions that may stay empty, then both edges, rod, hoses.
    given = [answer for some in answers.values() for answer in some]
    lines = [*given, *[""] * 15, "yes", "no", "perhaps", "no"]
    shown = said(
        "rig", "new", "--bore", "63 mm", "--out", str(out), answers="\n".join(lines) + "\n"
    )
    rig = read_rig(out)
    assert rig.values["cylinder.rod_m"] == 0.035
    assert rig.values["cylinder.stroke_m"] == 0.3
    assert rig.values["valve.rated_pressure_drop_pa"] == 3.5e6
    assert "'thick': expected a number and its unit" in shown
    assert "can be left empty" in shown


def test_the_end_of_the_input_is_one_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("ehsid.harness.cli.rig_new._on_a_terminal", lambda: True)
    outcome = CliRunner().invoke(cli, ["rig", "new", "--out", str(tmp_path / "rig.toml")], input="")
    assert outcome.exit_code == 2
    assert "the input has ended" in outcome.stderr
    assert not (tmp_path / "rig.toml").exists()


@pytest.fixture(scope="module")
def record(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("record") / "run.csv"
    said(
        *("simulate", BENCH, "--excitation", "multisine", "--noise", "--duration", "8"),
        *("--amplitude", "5", "--out", str(path)),
    )
    return str(path)


@pytest.mark.slow
def test_check_says_what_fits(record: str, tmp_path: Path) -> None:
    shown = said("rig", "check", BENCH, record, "--out", str(tmp_path))
    assert "nothing contradicts the rig" in shown
    words = " ".join(shown.split())
    assert re.search(
        r"can show internal leakage from \d(\.\d+)? l/min at 100 bar, Coulomb friction", words
    )
    assert (tmp_path / "rig_check_1.png").read_bytes().startswith(b"\x89PNG")
    check_file(tmp_path / "rig_check.json")
    found = json.loads((tmp_path / "rig_check.json").read_text(encoding="utf-8"))
    assert [one["record"] for one in found["records"]] == ["run"]
    seen = {one["id"]: one for one in found["records"][0]["could_be_seen"]}
    # The rig has a lag of its valve already; no chamber comes near to the tank pressure.
    assert "valve_lag" not in seen
    assert (seen["makeup_check"]["limit"], seen["makeup_check"]["size"]) == ("none", None)
    assert found == json.loads(said("rig", "check", BENCH, record, "--json"))


@pytest.mark.slow
def test_check_says_what_does_not_fit_by_which_factor_and_ends_well(
    record: str, tmp_path: Path
) -> None:
    rig = tmp_path / "rig.toml"
    said("rig", "new", *OPTIONS[:-1], "25 l/min", "--mass", "120 kg", "--out", str(rig))
    printed = json.loads(said("rig", "check", str(rig), record, "--json"))
    found = {one["check"]: one for one in printed["records"][0]["findings"]}
    assert found["flow"]["status"] == "does not fit"
    assert found["flow"]["value"] == "valve.rated_flow_m3_s"
    assert found["flow"]["factor"] == pytest.approx(38.0 / 25.0, rel=0.08)
    assert found["flow"]["fitting"][0] < 1.0 < found["flow"]["fitting"][1]
    assert printed["records"][0]["could_be_seen"] == []
    shown = said("rig", "check", str(rig), record)
    assert "does not fit: flow" in shown
    assert "at best" not in shown


@needs_linux64
def test_new_describes_a_simulator_of_the_user(record: str, tmp_path: Path) -> None:
    out = tmp_path / "mine.toml"
    shown = said(
        *("rig", "new", "--simulator", str(FOLDER / "bench.fmu"), "--stroke", "350 mm"),
        *("--out", str(out)),
    )
    assert "│ simulator.outputs.position_m │ y │ by its name │" in shown
    assert f"ehsid rig check {out}" in shown
    rig = read_rig(out)
    assert rig.values["cylinder.stroke_m"] == 0.35
    checked = said("rig", "check", str(out), record)
    inside = "counterbalance valve, entrained air, line resonance, flexible load"
    assert f"note: cannot be judged: {inside}" in checked


@needs_linux64
def test_new_says_what_of_a_simulator_is_to_be_filled_in(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        "class Mine:\n    inputs = ('one', 'other')\n    outputs = ('y',)\n"
    )
    out = tmp_path / "mine.toml"
    shown = said("rig", "new", "--simulator", f"{tmp_path / 'mine.py'}:Mine", "--out", str(out))
    assert "to be filled in before it is a rig: 'simulator.inputs.command_v' is missing" in shown
    assert '# command_v = ""  # fill in: it may be one, other' in out.read_text("utf-8")

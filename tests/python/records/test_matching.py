# SPDX-License-Identifier: MIT
"""Names and units in many spellings; what is not clear is refused with the option that says it."""

from __future__ import annotations

import itertools
import shlex
import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.catalogue.channels import CHANNELS
from ehsid.harness.records import ColumnMap, Hints, RecordError, read_record
from ehsid.harness.records.mapping import parse_maps
from ehsid.harness.records.names import doubt_of_unit, is_counter, means, says
from ehsid.harness.records.units import conversion, pint_unit

NAMES = [
    ("Stroke [mm]", "position_m", "mm"),
    ("Kolbenweg (mm)", "position_m", "mm"),
    ("Zylinder-Weg", "position_m", True),
    ("posición", "position_m", True),
    ("déplacement [cm]", "position_m", "cm"),
    ("cylinderPosition_mm", "position_m", "mm"),
    ("Actual Position, mm", "position_m", "mm"),
    ("LVDT (in)", "position_m", "inch"),
    ("Stellgröße", "command_v", True),
    ("valve_cmd [V]", "command_v", "V"),
    ("Valve command (mA)", "command_v", "mA"),
    ("p_A [bar]", "pressure_a_pa", "bar"),
    ("Druck (A)", "pressure_a_pa", True),
    ("A pressure", "pressure_a_pa", True),
    ("pressure_B_psi", "pressure_b_pa", "psi"),
    ("pB", "pressure_b_pa", True),
    ("P2 [bar(g)]", "pressure_b_pa", "barg"),
    ("Supply pressure MPa", "supply_pressure_pa", "MPa"),
    ("p_s", "supply_pressure_pa", True),
    ("Spool position [%]", "spool", "percent"),
    ("Kraft [kN]", "force_n", "kN"),
    ("Load cell (lbf)", "force_n", "lbf"),
    ("force_t", "force_n", "force_metric_ton"),
    ("v [mm/s]", "velocity_m_s", "mm/s"),
    ("Öltemperatur [°C]", "temperature_c", "degC"),
    ("Zeit_ms", "time_s", "ms"),
    ("Time (s)", "time_s", "s"),
    ("/rig/cylinder.position", "position_m", True),
    ("Axis3_ValveCmd", "command_v", True),
    ("axis3_valvecmd", "command_v", True),
    ("Axis1_Cmd [V]", "command_v", "V"),
    ("Axis 0 Control Output (V)", "command_v", "V"),
    ("Axis.ServoOutputLevel", "command_v", True),
    ("Ventilstellung Soll [V]", "command_v", "V"),
    ("Spool demand [%]", "command_v", "percent"),
    ("Reglerausgang", "command_v", True),
    ("Achse1_Stellgroesse", "command_v", True),
    ("Axis3_ActPos", "position_m", True),
    ("MAIN.fbAxis.fActPos", "position_m", True),
    ("GVL.rIstPos", "position_m", True),
    ("Axis 0 Actual Position (in)", "position_m", "inch"),
    ("Lageistwert", "position_m", True),
    ("Wegaufnehmer [mm]", "position_m", "mm"),
    ("LVDT1", "position_m", True),
    ("Axis3_pA", "pressure_a_pa", True),
    ("Drucksensor B [bar]", "pressure_b_pa", "bar"),
    ("pB_kPag", "pressure_b_pa", "kPag"),
    ("p_A_bar_g", "pressure_a_pa", "barg"),
    ("HPU_Pressure", "supply_pressure_pa", True),
    ("HPUPressure", "supply_pressure_pa", True),
    ("Valve feedback", "spool", True),
    ("Servo valve actual", "spool", True),
    ("Valve.Position", "spool", True),
    ("ActVelo", "velocity_m_s", True),
    ("Axis3.ActForce", "force_n", True),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "channel", "said"), NAMES, ids=[one[0] for one in NAMES])
def test_a_name_means_one_channel(name: str, channel: str, said: str | bool) -> None:
    if "/rig" not in name and "." not in name:
        assert says(name, channel) == said
    assert [one for one in CHANNELS if means(name, one)] == [channel]


@pytest.mark.parametrize(
    "name",
    ["position setpoint", "Position reference [mm]", "Sollweg", "Position [%]", "Position [bar]",
     "flow [l/min]", "CHANNEL0", "target_mm", "remark", "", "[mm]", "pump speed",
     "SetPos", "Axis.CommandPosition", "Ax0 Target Position", "Position Error", "Target.Position",
     "Sollwerte/Weg", "Axis1_Cmd", "T1", "V1", "CH1_V", "Tank pressure", "Pilot pressure A",
     "Motor1_Speed"],
)  # fmt: skip
def test_other_names_mean_no_channel(name: str) -> None:
    assert not [one for one in CHANNELS if means(name, one)]


@given(st.text(max_size=80))
def test_any_name_can_be_asked(name: str) -> None:
    for channel in CHANNELS:
        assert means(name, channel) in (True, False)
    assert is_counter(name) in (True, False)


@pytest.mark.parametrize(
    ("text", "channel", "factor", "offset"),
    [
        ("mm", "position_m", 1e-3, 0.0),
        ("in", "position_m", 0.0254, 0.0),
        ("bar", "pressure_a_pa", 1e5, 0.0),
        ("barg", "pressure_a_pa", 1e5, 101325.0),
        ("psi", "supply_pressure_pa", 6894.757293, 0.0),
        ("psig", "supply_pressure_pa", 6894.757293, 101325.0),
        ("N/mm²", "pressure_b_pa", 1e6, 0.0),
        ("kN", "force_n", 1e3, 0.0),
        ("t", "force_n", 9806.65, 0.0),
        ("kg", "force_n", 9.80665, 0.0),
        ("lbf", "force_n", 4.4482216153, 0.0),
        ("%", "spool", 0.01, 0.0),
        ("mV", "command_v", 1e-3, 0.0),
        ("m/min", "velocity_m_s", 1.0 / 60.0, 0.0),
        ("K", "temperature_c", 1.0, -273.15),
        ("°F", "temperature_c", 5.0 / 9.0, -160.0 / 9.0),
        ("BAR", "pressure_a_pa", 1e5, 0.0),
        ("1/10 mm", "position_m", 1e-4, 0.0),
        ("mm/10", "position_m", 1e-4, 0.0),
        ("0,01 mm", "position_m", 1e-5, 0.0),
        ("10 mm", "position_m", 0.01, 0.0),
        ("1/1000 in", "position_m", 2.54e-5, 0.0),
        ("mil", "position_m", 2.54e-5, 0.0),
        ("\u00b5m", "position_m", 1e-6, 0.0),
        ("\u03bcm", "position_m", 1e-6, 0.0),
        ("Mm", "position_m", 1e-3, 0.0),
        ("10ms", "time_s", 0.01, 0.0),
        ("seconds since 2020-01-01", "time_s", 1.0, 0.0),
        ("1e-3 V", "command_v", 1e-3, 0.0),
        ("10\u207b\u00b3 V", "command_v", 1e-3, 0.0),
        ("0.01 bar", "pressure_a_pa", 1e3, 0.0),
        ("kg/cm2", "pressure_a_pa", 98066.5, 0.0),
        ("kgf/cm\u00b2 abs", "pressure_a_pa", 98066.5, 0.0),
        ("bar rel.", "pressure_a_pa", 1e5, 101325.0),
        ("bar(\u00fc)", "pressure_a_pa", 1e5, 101325.0),
        ("at\u00fc", "pressure_a_pa", 98066.5, 101325.0),
        ("MPa(g)", "pressure_b_pa", 1e6, 101325.0),
        ("kPag", "pressure_b_pa", 1e3, 101325.0),
        ("mbar gauge", "pressure_b_pa", 100.0, 101325.0),
        ("0.1 bar(g)", "pressure_b_pa", 1e4, 101325.0),
        ("bara", "pressure_b_pa", 1e5, 0.0),
        ("% of stroke", "spool", 0.01, 0.0),
        ("%FS", "spool", 0.01, 0.0),
        ("mm s\u207b\u00b9", "velocity_m_s", 1e-3, 0.0),
        ("ips", "velocity_m_s", 0.0254, 0.0),
    ],
)
def test_units_of_engineers(text: str, channel: str, factor: float, offset: float) -> None:
    unit = pint_unit(text, channel)
    assert unit is not None
    assert conversion(unit, channel) == pytest.approx((factor, offset), rel=1e-9, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "channel"),
    [("counts", "position_m"), ("inc", "position_m"), ("% of stroke", "position_m"),
     ("rod", "position_m"), ("mm*10", "position_m"), ("1.000 mm", "position_m"),
     ("0 mm", "position_m"), ("mPa", "pressure_a_pa"), ("psid", "pressure_a_pa"),
     ("MV", "command_v"), ("\u00b110 V", "command_v"), ("ticks", "time_s")],
)  # fmt: skip
@pytest.mark.parametrize("row", [False, True], ids=["in the name", "row of units"])
def test_a_unit_that_is_not_understood_is_never_absent(
    tmp_path: Path, text: str, channel: str, row: bool
) -> None:
    """Its values, 20 to 220, would fit a unit of the channel if it were not stated."""
    names = {"time_s": "Time", "command_v": "Cmd", "position_m": "Weg", "pressure_a_pa": "pA"}
    units = {"time_s": "s", "command_v": "V", "position_m": "mm", "pressure_a_pa": "bar"}
    units[channel] = text
    heads = list(names.values()) if row else [f"{names[one]} [{units[one]}]" for one in names]
    lines = [";".join(heads), *([";".join(units.values())] if row else [])]
    lines += [f"{0.002 * k:.3f};{k % 7};{120 + 100 * w:.6f};{120 + 100 * w:.6f}"
              for k, w in enumerate(WAVE)]  # fmt: skip
    path = tmp_path / "log.txt"
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordError) as caught:
        read_record(path, required=[channel])
    assert f"the unit '{text}' of '" in caught.value.problem
    mend = shlex.split((caught.value.mend or "").partition("--map ")[2])[0]
    again = read_record(path, hints=Hints(parse_maps([mend])), required=[channel])
    assert channel in ("time_s", *again.columns)
    if channel != "time_s":
        assert channel not in read_record(path, required=()).columns
        assert "is not read as" in remark_on(path, f"'{text}'", required=())


@pytest.mark.parametrize("stated", ["bar", "kPa"])
def test_two_units_of_one_column_are_refused(stated: str) -> None:
    told = "the log states the unit 'kPa' for 'pA [bar]'" if stated == "kPa" else None
    assert doubt_of_unit("pA [bar]", stated, "pressure_a_pa") == told


def test_gauge_pressures_become_absolute_and_are_told(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", **{"y [mm]": 100 * WAVE, "pA [bar(\u00fc)]": 60 + WAVE})
    assert "is added to 'pA [bar(\u00fc)]'" in remark_on(path, "gauge pressures become absolute")
    values = read_record(path).column("pressure_a_pa")
    np.testing.assert_allclose(values, 1e5 * (60 + WAVE) + 101325.0, rtol=1e-8)


def test_a_valve_position_may_be_the_command(tmp_path: Path) -> None:
    """Its name means the spool; what the user says goes before what a name means."""
    path = write(tmp_path / "log.csv", **{"Ventilstellung [%]": 40 * WAVE, "Weg [mm]": WAVE})
    path.write_text(path.read_text().replace("t,u,", "t,Z9,"))  # no other command
    option = "command_v=Ventilstellung [%]"
    assert f"--map '{option.replace('%', 'percent')}'" in remark_on(
        path, "'command_v'", required=()
    )
    assert "spool" in read_record(path, required=()).columns
    hints = Hints(parse_maps([option]))
    told = remark_on(path, "as 'spool'", required=(), hints=hints)
    assert told.endswith("'Ventilstellung [%]' was named for 'command_v'")
    columns = read_record(path, required=(), hints=hints).columns
    np.testing.assert_allclose(columns["command_v"], 40 * WAVE)
    assert "spool" not in columns
    as_spool = Hints(parse_maps(["spool=Ventilstellung [%]"]))
    assert "Ventilstellung" not in remark_on(path, "'command_v'", required=(), hints=as_spool)


def test_the_only_length_is_the_position(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", **{"X12 [mm]": 100 * WAVE, "Q [l/min]": WAVE})
    assert "X12 [mm]" in remark_on(path, "no other column has a unit of length")
    record = read_record(path)
    np.testing.assert_allclose(record.column("position_m"), 0.1 * WAVE, atol=1e-9)
    assert record.origin is not None
    units = {one.column: (one.unit, one.why) for one in record.origin.taken}
    assert units["X12 [mm]"] == ("mm", "the only length; unit mm in its name")
    assert units["Q [l/min]"][0] == "l/min"


@pytest.mark.parametrize(
    "names",
    [["X12 [mm]", "X13 [mm]"], ["Sollweg [mm]"], ["Spool [mm]"], ["Level [mm]"], ["Spalt [um]"]],
)
def test_of_other_or_two_lengths_none_is_the_position(tmp_path: Path, names: list[str]) -> None:
    path = write(tmp_path / "log.csv", **dict.fromkeys(names, 100 * WAVE))
    assert "position_m" not in read_record(path).columns
    said = remark_on(path, "no column was read as 'position_m'")
    options = [f"--map 'position_m={name}'" for name in names if len(names) > 1]
    assert said.endswith(" or ".join(options or ["--map 'position_m=COLUMN [mm]'"]))


def test_a_missing_command_is_told_with_the_likely_column(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", **{"Weg [mm]": 100 * WAVE, "Out7 [V]": WAVE})
    path.write_text(path.read_text().replace("t,u,", "t,Temp9 [degC],"))
    said = remark_on(path, "no column was read as 'command_v'", required=())
    assert said.endswith("If it is 'Out7 [V]': --map 'command_v=Out7 [V]'")
    with pytest.raises(RecordError, match=r"such as --map 'command_v=Out7 \[V\]'"):
        read_record(path)


def test_a_log_with_some_names_of_the_schema_is_a_log(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", **{"Weg [mm]": 100 * WAVE})
    path.write_text(path.read_text().replace("t,u,", "time_s,command_v,"))
    np.testing.assert_allclose(read_record(path).column("position_m"), 0.1 * WAVE, atol=1e-9)


def test_every_channel_has_names_that_no_other_has() -> None:
    for channel in CHANNELS.values():
        assert channel.spellings
        for spelling in channel.spellings:
            assert [one for one in CHANNELS if means(spelling, one)] == [channel.name], spelling


def test_ranges_of_guesses_do_not_depend_on_luck() -> None:
    """Where ranges of two units overlap a number tells nothing; all but pressures keep apart."""
    for channel in CHANNELS.values():
        ranges = sorted((guess.lowest, guess.highest) for guess in channel.guesses)
        assert all(low < high for low, high in ranges)
        if channel.unit != "Pa":
            assert all(a[1] <= b[0] for a, b in itertools.pairwise(ranges))


def write(path: Path, **columns: object) -> Path:
    n = 60
    table = {"t": 0.002 * np.arange(n), "u": np.sin(np.arange(n)), **columns}
    lines = [",".join(table)]
    lines += [",".join(f"{np.asarray(c)[k]:.9g}" for c in table.values()) for k in range(n)]
    path.write_text("\n".join(lines) + "\n")
    return path


WAVE = np.sin(0.2 * np.arange(60))


def remark_on(path: Path, text: str, **settings: object) -> str:
    record = read_record(path, **settings)  # type: ignore[arg-type]
    assert record.origin is not None
    (found,) = [remark for remark in record.origin.remarks if text in remark]
    return found


def test_a_unit_guessed_from_the_range_is_told(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", y=150 + 100 * WAVE)
    said = remark_on(path, "'y' has no unit")
    assert "taken as mm because its travel is" in said
    assert "--map 'position_m=y [mm]'" in said
    np.testing.assert_allclose(read_record(path).column("position_m"), 0.15 + 0.1 * WAVE)


@pytest.mark.parametrize("scale", [1.0, 1500.0])
def test_a_required_unit_that_is_not_clear_is_refused(tmp_path: Path, scale: float) -> None:
    path = write(tmp_path / "log.csv", y=scale * WAVE * 1.6)
    with pytest.raises(RecordError, match="is not stated") as caught:
        read_record(path, columns=["command_v", "position_m"])
    assert "--map 'position_m=y [m]' or --map 'position_m=y [mm]'" in str(caught.value)
    hints = Hints(parse_maps(["position_m=y [mm]"]))
    values = read_record(path, columns=["command_v", "position_m"], hints=hints)
    np.testing.assert_allclose(values.column("position_m"), 1.6e-3 * scale * WAVE)


def test_an_optional_channel_that_is_not_clear_is_left_out_and_told(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", **{"y [mm]": 100 * WAVE, "pA": 30 + WAVE})
    said = remark_on(path, "pressure_a_pa", columns=list(CHANNELS), required=["command_v"])
    assert "fits MPa or bar: it is left out" in said
    assert "--map 'pressure_a_pa=pA [bar]'" in said


def test_pressures_of_one_logger_have_one_unit(tmp_path: Path) -> None:
    """30 may be bar or MPa; beside a supply of 160 it is bar."""
    path = write(tmp_path / "log.csv", **{"y [mm]": 100 * WAVE, "pA": 30 + WAVE, "pS": 160 + WAVE})
    record = read_record(path)
    np.testing.assert_allclose(record.column("pressure_a_pa"), 1e5 * (30 + WAVE), rtol=1e-7)


def test_two_columns_for_one_channel_are_refused_where_it_is_required(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", **{"Stroke [mm]": 100 * WAVE, "position [mm]": 90 * WAVE})
    with pytest.raises(RecordError, match="2 columns can be 'position_m'") as caught:
        read_record(path, columns=["command_v", "position_m"])
    assert "--map 'position_m=Stroke [mm]' or --map 'position_m=position [mm]'" in str(caught.value)


def test_two_columns_for_a_name_that_is_no_channel_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        for group in ("left", "right"):
            file[f"{group}/Temperature"] = np.linspace(20.0, 30.0, 50)
            file[f"{group}/Temperature"].attrs["unit"] = "degC"
    with pytest.raises(RecordError, match="2 columns can be 'Temperature'") as caught:
        read_record(path, columns=("Temperature",))
    assert caught.value.mend == "give the whole name of the one to read"
    assert read_record(path, columns=("left.Temperature",)).columns["left.Temperature"][0] == 20.0


def test_a_command_in_milliamperes_keeps_its_numbers(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", **{"y [mm]": 100 * WAVE})
    path.write_text(path.read_text().replace("t,u,", "t,Valve [mA],"))
    assert "rated_command_v of a rig must be in mA" in remark_on(path, "no voltage")
    np.testing.assert_allclose(read_record(path).column("command_v"), np.sin(np.arange(60)), 1e-7)


@pytest.mark.parametrize(
    ("texts", "problem"),
    [
        (["position_m"], "expected CHANNEL=COLUMN"),
        (["position_m="], "expected CHANNEL=COLUMN"),
        (["positon_m=Stroke"], "did you mean 'position_m'"),
        (["position_m=Stroke [bar]"], "'bar' is not a unit of 'position_m'"),
        (
            ["position_m=Stroke [milimeter]"],
            "expected one that converts into m, such as mm, cm, m or in; did you mean millimeter?",
        ),
        (["position_m=Stroke [m**9**9]"], "is not a unit of"),
        (["position_m=a", "position_m=b"], "named twice"),
    ],
)
def test_a_wrong_map_is_refused(texts: list[str], problem: str) -> None:
    with pytest.raises(ValueError, match="--map") as caught:
        parse_maps(texts)
    assert problem in str(caught.value)


def test_maps_are_read() -> None:
    assert parse_maps(["position_m=Stroke [mm]", "force_n = F=1 [t]", "command_v=CHANNEL2"]) == {
        "position_m": ColumnMap("Stroke", "mm"),
        "force_n": ColumnMap("F=1", "force_metric_ton"),
        "command_v": ColumnMap("CHANNEL2"),
    }


def test_a_map_may_name_what_is_not_there(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", y=100 * WAVE)
    with pytest.raises(RecordError, match="there is no column 'Stroke'"):
        read_record(path, hints=Hints(parse_maps(["position_m=Stroke [mm]"])))


@pytest.mark.parametrize(
    ("settings", "mend"),
    [
        (
            {"hints": Hints(parse_maps(["position_m=Kolbenweck"]))},
            "did you mean 'Kolbenweg [mm]'? --map 'position_m=Kolbenweg [mm]'",
        ),
        (
            {"hints": Hints(parse_maps(["position_m=Kolbenweck [cm]"]))},
            "did you mean 'Kolbenweg [mm]'? --map 'position_m=Kolbenweg [cm]'",
        ),
        (
            {"hints": Hints(parse_maps(["time_s=Zait"]))},
            "did you mean 'Zeit [ms]'? --map 'time_s=Zeit [ms]'",
        ),
        (
            {"hints": Hints(parse_maps(["position_m=Q"]))},
            "name one of these columns, such as --map 'position_m=COLUMN [mm]'",
        ),
        (
            {"layout": {"position_m": ColumnMap("Kolbenweck", "mm")}},
            "did you mean 'Kolbenweg [mm]'? "
            'In [columns] of the rig, position_m = { name = "Kolbenweg [mm]", unit = "mm" }',
        ),
        (
            {"layout": {"time_s": ColumnMap("Zait [ms]"), "command_v": ColumnMap("u")}},
            "did you mean 'Zeit [ms]'? "
            'In [columns] of the rig, time_s = { name = "Zeit [ms]", unit = "ms" }',
        ),
        ({"columns": ["u", "Kolbenweck"]}, "did you mean 'Kolbenweg [mm]'?"),
    ],
)
def test_a_misspelt_name_is_mended_on_the_side_of_the_user(
    tmp_path: Path, settings: dict[str, object], mend: str
) -> None:
    path = write(tmp_path / "log.csv", **{"Kolbenweg [mm]": 100 * WAVE})
    path.write_text(path.read_text().replace("t,u,", "Zeit [ms],u,"))
    with pytest.raises(RecordError) as caught:
        read_record(path, **settings)  # type: ignore[arg-type]
    assert caught.value.mend == mend
    assert "rename" not in str(caught.value)


@pytest.mark.parametrize("heading", ["Weg [mm]", "weg_mm"])
@pytest.mark.parametrize("extra", ["", "\n"])
def test_without_a_unit_that_of_the_log_counts_for_map_and_rig(
    tmp_path: Path, heading: str, extra: str
) -> None:
    """In a file that has all names of the layout, too, and that is read as it is otherwise."""
    path = write(tmp_path / "log.csv", **{heading: 100 * WAVE})
    path.write_text(extra + path.read_text().replace("t,u,", "time_s,command_v,"))
    one = {"position_m": ColumnMap(heading)}
    for settings in ({"hints": Hints(one)}, {"layout": one}):
        record = read_record(path, **settings)  # type: ignore[arg-type]
        np.testing.assert_allclose(record.column("position_m"), 0.1 * WAVE, atol=1e-9)


def test_where_the_log_has_no_unit_a_layout_has_that_of_the_schema(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", CH3=100 * WAVE)
    one = {"position_m": ColumnMap("CH3")}
    by_rig = read_record(path, layout=one)
    np.testing.assert_allclose(by_rig.column("position_m"), 100 * WAVE, atol=1e-6)
    by_map = read_record(path, hints=Hints(one))
    np.testing.assert_allclose(by_map.column("position_m"), 0.1 * WAVE, atol=1e-9)


def test_a_unit_other_than_that_of_the_log_is_taken_and_told(tmp_path: Path) -> None:
    path = write(tmp_path / "log.csv", **{"Weg [mm]": 100 * WAVE})
    one = {"position_m": ColumnMap("Weg [mm]", "m")}
    said = "'Weg [mm]' is in mm as the log says, and in m as {} says: m is taken. If the log is "
    assert remark_on(path, "is taken", hints=Hints(one)) == (
        said.format("--map") + "right: --map 'position_m=Weg [mm]'"
    )
    in_rig = said.format("[columns]") + 'right: position_m = { name = "Weg [mm]", unit = "mm" }'
    assert remark_on(path, "is taken", layout=one) == in_rig
    np.testing.assert_allclose(
        read_record(path, layout=one).column("position_m"), 100 * WAVE, atol=1e-6
    )
    schema = tmp_path / "schema.csv"
    schema.write_text(path.read_text().replace("t,u,", "time_s,command_v,"))
    assert remark_on(schema, "is taken", layout=one) == in_rig
    assert "'t' is in" not in remark_on(path, "is taken", hints=Hints(one))


@pytest.mark.parametrize(
    "names",
    ["t,u,Weg [mm]", "t,Valve [mA],y_m", "Zeit [ms],u,Weg [m]", "t,u,Spool [%]"],
)
def test_the_block_has_every_unit_and_reads_the_log_again_so(tmp_path: Path, names: str) -> None:
    path = write(tmp_path / "log.csv", y=0.1 + 0.01 * WAVE)
    path.write_text(path.read_text().replace("t,u,y", names))
    record = read_record(path)
    assert record.origin is not None
    columns = tomllib.loads(record.origin.columns_block())["columns"]
    without = {one["name"] for one in columns.values() if "unit" not in one}
    assert without == ({"Valve [mA]"} if "mA" in names else set())
    again = read_record(path, layout={key: ColumnMap(**one) for key, one in columns.items()})
    assert again.columns.keys() == record.columns.keys()
    for name in record.columns:
        np.testing.assert_array_equal(again.column(name), record.column(name))
    np.testing.assert_array_equal(again.time_s, record.time_s)

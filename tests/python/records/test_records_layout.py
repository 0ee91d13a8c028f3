# SPDX-License-Identifier: MIT
"""Records whose columns have names and units of their own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ehsid.harness.records import CHANNELS, ColumnMap, RecordError, read_record
from ehsid.harness.records.units import (
    EXAMPLES,
    FURTHER_UNITS,
    is_convertible,
    pint_unit,
    usual_units,
)

# Name in the file, unit, SI value of 1 and of 3 units; values from the definitions of the units
# (BIPM, SI brochure, 9th ed.; psi from 1 lb = 0.45359237 kg, g = 9.80665 m/s^2, 1 in = 25.4 mm).
LAYOUT = {
    "time_s": (ColumnMap("t", "ms"), 1e-3, 3e-3),
    "command_v": (ColumnMap("u", "mV"), 1e-3, 3e-3),
    "position_m": (ColumnMap("Stroke", "mm"), 1e-3, 3e-3),
    "pressure_a_pa": (ColumnMap("PA", "bar"), 1e5, 3e5),
    "pressure_b_pa": (ColumnMap("PB", "psi"), 0.45359237 * 9.80665 / 0.0254**2, None),
    "spool": (ColumnMap("x_v", "percent"), 0.01, 0.03),
    "velocity_m_s": (ColumnMap("v", "mm/s"), 1e-3, 3e-3),
    "force_n": (ColumnMap("F", "kN"), 1e3, 3e3),
    "temperature_c": (ColumnMap("T", "degF"), (1.0 - 32.0) / 1.8, (3.0 - 32.0) / 1.8),
}
COLUMN_MAPS = {target: entry[0] for target, entry in LAYOUT.items()}


def write(path: Path, columns: dict[str, list[float]]) -> Path:
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(repr(cell) for cell in row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def test_names_and_units_of_every_column(tmp_path: Path) -> None:
    path = write(
        tmp_path / "r.csv", {column_map[0].name: [1.0, 3.0] for column_map in LAYOUT.values()}
    )
    record = read_record(path, layout=COLUMN_MAPS)
    assert record.time_s is not None
    for target, (_, first, second) in LAYOUT.items():
        column = record.time_s if target == "time_s" else record.column(target)
        expected = [first, 3.0 * first if second is None else second]
        # The conversion rounds a few times; degF subtracts numbers of about 300.
        np.testing.assert_allclose(column, expected, rtol=1e-12, atol=1e-12)
    assert record.dt_s == pytest.approx(2e-3, rel=1e-12)


def test_what_is_not_mapped_keeps_its_name_and_values(tmp_path: Path) -> None:
    path = write(
        tmp_path / "r.csv",
        {"time_s": [0.0, 0.1], "command_v": [0.1, 0.2], "Stroke": [1.0, 2.0], "extra": [7.0, 8.0]},
    )
    layout = {"position_m": ColumnMap("Stroke")}
    record = read_record(path, layout=layout)
    assert list(record.columns) == ["command_v", "position_m", "extra"]
    assert record.column("command_v").tolist() == [0.1, 0.2]
    assert record.column("position_m").tolist() == [1.0, 2.0]  # without a unit, that of the schema
    some = read_record(path, columns=("position_m",), layout=layout)
    assert list(some.columns) == ["position_m"]


def test_names_may_be_exchanged(tmp_path: Path) -> None:
    path = write(tmp_path / "r.csv", {"pressure_a_pa": [1.0, 1.0], "pressure_b_pa": [2.0, 2.0]})
    layout = {"pressure_a_pa": ColumnMap("pressure_b_pa"),
              "pressure_b_pa": ColumnMap("pressure_a_pa")}  # fmt: skip
    record = read_record(path, columns=("pressure_a_pa", "pressure_b_pa"), layout=layout)
    assert record.column("pressure_a_pa").tolist() == [2.0, 2.0]
    assert record.column("pressure_b_pa").tolist() == [1.0, 1.0]


GOOD = {"time_s": [0.0, 0.1], "command_v": [0.0, 0.0], "Stroke": [1.0, 2.0]}


def test_every_unit_that_a_message_names_converts() -> None:
    for channel in CHANNELS.values():
        assert channel.unit in EXAMPLES
        for unit in (*EXAMPLES[channel.unit], *FURTHER_UNITS.get(channel.unit, ())):
            assert is_convertible(unit, channel.unit), unit
            assert pint_unit(unit, channel.name), unit


@pytest.mark.parametrize(
    ("unit", "schema_unit", "words"),
    [
        ("milimeter", "m", "such as mm, cm, m or in; did you mean millimeter?"),
        ("kilopascals", "Pa", "such as bar, kPa, MPa or psi; did you mean kilopascal?"),
        ("Mbar", "Pa", "such as bar, kPa, MPa or psi; did you mean bar?"),
        ("kg", "m", "such as mm, cm, m or in"),
        ("%%", "1", "such as percent"),
        (3, "V", "such as V or mV"),
    ],
)
def test_a_wrong_unit_is_answered_with_units_of_the_quantity(
    unit: object, schema_unit: str, words: str
) -> None:
    assert usual_units(unit, schema_unit) == words


@pytest.mark.parametrize(
    ("layout", "column", "message"),
    [
        ({"position_m": ColumnMap("stroke_")}, "stroke_", "did you mean 'Stroke'? In [columns]"),
        ({"position_m": ColumnMap("Stroke", "kg")}, "Stroke", "'kg' is not a unit of 'position_m'"),
        (
            {"position_m": ColumnMap("Stroke", "mmm")},
            "Stroke",
            "converts into m, such as mm, cm, m or in; did you mean mm? To",
        ),
        ({"positon_m": ColumnMap("Stroke")}, "positon_m", "did you mean 'position_m'?"),
        ({"command_v": ColumnMap("Stroke")}, "command_v", "both 'command_v' and 'Stroke' would"),
        ({"position_m": ColumnMap("Stroke"), "time_s": ColumnMap("t")}, "t", "no column 't'"),
        ({"position_m": ColumnMap("s"), "force_n": ColumnMap("F")}, "s", "no column 's'"),
    ],
)
def test_message_of_a_wrong_layout(
    tmp_path: Path, layout: dict[str, ColumnMap], column: str, message: str
) -> None:
    path = write(tmp_path / "r.csv", GOOD)
    with pytest.raises(RecordError) as caught:
        read_record(path, layout=layout)
    assert caught.value.column == column
    assert message in str(caught.value)


def test_a_record_of_the_schema_needs_no_layout(tmp_path: Path) -> None:
    path = write(tmp_path / "sim.csv", {"time_s": [0.0, 0.1], "position_m": [0.1, 0.2]})
    layout = {"position_m": ColumnMap("Stroke", "mm"), "force_n": ColumnMap("F", "kN")}
    record = read_record(path, required=("position_m",), layout=layout)
    assert record.column("position_m").tolist() == [0.1, 0.2]


def test_bad_cells_are_reported_with_the_name_in_the_file(tmp_path: Path) -> None:
    path = write(tmp_path / "r.csv", GOOD | {"Stroke": [1.0, float("inf")]})
    with pytest.raises(RecordError, match="row 3, column 'Stroke': row 3 is infinite"):
        read_record(path, layout={"position_m": ColumnMap("Stroke", "mm")})


def test_a_value_that_is_too_large_in_the_new_unit_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "r.csv", GOOD | {"Stroke": [1.0, 1e99]})
    with pytest.raises(RecordError, match=r"column 'position_m': the number 1e\+102 is too large"):
        read_record(path, layout={"position_m": ColumnMap("Stroke", "km")})


@given(unit=st.sampled_from(["m", "mm", "in", "bar", "Pa", "V", "s", "ms", "degC", "kN", "mm/s"]))
def test_a_unit_fits_the_columns_of_its_dimension_only(unit: str) -> None:
    dimension = {
        "m": "m", "mm": "m", "in": "m", "bar": "Pa", "Pa": "Pa", "V": "V", "s": "s", "ms": "s",
        "degC": "degC", "kN": "N", "mm/s": "m/s",
    }[unit]  # fmt: skip
    for column in CHANNELS.values():
        assert is_convertible(unit, column.unit) == (column.unit == dimension)


@pytest.mark.parametrize(
    "unit",
    ["0 mm", "-2 mm", "2 3 mm", "2mm/10",
     "m**9**9**9", "m^9^9", "m**99", "m)", "(", "1/0 m", "__import__('os')", "m\n",
     "x" * 99, None, 1, True, ["m"], "ms", "M"],
)  # fmt: skip
def test_no_unit_of_length(unit: object) -> None:
    assert not is_convertible(unit, "m")


def test_a_pint_that_cannot_be_loaded_is_no_unknown_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """pint 0.24.0 raises TypeError in its import, beside flexparser 0.4."""

    def broken() -> object:
        raise TypeError("cannot inherit frozen dataclass from a non-frozen one")

    monkeypatch.setattr("ehsid.harness.records.units.unit_registry", broken)
    with pytest.raises(TypeError, match="frozen"):
        is_convertible("mm", "m")


def test_a_layout_with_multiples_and_gauge_pressures_is_told(tmp_path: Path) -> None:
    columns = {"time_s": [0.0, 0.1], "command_v": [0.3, 0.4], "y": [1.0, 2.0], "p": [0.0, 60.0]}
    path = write(tmp_path / "r.csv", columns)
    units = {"position_m": ColumnMap("y", "0.1 mm"), "pressure_a_pa": ColumnMap("p", "0.5 barg")}
    record = read_record(path, layout=units)
    assert record.column("position_m").tolist() == pytest.approx([1e-4, 2e-4], rel=1e-12)
    assert record.column("pressure_a_pa").tolist() == pytest.approx([101325.0, 3101325.0])
    assert record.origin is not None
    (remark,) = record.origin.remarks
    assert remark.endswith("one standard atmosphere, 101325 Pa, is added to 'p'")

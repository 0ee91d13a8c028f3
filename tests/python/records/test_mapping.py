# SPDX-License-Identifier: MIT
"""The lines that messages give to paste read the log as they say."""

from __future__ import annotations

import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest

from ehsid.harness.records import ColumnMap, Hints, Record, read_record
from ehsid.harness.records.mapping import how_to_exchange, how_to_read, parse_maps

N = 60
TIME = 0.002 * np.arange(N)
WAVE = np.sin(0.2 * np.arange(N))
A, B = "pressure_a_pa", "pressure_b_pa"


def written(path: Path, names: str) -> Path:
    columns = (1e3 * TIME, 3.0 * WAVE, 150.0 + 100.0 * WAVE, 70.0 + WAVE, 90.0 - WAVE)
    rows = zip(*(column.tolist() for column in columns), strict=True)
    path.write_text("\n".join([names, *(";".join(f"{x:.6g}" for x in row) for row in rows)]) + "\n")
    return path


def pasted_options(path: Path, words: str) -> Record:
    parts = shlex.split(words)
    assert parts[::2] == ["--map"] * (len(parts) // 2)
    return read_record(path, hints=Hints(parse_maps(parts[1::2])))


def pasted_lines(path: Path, words: str, layout: dict[str, ColumnMap]) -> Record:
    head = "in [columns] of the rig, "
    assert words.startswith(head)
    lines = words.removeprefix(head).replace(" and pressure_b_pa =", "\npressure_b_pa =")
    read = {key: ColumnMap(**value) for key, value in tomllib.loads(lines).items()}
    return read_record(path, layout={**layout, **read})


GERMAN = "Zeit [ms];Ventil [V];Kolbenweg [mm];Druck A [bar];Druck B [bar]"
LETTERS = "t (ms);u (V);Weg (mm);Druck (A);Druck (B)"


@pytest.mark.parametrize(
    ("names", "option"),
    [
        (GERMAN, "--map 'position_m=Kolbenweg [mm]'"),
        (LETTERS, "--map 'position_m=Weg [mm]'"),
        (GERMAN.replace("Kolbenweg [mm]", "Kolben's Weg"), None),
    ],
)
def test_a_unit_that_was_mapped_wrongly_is_mended_by_the_option(
    tmp_path: Path, names: str, option: str | None
) -> None:
    path = written(tmp_path / "log.csv", names)
    column = names.split(";")[2]
    maps = {"position_m": ColumnMap(column, "m")}
    record = read_record(path, columns=["command_v", "position_m"], hints=Hints(maps))
    assert record.column("position_m").max() > 100.0
    words = how_to_read(record, {}, "position_m", "mm")
    assert option is None or words == option
    mended = pasted_options(path, words)
    np.testing.assert_allclose(mended.column("position_m"), 0.15 + 0.1 * WAVE, rtol=1e-5)


def test_a_unit_that_the_rig_states_wrongly_is_mended_in_the_rig(tmp_path: Path) -> None:
    path = written(tmp_path / "log.csv", GERMAN)
    layout = {"position_m": ColumnMap("Kolbenweg [mm]", "m")}
    words = how_to_read(read_record(path, layout=layout), layout, "position_m", "mm")
    assert words == (
        'in [columns] of the rig, position_m = { name = "Kolbenweg [mm]", unit = "mm" }'
    )
    mended = pasted_lines(path, words, layout)
    np.testing.assert_allclose(mended.column("position_m"), 0.15 + 0.1 * WAVE, rtol=1e-5)
    # The option goes before the rig, so that only the option helps where one was given.
    hints = Hints({"position_m": ColumnMap("Kolbenweg [mm]", "m")})
    record = read_record(path, layout=layout, hints=hints)
    words = how_to_read(record, layout, "position_m", "mm")
    assert words == "--map 'position_m=Kolbenweg [mm]'"


def test_a_record_of_the_schema_is_mended_by_the_option(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = "".join(f"{t:.3f},{w:.6f},{150 + w:.6f}\n" for t, w in zip(TIME, WAVE, strict=True))
    path.write_text(f"time_s,command_v,position_m\n{rows}")
    words = how_to_read(read_record(path), {}, "position_m", "mm")
    assert words == "--map 'position_m=position_m [mm]'"
    np.testing.assert_allclose(
        pasted_options(path, words).column("position_m"), 0.15 + 1e-3 * WAVE, atol=1e-8
    )


@pytest.mark.slow
@pytest.mark.parametrize("names", [GERMAN, LETTERS])
def test_exchanged_pressures_are_read_the_other_way_round(tmp_path: Path, names: str) -> None:
    path = written(tmp_path / "log.csv", names)
    record = read_record(path)
    mended = pasted_options(path, how_to_exchange(record, {}, A, B))
    np.testing.assert_array_equal(mended.column(A), record.column(B))
    np.testing.assert_array_equal(mended.column(B), record.column(A))
    column_a, column_b = names.split(";")[-2:]
    layout = {A: ColumnMap(column_a, "bar"), B: ColumnMap(column_b, "bar")}
    words = how_to_exchange(read_record(path, layout=layout), layout, A, B)
    mended = pasted_lines(path, words, layout)
    np.testing.assert_allclose(mended.column(A), 1e5 * (90.0 - WAVE), rtol=1e-5)
    np.testing.assert_allclose(mended.column(B), 1e5 * (70.0 + WAVE), rtol=1e-5)


def test_exchanged_pressures_of_a_record_of_the_schema(tmp_path: Path) -> None:
    path = tmp_path / "run.csv"
    rows = "".join(
        f"{t:.3f},{w:.6f},{7e6 + w},{9e6 - w}\n" for t, w in zip(TIME, WAVE, strict=True)
    )
    path.write_text(f"time_s,command_v,{A},{B}\n{rows}")
    record = read_record(path)
    words = how_to_exchange(record, {}, A, B)
    assert words == (
        "--map 'pressure_a_pa=pressure_b_pa [Pa]' --map 'pressure_b_pa=pressure_a_pa [Pa]'"
    )
    np.testing.assert_array_equal(pasted_options(path, words).column(A), record.column(B))

# SPDX-License-Identifier: MIT
"""Tables of a diagnosis in brief."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from made_diagnoses import bench, made_diagnosis
from msgspec.structs import replace as replace_part

from ehsid.harness.diagnosis import diagnose
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.diagnosis.schema import Candidate, Remark
from ehsid.harness.records import make_record
from ehsid.harness.show.gap_page import render_diagnosis
from ehsid.harness.show.gap_words import summary_tables, told_reasons, told_remarks
from ehsid.harness.show.page import Note, Table
from ehsid.harness.show.units import percent
from ehsid.harness.show.which_section import which_section

RANKED: tuple[tuple[str, float, str], ...] = (
    ("stribeck_friction", 0.0, "too_small"),
    ("load_spring", 1.0, "too_small"),
    ("load_force", 2.0, "worse"),
    ("sensor_lag", 3.0, "worse"),
    ("valve_lag", 4.0, "worse"),
    ("coulomb_friction", 64.4, "named"),
)


def diagnosed(ranked: Sequence[tuple[str, float, str]]) -> Diagnosis:
    diagnosis = made_diagnosis("effects")
    first = diagnosis.candidates[0]
    candidates: list[Candidate] = [
        replace_part(first, effects=(effect,), score=score, standing=kind, why="")
        for effect, score, kind in ranked
    ]
    return replace(diagnosis, candidates=tuple(candidates))


def candidates_of(diagnosis: Diagnosis) -> Table:
    (table,) = (each for each in summary_tables(diagnosis) if each.columns[0] == "candidate")
    return table


def test_nats_are_counted_from_the_named_set_which_is_always_in_the_table() -> None:
    table = candidates_of(diagnosed(RANKED))
    assert [(row[0], *row[2:]) for row in (table.rows[0], table.rows[-1])] == [
        ("Stribeck friction", "-64.4", percent(0.45), "size not counted"),
        ("Coulomb friction", "0.0", percent(0.45), "named"),
    ]
    assert len(table.rows) == 5
    assert "below that of the named set" in table.note
    assert '"Size not counted": ' in table.note


def test_another_law_of_friction_that_is_probable_is_told() -> None:
    """The probability of the effect is that of all laws; that of each law stands beside it."""
    diagnosis = diagnosed(
        (("coulomb_friction", 0.0, "named"), ("stribeck_friction", -9.0, "worse"))
    )
    shares = f"Coulomb friction has {percent(0.55)}, Stribeck friction has {percent(0.43)}"
    said = f"of all of them: {shares}."
    for share, is_told in ((0.43, True), (0.09, False)):
        named, other = diagnosis.candidates
        both = replace_part(named, probability=0.55), replace_part(other, probability=share)
        assert (said in candidates_of(replace(diagnosis, candidates=both)).note) is is_told
    bands = ("valve_dead_band_sides",), ("valve_dead_band", "valve_null_bias")
    alike = [
        replace_part(each, effects=effects, probability=0.4)
        for each, effects in zip(diagnosis.candidates, bands, strict=True)
    ]
    note = candidates_of(replace(diagnosis, candidates=tuple(alike))).note
    assert "unequal valve dead band has" in note.lower()
    assert "all laws of friction" not in note.lower()
    apart = replace_part(diagnosis.candidates[1], effects=("load_force",), probability=0.43)
    candidates = (diagnosis.candidates[0], apart)
    assert "of all of them" not in candidates_of(replace(diagnosis, candidates=candidates)).note


def test_the_page_counts_as_the_table_does() -> None:
    section = which_section(diagnosed(RANKED))
    (table,) = (
        block
        for block in section.blocks
        if isinstance(block, Table) and block.columns[0] == "effects"
    )
    assert [row[1] for row in table.rows] == ["-64.4", "-63.4", "-62.4", "-61.4", "-60.4", "0.0"]
    notes = " ".join(str(block.text) for block in section.blocks if isinstance(block, Note))
    assert "below that of the named set" in notes


def test_without_a_name_nats_are_counted_from_the_fit_without_effects() -> None:
    table = candidates_of(
        diagnosed((("sensor_lag", 0.0, "worse"), ("valve_lag", 2.5, "sufficient")))
    )
    assert [row[2] for row in table.rows] == ["-2.5", "0.0"]
    assert "below that of the fit without effects" in table.note
    assert "counted" not in table.note


def test_why_a_short_record_cannot_be_judged_is_told_once() -> None:
    time = np.arange(200) * 5e-3
    columns = {"time_s": time, "command_v": np.sin(time), "position_m": 0.1 + 0.01 * np.cos(time)}
    diagnosis = diagnose([make_record(columns, name="short")], bench())
    assert diagnosis.verdict == "insufficient_data"
    assert "Record 'short': 1 s without a gap are too short" in diagnosis.sentence
    assert diagnosis.reasons
    assert told_reasons(diagnosis) == ()
    assert not any(remark.serious for remark in told_remarks(diagnosis))
    assert any(remark.serious for remark in diagnosis.remarks)
    page = render_diagnosis(diagnosis, [], "bench.toml")
    assert "Nothing could be judged" in page
    assert "Reasons for the verdict" not in page


def test_what_the_sentence_does_not_say_is_told() -> None:
    diagnosis = made_diagnosis("effects")
    assert told_reasons(diagnosis) == diagnosis.reasons
    remarks = (Remark("one", "the clock jumps", serious=True), Remark("two", "a note"))
    diagnosis = replace(diagnosis, remarks=remarks)
    assert told_remarks(diagnosis) == remarks
    told = replace(diagnosis, reasons=("Record 'one': the clock jumps.",))
    assert told_remarks(told) == remarks[1:]

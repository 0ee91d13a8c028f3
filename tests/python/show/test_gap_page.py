# SPDX-License-Identifier: MIT
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from made_diagnoses import VERDICTS, made_diagnosis
from msgspec.structs import replace as replace_part
from offline_pages import read

from ehsid.harness.diagnosis.result import HeldOutRun
from ehsid.harness.diagnosis.schema import Estimate, Remark, Value
from ehsid.harness.records import Origin, Taken
from ehsid.harness.show.gap_page import RecordLine, render_diagnosis
from ehsid.harness.show.gap_plots import gap_bars, share_bar, timelines, value_table
from ehsid.harness.show.page import Bars, Heading, Mark, Tagged
from ehsid.harness.show.where_section import diagnosis_facts, where_section

RECORDS = [
    RecordLine("fit", "fit", "data/fit run.csv", "ab" * 32),
    RecordLine("held_out", "held out", "data/held_out.csv", "cd" * 32),
]


@pytest.mark.slow
def test_the_page_has_what_was_taken_for_what_in_a_log() -> None:
    taken = Taken("position_m", "<b>Stroke</b> [mm]", "mm", 1e-3, 0.0, "by its name")
    origin = Origin("text, columns separated by ';'", (taken,), ("a remark of its own",))
    lines = [replace(RECORDS[0], origin=origin), RECORDS[1]]
    text = text_of(render_diagnosis(made_diagnosis("effects"), lines, "bench.toml"))
    assert "How the log fit was read" in text
    assert "The file was read as text, columns separated by ';'." in text
    assert "<b>Stroke</b> [mm]" in text  # as text, not as markup
    assert "a remark of its own" in text
    assert "How the log held_out was read" not in text


@cache
def page_of(verdict: Any) -> str:
    return render_diagnosis(made_diagnosis(verdict), RECORDS, "bench.toml")


def text_of(page: str) -> str:
    return " ".join(" ".join(read(page).words).split())


@pytest.mark.slow
@pytest.mark.parametrize(
    "verdict",
    [
        one
        if one in ("effects", "ambiguous", "insufficient_data")
        else pytest.param(one, marks=pytest.mark.thorough)
        for one in VERDICTS
    ],
)
def test_page_is_whole_and_says_the_verdict_first(verdict: Any) -> None:
    diagnosis = made_diagnosis(verdict)
    reader, text = read(page_of(verdict)), text_of(page_of(verdict))
    assert all(one.startswith("data:image/svg+xml;base64,") for one in reader.sources)
    assert all(target.startswith("#") for target in reader.targets)
    assert {target[1:] for target in reader.targets} <= set(reader.ids)
    assert text.index(diagnosis.sentence) < 300
    for reason in diagnosis.reasons:
        assert reason in text
    for one in diagnosis.cannot_judge:
        assert one.why in text
    for remark in diagnosis.remarks:
        assert remark.what in text
    for record in RECORDS:
        assert record.file in text
        assert record.sha256 in text


def test_the_answers_stand_in_the_order_of_the_questions_and_before_the_plots() -> None:
    text = text_of(page_of("effects"))
    words = (
        "Pressure A in held-out data, over the 2 s in which the gap shows most. On all held-out "
        "data its gap is 20 % before and 2.8",
        *("Where mechanics", "Which Coulomb friction", "How far 99 %", "What next Add the effects"),
        *(
            "simulator as configured",
            "Reasons for the verdict",
            "Part of the machine",
            "All that was tried",
            "Held-out data,",
        ),
        "What the fit makes of the numbers",
    )
    places = [text.index(word) for word in words]
    assert places == sorted(places)


def test_many_ways_of_running_have_the_whole_width_of_the_page() -> None:
    section = where_section(made_diagnosis("effects"))
    titles = [block.text for block in section.blocks if isinstance(block, Heading)]
    assert titles[:2] == ["Way of running", "Time"]
    shown = [bar.label for block in section.blocks if isinstance(block, Bars) for bar in block.bars]
    assert shown
    assert all("\N{NO-BREAK SPACE}" in label for label in shown if label.startswith("|velocity|"))


def test_the_ids_of_effects_and_values_appear_on_hovering() -> None:
    page = page_of("effects")
    for words, hint in (
        ("Coulomb friction", "coulomb_friction"),
        ("1. Coulomb friction", "coulomb_friction"),
        ("valve flow saturation", "valve_flow_saturation"),
        ("viscous friction of the load", "load.viscous_friction_n_s_m: force over speed"),
    ):
        assert f'<span title="{hint}">{words}</span>' in page
    text = text_of(page)
    assert "coulomb_friction" not in text


def test_page_shows_what_was_found() -> None:
    text = text_of(page_of("effects"))
    for words in (
        "Coulomb friction",
        "412 N",
        "396 to 431",
        "probability 97 %",
        "|velocity| < 0.004 m/s",
        "0 to 2 Hz",
        "Force against extension",
        "A smooth function of the velocity has 97 % of its squares",
        "named",
        "bulk modulus of the oil",
        "viscous friction of the load",
        "moved",
        "give of the seals before they slide",
        "window_s",
    ):
        assert words in text
    assert "next experiment" not in text.lower()


@pytest.mark.slow
@pytest.mark.parametrize("verdict", VERDICTS)
def test_a_third_simulation_is_shown_only_where_something_was_added(verdict: Any) -> None:
    made = made_diagnosis(verdict)
    added = bool(made.effects or made.missing_laws)
    assert ("with what was found" in page_of(verdict)) == added


@pytest.mark.slow
def test_a_gap_that_became_larger_is_called_larger() -> None:
    diagnosis = made_diagnosis("parameters")
    assert diagnosis.how_far is not None
    for value, word in ((0.11, "smaller"), (-0.11, "larger")):
        change = Estimate(value, value - 0.05, value + 0.05)
        gap = replace_part(diagnosis.how_far, shrinkage_from_nominal=Value.of(change))
        text = text_of(render_diagnosis(replace(diagnosis, how_far=gap), RECORDS, "bench.toml"))
        assert f"11 % {word} than the gap of the simulator as configured" in text
        assert "interval: 6 to 16" in text
        assert f"is {word} by 11" in text


@pytest.mark.slow
def test_next_experiment_comes_with_the_command_to_run() -> None:
    text = text_of(page_of("ambiguous"))
    assert "Slow triangle, 3 mm/s, 4 reversals." in text
    assert "separate Coulomb friction from Stribeck friction" in text
    again = (
        "ehsid gap 'data/fit run.csv' new.csv --rig bench.toml --validate data/held_out.csv "
        "--out again"
    )
    assert again in text


@pytest.mark.slow
def test_words_of_others_cannot_break_the_page() -> None:
    bad = "<script>alert(1)</script>"
    diagnosis = made_diagnosis("effects")
    run = replace(diagnosis.runs[0], record=bad)
    diagnosis = replace(diagnosis, sentence=bad, remarks=(Remark(bad, bad),), runs=(run,))
    text = text_of(render_diagnosis(diagnosis, RECORDS, "bench.toml"))
    assert text.count(bad) >= 4


@pytest.mark.thorough
def test_a_long_rich_record_stays_below_the_size_of_an_attachment() -> None:
    samples = 400_000
    rng = np.random.default_rng(0)
    names = ("position_m", "pressure_a_pa", "pressure_b_pa", "supply_pressure_pa", "spool")
    shown = {name: rng.standard_normal(samples) for name in names}
    window = np.maximum((np.arange(samples) - 300) // 500, -1)
    time = np.arange(samples) * 1e-3
    run = HeldOutRun("long", time, window, time, shown, shown, shown, shown)
    page = render_diagnosis(
        replace(made_diagnosis("effects"), runs=(run, run, run)), RECORDS, "bench.toml"
    )
    assert len(page) < 6_000_000


def test_bars_share_one_axis() -> None:
    far = made_diagnosis("effects").how_far
    assert far is not None
    nominal, calibrated, augmented, floor = gap_bars(far, ("nominal", "calibrated", "augmented"))
    assert nominal.width == 100.0
    assert calibrated.width == pytest.approx(100.0 * far.calibrated / far.nominal)
    assert augmented.width == pytest.approx(100.0 * far.augmented / far.nominal)
    assert floor.low == pytest.approx(100.0 * far.noise_floor[0] / far.nominal)
    assert floor.high == floor.width


def test_shares_beyond_the_axis_stay_on_it() -> None:
    bar = share_bar("", Estimate(1.02, -0.1, 1.3))
    assert (bar.low, bar.width, bar.high) == (0.0, 100.0, 100.0)


def test_marks_stand_where_the_prior_puts_them() -> None:
    diagnosis = made_diagnosis("effects")
    marks = {
        row[0].hint.split(":")[0]: row[-1]
        for row in value_table(diagnosis, nuisances=False).rows
        if isinstance(row[0], Tagged) and isinstance(row[-1], Mark)
    }
    assert list(marks)[:2] == ["load.mass_kg", "fluid.bulk_modulus_pa"]
    assert not [name for name in marks if name.startswith("nuisance.")]
    # ln(131 / 120) / 0.05 sigmas of an axis that reaches to 3 on each side of the middle.
    sigmas = np.log(131.0 / 120.0) / 0.05
    assert marks["load.mass_kg"].at == pytest.approx(50.0 + 50.0 * sigmas / 3.0)
    for mark in marks.values():
        assert mark.low is not None
        assert mark.at is not None
        assert mark.high is not None
        assert 0.0 <= mark.low <= mark.at <= mark.high <= 100.0


def test_time_is_one_axis_for_each_record() -> None:
    spans = made_diagnosis("effects").where.time
    (line,) = timelines(spans)
    assert len(line.columns) == len(spans)
    assert line.columns[0].left == 0.0
    assert line.columns[-1].left + line.columns[-1].width == pytest.approx(100.0)
    assert max(column.height for column in line.columns) == 100.0
    both = [*spans, *(replace_part(span, record="other") for span in spans)]
    assert [line.record for line in timelines(both)] == ["held_out", "other"]


@pytest.mark.parametrize(
    ("sets", "place"),
    [
        ((("coulomb_friction",),), "mechanics"),
        ((("coulomb_friction", "valve_dead_band"),), "mechanics and valve"),
        ((("coulomb_friction",), ("valve_dead_band",)), "mechanics or valve"),
    ],
)
def test_the_place_has_the_part_of_each_named_effect(
    sets: tuple[tuple[str, ...], ...], place: str
) -> None:
    verdict = "ambiguous" if len(sets) > 1 else "effects"
    diagnosis = replace(made_diagnosis(verdict), ambiguity_set=sets)
    first = diagnosis_facts(diagnosis).facts[0]
    assert (first.name, first.value) == ("Where", place)

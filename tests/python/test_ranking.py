# SPDX-License-Identifier: MIT
"""Ranking of machines and the page of a fleet, from diagnosis files written by hand."""

import json
from io import BytesIO
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.collections import PathCollection
from offline_pages import read
from published_schemas import check_file

from ehsid.harness.fleet import Fleet, read_fleet
from ehsid.harness.show.fleet_page import (
    fleet_figure,
    fleet_lead,
    fleet_page,
    verdict_text,
    write_fleet,
)
from ehsid.harness.show.page import Picture, Table, Tagged
from ehsid.harness.show.rendering import render_page


def diagnosis(
    calibrated: float | None,
    floor: float = 0.02,
    effects: dict[str, float] | None = None,
    sets: list[list[str]] | None = None,
    verdict: str = "effects",
) -> dict[str, Any]:
    named = [
        {
            "id": name,
            "probability": 0.9,
            "parameters": {"force_n": {"value": 410.0, "ci90": [400.0, 420.0]}},
            "share_of_shrinkage": share,
        }
        for name, share in (effects or {}).items()
    ]
    nothing = {"value": None, "ci90": [None, None]}
    return {
        "schema_version": 1,
        "verdict": verdict,
        "sentence": "So it is.",
        "reasons": ["It rests on this."],
        "where": {"subsystem": {}, "regimes": [], "frequency": [], "time": []},
        "which": {
            "effects": named,
            "ambiguity_set": sets or [],
            "candidates": [],
            "next_experiment": None,
            "cannot_judge": [{"id": "load_spring", "why": "it does not move far"}],
        },
        "how_far": {
            "nominal": calibrated,
            "calibrated": calibrated,
            "augmented": None if calibrated is None else floor,
            "noise_floor": [None, None] if calibrated is None else [0.5 * floor, floor],
            "shrinkage_of_explainable": nothing,
            "shrinkage_from_nominal": nothing,
            "per_output": {},
        },
        "calibration": {},
        "provenance": {"ehsid_version": "0", "records": [], "settings": {}, "seconds": 1.0},
    }


def written(out: Path, machines: dict[str, dict[str, Any]]) -> Fleet:
    for name, plain in machines.items():
        (out / name).mkdir(parents=True, exist_ok=True)
        (out / name / "diagnosis.json").write_text(json.dumps(plain), encoding="utf-8")
    return read_fleet(out, list(machines))


FORCE = {"load_force": 1.0}


@pytest.fixture
def fleet(tmp_path: Path) -> Fleet:
    (tmp_path / "gone").mkdir()
    (tmp_path / "gone" / "error.txt").write_text("Traceback\nValueError: no <column>\n")
    machines = {
        "a": diagnosis(0.10, effects={"load_force": 0.6, "coulomb_friction": 0.4}),
        "b": diagnosis(0.30, effects=FORCE, sets=[["load_force"], ["load_spring", "load_force"]]),
        "c": diagnosis(0.01, verdict="no_gap"),
        "d": diagnosis(None, verdict="insufficient_data"),
    }
    written(tmp_path, machines)
    return read_fleet(tmp_path, [*machines, "gone", "never run"])


def test_machines_are_ranked_by_what_calibration_leaves_above_the_floor(fleet: Fleet) -> None:
    assert [one.name for one in fleet.ranked] == ["b", "a", "c"]
    assert [one.structural for one in fleet.ranked] == pytest.approx([0.28, 0.08, 0.0])
    assert [one.name for one in fleet.not_judged] == ["d"]
    assert fleet.failed == {"gone": "ValueError: no <column>"}


@given(gaps=st.lists(st.floats(0.0, 2.0), min_size=1, max_size=6))
def test_ranking_is_a_permutation_in_order(
    gaps: list[float], tmp_path_factory: pytest.TempPathFactory
) -> None:
    machines = {f"m{i}": diagnosis(gap) for i, gap in enumerate(gaps)}
    ranked = written(tmp_path_factory.mktemp("fleet"), machines).ranked
    assert sorted(one.name for one in ranked) == sorted(machines)
    sizes = [one.structural for one in ranked]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes == pytest.approx(sorted((max(0.0, gap - 0.02) for gap in gaps), reverse=True))


def test_the_name_of_a_machine_is_no_formula(tmp_path: Path) -> None:
    machine = written(tmp_path, {"$x_{$": diagnosis(0.3, effects=FORCE)}).ranked
    figure = fleet_figure(machine, ["load_force"])
    figure.savefig(BytesIO())  # raises an error where the name is taken for a formula
    assert figure.axes[0].get_yticklabels()[0].get_text() == "$x_{$"


def test_shared_effects_name_their_machines(fleet: Fleet) -> None:
    shared = [(one.id, one.named, one.rival) for one in fleet.shared]
    assert shared == [
        ("load_force", ("b", "a"), ()),
        ("coulomb_friction", ("a",), ()),
        ("load_spring", (), ("b",)),
    ]


def test_a_result_that_is_none_is_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"m/diagnosis\.json: not a diagnosis.*remove its folder"):
        written(tmp_path, {"m": {"verdict": "effects"}})


def test_the_lead_says_what_is_shared(fleet: Fleet) -> None:
    text = " ".join(fleet_lead(fleet))
    assert "3 machines judged" in text
    assert "that of b: 28\N{NO-BREAK SPACE}% of its motion" in text
    assert "load force in 2 of 3" in text
    assert "Coulomb friction in" not in text
    assert "1 for want of data, 1 for an error" in text


def test_what_was_found_is_told_in_a_line(tmp_path: Path) -> None:
    both = {"load_force": 0.6, "coulomb_friction": 0.4}
    machines = {
        "a": diagnosis(0.5, effects=both),
        "b": diagnosis(0.4, effects=FORCE, sets=[["load_force"], ["load_spring"]]),
        "c": diagnosis(0.3, effects=FORCE, verdict="outside_catalogue"),
        "d": diagnosis(0.2, verdict="outside_catalogue"),
        "e": diagnosis(0.1, verdict="parameters"),
    }
    machines["b"]["verdict"] = "ambiguous"
    assert [verdict_text(one) for one in written(tmp_path, machines).ranked] == [
        "load force + Coulomb friction",
        "load force or load spring",
        "load force, and more outside the catalogue",
        "outside the catalogue",
        "values of the rig",
    ]


def test_the_page_has_every_size_and_every_reason(fleet: Fleet) -> None:
    page = fleet_page(fleet)
    tables = [
        block for section in page.sections for block in section.blocks if isinstance(block, Table)
    ]
    sizes = next(one for one in tables if one.caption.startswith("What is known"))
    text = "force 410\N{NO-BREAK SPACE}N (400 to 420)"
    rival = "explains the records as well as what was named"
    assert [(row[0], row[1].hint, row[2]) for row in sizes.rows if isinstance(row[1], Tagged)] == [
        ("b", "load_force", text),
        ("b", "load_spring", rival),
        ("a", "load_force", text),
        ("a", "coulomb_friction", text),
    ]
    html = render_page(page)
    assert "no &lt;column&gt;" in html
    assert "It rests on this." in html
    assert "it does not move far" in html


def test_a_machine_leads_to_its_report_where_there_is_one(tmp_path: Path) -> None:
    machines = {"press #7 100%": diagnosis(0.3, effects=FORCE), "crane": diagnosis(0.2)}
    fleet = written(tmp_path, machines)
    (tmp_path / "press #7 100%" / "report.html").write_text("its report", encoding="utf-8")
    write_fleet(fleet, tmp_path, tmp_path)
    found = read((tmp_path / "fleet.html").read_text(encoding="utf-8")).found
    links = [to for to in found if not to.startswith(("#", "data:"))]
    assert [unquote(to) for to in links] == ["press #7 100%/report.html"]
    assert (tmp_path / unquote(urlsplit(links[0]).path)).read_text(encoding="utf-8") == "its report"


def test_the_picture_stands_before_the_tables_even_without_effects(tmp_path: Path) -> None:
    fleet = written(tmp_path, {"a": diagnosis(0.1, verdict="no_gap")})
    (picture,) = fleet_page(fleet).summary
    assert isinstance(picture, Picture)
    assert "No effect was named" in picture.caption
    assert len(picture.figure.axes) == 1


def test_the_picture_marks_what_the_table_says(fleet: Fleet) -> None:
    figure = fleet_figure(fleet.ranked, [one.id for one in fleet.shared])
    left, right = figure.axes
    assert [label.get_text() for label in left.get_yticklabels()] == ["b", "a", "c"]
    widths = [bar.get_width() for bar in left.patches[:3]]
    assert widths == pytest.approx([28.0, 8.0, 0.0])
    marks = [one for one in right.collections if isinstance(one, PathCollection)]
    points = [tuple(point) for one in marks for point in one.get_offsets().tolist()]
    discs = [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)]
    rings, crosses = [(2.0, 0.0)], [(2.0, 0.0), (2.0, 1.0), (2.0, 2.0)]
    assert sorted(points) == sorted(discs + rings + crosses)
    areas = {
        tuple(one.get_offsets().tolist()[0]): one.get_sizes()[0]
        for one in marks
        if len(one.get_offsets()) and tuple(one.get_offsets().tolist()[0]) in discs
    }
    assert areas[0.0, 0.0] > areas[0.0, 1.0] > areas[1.0, 1.0]


def test_the_file_has_every_machine_and_only_finite_numbers(fleet: Fleet, tmp_path: Path) -> None:
    write_fleet(fleet, tmp_path, tmp_path)
    check_file(tmp_path / "fleet.json")
    plain = json.loads((tmp_path / "fleet.json").read_text(encoding="utf-8"))
    assert [one["name"] for one in plain["ranked"]] == ["b", "a", "c"]
    assert plain["ranked"][1]["effects"][0]["parameters"]["force_n"] == {
        "value": 410.0,
        "low": 400.0,
        "high": 420.0,
    }
    assert plain["not_judged"][0]["structural"] is None
    assert plain["failed"] == {"gone": "ValueError: no <column>"}


def test_a_fleet_without_gaps_or_machines_has_a_page(tmp_path: Path) -> None:
    page = tmp_path / "fleet.html"
    write_fleet(written(tmp_path, {"c": diagnosis(0.01, verdict="no_gap")}), tmp_path, tmp_path)
    assert "No effect was named" in page.read_text(encoding="utf-8")
    write_fleet(read_fleet(tmp_path, []), tmp_path, tmp_path)
    assert "0 machines judged" in page.read_text(encoding="utf-8")
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["c", "fleet.html", "fleet.json"]

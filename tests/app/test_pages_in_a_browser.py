# SPDX-License-Identifier: MIT
"""Each kind of page in a browser, wide and narrow, light and dark: nothing is cut off."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import model16
import numpy as np
import pytest
from made_claims import made_claims
from made_diagnoses import VERDICTS, made_diagnosis
from made_pages import KINDS
from matplotlib.figure import Figure
from page_checks import CUT_OFF, HARD_TO_READ, ORDER
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.gap.diagnosis_file import diagnosis_text
from ehsid.harness.parallel import workers
from ehsid.harness.records import make_record, write_record
from ehsid.harness.report.fleet_page import write_fleet
from ehsid.harness.report.gap_page import RecordLine, render_diagnosis
from ehsid.harness.report.page import Page, Section, render_page
from ehsid.harness.report.picture_data import embedded
from ehsid.harness.report.where_section import where_section
from ehsid.harness.report.which_section import which_section
from ehsid.harness.studies.pages.claims_map import claims_picture
from ehsid.harness.studies.pages.claims_sections import claims_sections, verdict_lead
from ehsid.harness.validation.fleet.ranking import read_fleet

pytestmark = pytest.mark.slow

EXAMPLES = Path(__file__).parents[2] / "examples"
WIDTHS = (1400, 1000, 390)
# What may lie beyond the edge of a picture, in inches: half the width of a line.
EDGE = 0.02
NAME = "press 7, hall B"
DIAGNOSES = tuple(f"diagnosis: {verdict}" for verdict in VERDICTS)
OTHERS = tuple(kind for kind in KINDS if kind != "gap")
PAGES = (*DIAGNOSES, *OTHERS, "fleet of many", "claims", "estimates", "demo")


def whole_picture(figure: Figure) -> str:
    """The picture as pages have it, with a check that nothing in it is beyond its edges."""
    picture = embedded(figure)
    drawn, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    ends = (drawn.x0, drawn.y0, width - drawn.x1, height - drawn.y1)
    assert min(ends) > -EDGE, f"{figure.texts or figure.axes[0].get_title(loc='left')}: {ends}"
    return picture


def diagnosis_page(verdict: Any) -> str:
    records = [
        RecordLine(name, role, f"records/2026-11/{name}.parquet", "ab" * 32)
        for name, role in (("fit", "fit"), ("held_out", "held out"))
    ]
    return render_diagnosis(made_diagnosis(verdict), records, "machines/press_7/rig.toml")


def fleet_page(folder: Path) -> Path:
    names = [f"press {i}" for i in range(12)]
    for i, name in enumerate(names):
        verdict = VERDICTS[i % len(VERDICTS)]
        (folder / name).mkdir(parents=True)
        text = diagnosis_text(made_diagnosis(verdict), [], "rig.toml")
        (folder / name / "diagnosis.json").write_text(text, encoding="utf-8")
        (folder / name / "report.html").write_text(f"<h1>{name}</h1>", encoding="utf-8")
    write_fleet(read_fleet(folder, names), folder, folder)
    return folder / "fleet.html"


def claims_page() -> str:
    claims = made_claims()
    picture = claims_picture(claims.judged, claims.resets, claims.verdicts)
    lead, sections = verdict_lead(claims.verdicts), claims_sections(claims)
    return render_page(Page("The published experiment", lead, sections, summary=[picture]))


def estimates_page(folder: Path) -> Path:
    logs = folder / "logs"
    logs.mkdir(parents=True)
    for seed in range(6):
        u, y = model16.signals(seed, 400)
        columns = {"time_s": 0.01 * np.arange(u.size), "command_v": u, "position_m": y}
        write_record(make_record(columns), logs / f"run on the press {seed}.csv")
    orders = ["--na", "3", "--nb", "3"]
    done = CliRunner().invoke(cli, ["estimate", str(logs), *orders, "--out", str(folder / "out")])
    assert done.exit_code == 0, done.output
    return folder / "out" / "estimates.html"


def demo_page() -> str:
    from demo import demo_page
    from known_model import known_model_sections
    from real_record import real_record_section
    from withheld_record import Opening

    made = made_diagnosis("effects")
    sections = [where_section(made), which_section(made), Section("The answer", ["Friction."])]
    opening = Opening(made, "It names Coulomb friction.", sections)
    return render_page(demo_page(opening, [real_record_section(), known_model_sections(2)]))


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The file of each page."""
    folder = tmp_path_factory.mktemp("pages")
    with pytest.MonkeyPatch.context() as patch, workers(1):
        patch.setattr(sys, "path", [str(EXAMPLES), *sys.path])
        patch.setattr("ehsid.harness.report.page.embedded", whole_picture)
        found = {
            "fleet of many": fleet_page(folder / "fleet_of_many"),
            "estimates": estimates_page(folder / "estimates"),
        }
        texts = {f"diagnosis: {verdict}": diagnosis_page(verdict) for verdict in VERDICTS}
        texts |= {"claims": claims_page(), "demo": demo_page()}
        for kind in OTHERS:
            (folder / kind).mkdir()
            texts[kind] = KINDS[kind](NAME, folder / kind)
    for number, (kind, text) in enumerate(texts.items()):
        found[kind] = folder / f"{number}.html"
        found[kind].write_text(text, encoding="utf-8")
    return found


@pytest.fixture(scope="module")
def window(browser: Any) -> Iterator[Any]:
    made = browser.new_page()
    yield made
    made.close()


@pytest.mark.parametrize("kind", PAGES)
def test_nothing_is_cut_off_or_hard_to_read(kind: str, pages: dict[str, Path], window: Any) -> None:
    problems: list[str] = []
    window.once("pageerror", lambda error: problems.append(str(error)))
    window.goto(pages[kind].as_uri())
    window.evaluate("document.querySelectorAll('details').forEach(d => { d.open = true; })")
    for width in WIDTHS:
        window.set_viewport_size({"width": width, "height": 900})
        # Plots and boxes follow the width a few frames later.
        window.evaluate("new Promise(done => setTimeout(done, 300))")
        for scheme in ("light", "dark"):
            window.emulate_media(color_scheme=scheme)
            at = f"{width} px, {scheme}"
            problems += [f"{at}: {one}" for one in window.evaluate(HARD_TO_READ)]
        problems += [f"{at}: {one}" for one in window.evaluate(CUT_OFF)]
    assert problems == []


@pytest.mark.parametrize("kind", [kind for kind in PAGES if "insufficient" not in kind])
def test_a_picture_stands_before_the_tables(kind: str, pages: dict[str, Path], window: Any) -> None:
    window.goto(pages[kind].as_uri())
    assert window.evaluate(ORDER)[0] == "picture"


def test_a_machine_of_a_fleet_leads_to_its_report(pages: dict[str, Path], window: Any) -> None:
    window.goto(pages["fleet of many"].as_uri())
    window.get_by_role("link", name="press 7", exact=True).first.click()
    assert window.locator("h1").inner_text() == "press 7"


def test_what_is_wider_than_the_window_is_reached_and_moved_by_keys(
    pages: dict[str, Path], window: Any
) -> None:
    window.set_viewport_size({"width": 390, "height": 900})
    window.goto(pages["claims"].as_uri())
    box = window.locator(".wide").first
    assert box.evaluate("e => e.previousElementSibling.checkVisibility()")
    for _ in range(10):
        window.keyboard.press("Tab")
        if box.evaluate("e => document.activeElement === e"):
            break
    window.keyboard.press("ArrowRight")
    window.wait_for_function("() => document.querySelector('.wide').scrollLeft > 0")

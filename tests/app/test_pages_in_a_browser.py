# SPDX-License-Identifier: MIT
"""Each kind of page in a browser, wide and narrow, light and dark: nothing is cut off."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
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

from ehsid.harness.base.parallel import workers
from ehsid.harness.cli import cli
from ehsid.harness.diagnosis.result import diagnosis_text
from ehsid.harness.fleet import read_fleet
from ehsid.harness.records import make_record, write_record
from ehsid.harness.show.fleet_page import write_fleet
from ehsid.harness.show.gap_page import RecordLine, render_diagnosis
from ehsid.harness.show.page import Page, Section
from ehsid.harness.show.rendering import embedded, render_page
from ehsid.lab.studies.pages.claims_sections import claims_picture, claims_sections, verdict_lead

EXAMPLES = Path(__file__).parents[2] / "examples"
WIDTHS = (1400, 1000, 390)
# What may lie beyond the edge of a picture, in inches: half the width of a line.
EDGE = 0.02
NAME = "press 7, hall B"
DIAGNOSIS = "diagnosis: "
DIAGNOSES = tuple(DIAGNOSIS + verdict for verdict in VERDICTS)
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
    from real_record import crane_section, press_section
    from withheld_record import AFTER, BEFORE, Found

    time_s = 0.01 * np.arange(200)
    record = make_record({"time_s": time_s, "position_m": np.sin(time_s)})
    simulated = {BEFORE: np.cos(time_s), AFTER: np.sin(time_s)}
    found = Found(made_diagnosis("effects"), record, simulated)
    answer = Section("Was it right?", ["Friction."])
    return render_page(demo_page(found, [answer, press_section(), crane_section()]))


def made_page(kind: str, folder: Path) -> Path:
    """Makes a page in this folder; returns its file."""
    if kind == "fleet of many":
        return fleet_page(folder)
    if kind == "estimates":
        return estimates_page(folder)
    if kind in DIAGNOSES:
        text = diagnosis_page(kind.removeprefix(DIAGNOSIS))
    elif kind in KINDS:
        text = KINDS[kind](NAME, folder)
    else:
        text = {"claims": claims_page, "demo": demo_page}[kind]()
    path = folder / "page.html"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def page_of(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], Path]]:
    """Returns the file of a page, which is made when a test first asks for it."""
    found: dict[str, Path] = {}

    def page(kind: str) -> Path:
        if kind not in found:
            found[kind] = made_page(kind, tmp_path_factory.mktemp("page"))
        return found[kind]

    with pytest.MonkeyPatch.context() as patch, workers(1):
        patch.setattr(sys, "path", [str(EXAMPLES), *sys.path])
        patch.setattr("ehsid.harness.show.rendering.embedded", whole_picture)
        yield page


@pytest.fixture(scope="module")
def window(browser: Any) -> Iterator[Any]:
    """A page of a browser; what it asks for lies on this machine."""
    asked: list[str] = []
    made = browser.new_page()
    made.on("request", lambda request: asked.append(request.url))
    yield made
    made.close()
    assert [url for url in asked if not url.startswith(("file:", "data:", "blob:"))] == []


@pytest.mark.parametrize("kind", PAGES)
def test_a_picture_is_first_and_nothing_is_cut_off_or_hard_to_read(
    kind: str, page_of: Callable[[str], Path], window: Any
) -> None:
    problems: list[str] = []
    window.once("pageerror", lambda error: problems.append(str(error)))
    window.goto(page_of(kind).as_uri())
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
    # Without data there is nothing to be drawn.
    assert "insufficient" in kind or window.evaluate(ORDER)[0] == "picture"


def test_a_machine_of_a_fleet_leads_to_its_report(
    page_of: Callable[[str], Path], window: Any
) -> None:
    window.goto(page_of("fleet of many").as_uri())
    window.get_by_role("link", name="press 7", exact=True).first.click()
    assert window.locator("h1").inner_text() == "press 7"


def test_what_is_wider_than_the_window_is_reached_and_moved_by_keys(
    page_of: Callable[[str], Path], window: Any
) -> None:
    window.set_viewport_size({"width": 390, "height": 900})
    window.goto(page_of("claims").as_uri())
    box = window.locator(".wide").first
    assert box.evaluate("e => e.previousElementSibling.checkVisibility()")
    for _ in range(10):
        window.keyboard.press("Tab")
        if box.evaluate("e => document.activeElement === e"):
            break
    window.keyboard.press("ArrowRight")
    window.wait_for_function("() => document.querySelector('.wide').scrollLeft > 0")

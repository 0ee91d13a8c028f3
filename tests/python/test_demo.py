# SPDX-License-Identifier: MIT
import subprocess
import sys
from pathlib import Path

import pytest
from offline_pages import read
from sources import ROOT

from ehsid.harness.models.identification import IoData, identify
from ehsid.harness.records import read_record

pytestmark = pytest.mark.thorough  # half a minute: a whole diagnosis

COLUMNS = ("valve_opening", "oil_pressure")


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("demo")
    command = [sys.executable, "examples/demo.py", "--out", str(out), "--seeds", "2"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "demo.html" in done.stdout
    return out


@pytest.fixture(scope="module")
def html(out: Path) -> str:
    return (out / "demo.html").read_text(encoding="utf-8")


def test_page_works_offline_and_leads_to_the_whole_report(html: str, out: Path) -> None:
    references = read(html).found
    assert references
    own = ("#s", "data:image/svg+xml;base64,")
    beside = [ref for ref in references if not ref.startswith(own)]
    assert beside == ["diagnosis/report.html"]
    assert (out / beside[0]).is_file()


def test_page_opens_with_the_diagnosis(html: str) -> None:
    text = " ".join(" ".join(read(html).words).split())
    title = text[text.index("An effect that was withheld") :]
    words = ("Where valve", "Which valve dead band", "How far", "What next")
    places = [title.index(word) for word in words]
    assert places == sorted(places)
    assert places[-1] < title.index("A real record: the hydraulic crane")


def test_page_explains_why_fitted_values_alone_are_worse_than_the_rig_file(html: str) -> None:
    text = " ".join(" ".join(read(html).words).split())
    assert "Values are fitted to some data and judged by others; without valve dead band" in text


def test_crane_table_shows_what_identify_finds(html: str) -> None:
    data = IoData.from_record(
        read_record(ROOT / "examples" / "data" / "hydraulic_crane.csv", columns=COLUMNS), *COLUMNS
    )
    words = [word.strip() for word in read(html).words]
    for candidate in identify(data).by_order:
        at = words.index(f"{candidate.validation.loss:.5f}")
        assert words[at - 5] == str(candidate.orders.na)
        assert words[at - 3] == f"{candidate.one_step_fit_percent:.2f}"
        assert words[at - 2] == f"{candidate.simulation_fit_percent:.2f}"


@pytest.mark.parametrize("number", ["-2.2390", "-2.2553", "-2.2502", "-2.2020", "0.6967"])
def test_truth_and_published_figures_stand_beside_ours(html: str, number: str) -> None:
    assert number in read(html).words


def test_withheld_effect_is_named_before_the_answer(html: str) -> None:
    words = read(html).words
    answer = next(i for i, word in enumerate(words) if "Read only now" in word)
    assert any("names valve dead band" in word for word in words[:answer])
    told = [word.strip() for word in words[answer:]]
    at = told.index("valve dead band: overlap")
    found = next(word for word in told[at + 1 :] if " to " in word)
    low, high = (float(end) for end in found.split(" to "))
    assert low <= 3.548 <= high
    assert any("3.548" in word for word in told[at + 1 : at + 8])

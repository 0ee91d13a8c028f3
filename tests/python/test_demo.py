# SPDX-License-Identifier: MIT
import subprocess
import sys
from pathlib import Path

import pytest
from offline_pages import read
from sources import ROOT

from ehsid.harness.models.identification import IoData, identify
from ehsid.harness.models.identification.dynamics import dynamics
from ehsid.harness.records import read_record

pytestmark = pytest.mark.thorough  # half a minute: a whole diagnosis


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("demo")
    command = [sys.executable, "examples/demo.py", "--out", str(out)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "demo.html" in done.stdout
    return out


@pytest.fixture(scope="module")
def html(out: Path) -> str:
    return (out / "demo.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def text(html: str) -> str:
    return " ".join(" ".join(read(html).words).split())


def test_page_works_offline_and_leads_to_the_whole_report(html: str, out: Path) -> None:
    references = read(html).found
    assert references
    own = ("#s", "data:image/svg+xml;base64,")
    beside = [ref for ref in references if not ref.startswith(own)]
    assert beside == ["diagnosis/report.html"]
    assert (out / beside[0]).is_file()


def test_page_says_what_it_is_before_the_picture_and_the_verdict(html: str) -> None:
    places = [html.index(part) for part in ("It is for engineers", "data:image", "The gap is due")]
    assert places == sorted(places)
    # Words that only a user of ehsid knows come behind the picture.
    lead = html[html.index("<h1>") : places[1]]
    assert not [word for word in ("gap", "rig", "calibrated", "residual", "ARX") if word in lead]


def test_fitted_values_without_the_effect_are_no_step_of_the_page(text: str) -> None:
    assert "simulator as configured" in text
    assert "rig values fitted" not in text


def test_simulation_after_is_nearer_to_the_record_that_was_not_fitted(text: str) -> None:
    told = text.partition("Largest error: ")[2].split()
    before, after = float(told[0]), float(told[3])
    assert 0.0 < 5.0 * after < before


def test_effect_is_named_and_the_truth_is_inside_its_interval(text: str) -> None:
    verdict, _, answer = text.partition("Was it right?")
    assert "due to valve dead band" in verdict
    row = answer.partition("valve dead band: overlap")[2].partition("mass of the load")[0]
    assert "3.548" in row
    low, high = (float(end) for end in row.split()[-3::2])
    assert low <= 3.548 <= high


def test_press_has_the_figures_of_identify(text: str) -> None:
    names = ("target_mm", "position_mm")
    record = read_record(ROOT / "examples" / "data" / "mts_press.csv.gz", columns=names)
    result = identify(IoData.from_record(record, *names))
    told = dynamics(result.chosen.model, result.dt_s)
    assert told.lag_s is not None
    assert told.lag_s.value == pytest.approx(0.0259, abs=2e-3)  # of the author of the record
    assert f"how late it follows, ms {1e3 * told.lag_s.value:.1f} 25.9" in text
    assert f"fit of the free run, % {result.chosen.simulation_fit_percent:.1f}" in text
    assert text.index("a test press") < text.index("no linear model follows")

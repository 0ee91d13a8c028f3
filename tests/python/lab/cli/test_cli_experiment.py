# SPDX-License-Identifier: MIT
import csv
import json
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.records import write_record
from ehsid.harness.rigs import write_rig
from ehsid.harness.rigs.new import published_rig
from ehsid.lab.studies.rig_records import rig_record

CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"


class Headings(HTMLParser):
    """Section titles of a page, and anything that would be loaded from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.inside = False
        self.found: list[str] = []
        self.outside: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.inside = tag == "h2"
        for name, value in attrs:
            if name in ("src", "href") and value and not value.startswith(("data:", "#")):
                self.outside.append(value)

    def handle_data(self, data: str) -> None:
        if self.inside:
            self.found.append(data.strip())
            self.inside = False


def page_of(folder: Path) -> Headings:
    parser = Headings()
    parser.feed((folder / "experiment.html").read_text(encoding="utf-8"))
    return parser


@pytest.mark.thorough
def test_whole_experiment(tmp_path: Path) -> None:
    out = tmp_path / "out"
    outcome = CliRunner().invoke(cli, ["experiment", "--runs", "20", "--out", str(out)])
    assert outcome.exit_code == 0, outcome.output
    page = page_of(out)
    assert page.outside == []
    assert (out / "experiment.html").stat().st_size < 3_000_000
    for title in (
        "Offline: order and delay",
        "Recursive, on model (16) as the known truth",
        "Recursive, on the nonlinear rig",
        "Physical reading",
        "Do the claims hold?",
        "Seeded from the offline model",
        "A noisy position sensor",
    ):
        assert title in page.found
    findings = json.loads((out / "experiment.json").read_text(encoding="utf-8"))
    assert findings["problems"] == []
    assert findings["provenance"]["runs"] == 20
    verdicts = {claim["claim"]: claim["verdict"] for claim in findings["claims"]}
    assert verdicts["The varying factor is calmer than lambda = 0.99 once converged"] == "holds"
    # The start is where the curve of the map crosses the paper's column.
    start = findings["start_of_lambda_1"]
    assert 0.01 < start["p0"] < 100.0
    # By hand, of the medians over 200 runs: (0.466 -0.693 0.226 | 0.005 0.171 -0.131) against the
    # paper's (0.037 -0.099 0.061 | -0.351 0.687 -0.363), which is in other parameters.
    assert start["cosine"] == pytest.approx(0.34, abs=0.05)
    assert "does not explain the column" in " ".join(outcome.stdout.split())
    low, high = findings["rig"]["reading"]["bulk_modulus_pa"][1:]
    # The rig is not linear, so its residuals are not white, and the interval is about ten times as
    # wide as without that. 4 % is not derived: it is what makes the reading useful.
    assert 0.96 * 4e8 < low < 4e8 < high < 1.04 * 4e8
    for start in findings["seeded"]:
        assert start["samples_from_the_model"]["median"] < start["samples_from_nothing"]["median"]
    sensor = {row["recursion"]: row for row in findings["noisy_sensor"]}
    # 120 intervals of 90 %, six in a run; least squares holds 15 %.
    assert sensor["instrumental variables"]["coverage_90"] > 0.7
    assert sensor["least squares, lambda = 1"]["coverage_90"] < 0.5
    with (out / "claims.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 7 * 6 * 3 * 6
    assert {row["input"] for row in rows} == {"multisine", "steps", "prbs"}
    assert len(list((out / "figures").glob("*.png"))) >= 12
    assert not list(out.rglob("*.part"))


@pytest.mark.thorough
def test_on_a_record_of_the_rig(tmp_path: Path) -> None:
    rig = published_rig()
    write_record(rig_record(rig, 1), tmp_path / "rec.csv")
    write_rig(rig, tmp_path / "rig.toml")
    arguments = ["--record", str(tmp_path / "rec.csv"), "--rig", str(tmp_path / "rig.toml")]
    out = tmp_path / "out"
    outcome = CliRunner().invoke(cli, ["experiment", *arguments, "--json", "--out", str(out)])
    assert outcome.exit_code == 0, outcome.output
    findings = json.loads(outcome.stdout)
    assert findings == json.loads((out / "experiment.json").read_text(encoding="utf-8"))
    assert "claims" not in findings
    assert "Physical reading" in page_of(out).found
    kept = findings["offline"]["attempts"][findings["offline"]["kept"]]
    assert kept["problems"] == []
    assert findings["reading"]["mass_kg"][0] == pytest.approx(3000.0, rel=0.02)
    vague = findings["recursive"][0]["contenders"]["1"]
    assert vague["error_at"]["100.0"]["median"] < 0.01


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_preprocessing_and_structures_are_those_asked_for(tmp_path: Path) -> None:
    out = tmp_path / "out"
    arguments = ["--input", "valve_opening", "--output", "oil_pressure", "--orders", "2-3"]
    arguments += ["--delays", "1", "--trend", "mean", "--no-outliers", "--scaling"]
    outcome = CliRunner().invoke(
        cli, ["experiment", "--record", str(CRANE), *arguments, "--out", str(out)]
    )
    assert outcome.exit_code == 0, outcome.output
    findings = json.loads((out / "experiment.json").read_text(encoding="utf-8"))
    assert findings["provenance"]["preprocessing"] == "means removed, outliers left, scaled"
    first = findings["offline"]["attempts"][0]
    assert first["preprocessing"]["u"]["scale"] != 1.0
    assert first["preprocessing"]["u"]["level"] != 0.0
    tried = {
        (candidate["orders"]["na"], candidate["orders"]["nk"])
        for candidate in first["result"]["candidates"]
    }
    assert tried == {(2, 1), (3, 1)}


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_on_the_crane_without_time_or_rig(tmp_path: Path) -> None:
    out = tmp_path / "out"
    columns = ["--input", "valve_opening", "--output", "oil_pressure"]
    outcome = CliRunner().invoke(
        cli, ["experiment", "--record", str(CRANE), *columns, "--out", str(out)]
    )
    assert outcome.exit_code == 0, outcome.output
    assert "not white" in outcome.output.replace("\n", " ")
    assert "Physical reading" not in page_of(out).found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("signal", "problem"),
    [("constant", "constant input"), ("short", "too short"), ("deaf", "no response")],
)
@pytest.mark.usefixtures("blank_pictures")
def test_records_that_allow_no_model_are_named(signal: str, problem: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    n = 12 if signal == "short" else 600
    u = np.ones(n) if signal == "constant" else rng.standard_normal(n)
    y = rng.standard_normal(n)
    rows = "\n".join(
        f"{0.05 * k:.2f},{a!r},{b!r}"
        for k, (a, b) in enumerate(zip(u.tolist(), y.tolist(), strict=True))
    )
    path = tmp_path / "rec.csv"
    path.write_text(f"time_s,command_v,position_m\n{rows}\n")
    out = tmp_path / "out"
    outcome = CliRunner().invoke(cli, ["experiment", "--record", str(path), "--out", str(out)])
    assert outcome.exit_code == 2
    assert "Traceback" not in outcome.output
    findings = json.loads((out / "experiment.json").read_text(encoding="utf-8"))
    named = [found["problem"] for found in findings["offline"]["problems"]]
    assert problem in named
    assert problem in (out / "experiment.html").read_text(encoding="utf-8").lower()


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (("--record", "none.csv"), "none.csv"),
        (("--rig", "none.toml"), "none.toml"),
        (("--record", str(CRANE)), "command_v"),
    ],
)
def test_without_a_source_nothing_is_written(
    source: tuple[str, str], words: str, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    outcome = CliRunner().invoke(cli, ["experiment", *source, "--out", str(out)])
    assert outcome.exit_code == 2
    assert words in outcome.stderr
    assert not out.exists()

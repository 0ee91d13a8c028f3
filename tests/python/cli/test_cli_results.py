# SPDX-License-Identifier: MIT
"""What every command does with the files that it finds where its results belong."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from check_runs import StandIn
from made_diagnoses import bench, measured_record
from made_machines import drawn_machines
from typer.testing import CliRunner

from ehsid.harness.base.exchange import FOLDER
from ehsid.harness.base.parallel import workers
from ehsid.harness.cli import cli
from ehsid.harness.records import make_record, write_record
from ehsid.harness.rigs import write_rig
from ehsid.lab.calibration.fitting import write_features

pytestmark = pytest.mark.usefixtures("blank_pictures", "no_plots")


@dataclass(frozen=True)
class Command:
    """A command on `run.csv`, `rig.toml` and `machines`, and the files that it writes in `out`."""

    arguments: str
    files: tuple[str, ...]


DIAGNOSIS = ("diagnosis.json", "report.html", "rig.augmented.toml", "simulation.csv")
MODEL = "--orders 1-2 --delays 1"
COMMANDS = {
    "identify": Command(
        f"identify run.csv {MODEL} --out out",
        ("identify.json", "identify.png", "identify_bode.png"),
    ),
    "estimate": Command(
        "estimate run.csv --na 1 --nb 1 --out out", ("estimate.json", "estimate.png")
    ),
    "export": Command("export run.csv --na 1 --nb 1 --out out/servo.hpp", ("servo.hpp",)),
    "simulate": Command(
        "simulate rig.toml --command run.csv --out out/sim.npz", ("sim.npz", "sim.png")
    ),
    "excite": Command(
        "excite rig.toml --for transport_delay --dt 0.01 --out out/delay.csv", ("delay.csv",)
    ),
    "inject": Command(
        "inject run.csv --rig rig.toml --effect gain --set factor=1.1 --out out/made.csv",
        ("made.csv", "made.csv.answer.json"),
    ),
    "gap": Command("gap run.csv --rig rig.toml --out out", DIAGNOSIS),
    "gap-fleet": Command(
        "gap-fleet machines --workers 1 --out out",
        ("fleet.html", "fleet.json", *(f"press/{name}" for name in (*DIAGNOSIS, "inputs.json"))),
    ),
    "gap-check": Command(
        "gap-check --count 1 --seconds 2 --workers 1 --out out",
        ("report.html", "score.json", "check.md", "answers.json"),
    ),
    "gap-calibrate": Command(
        "gap-calibrate --features features.jsonl --out out",
        ("calibration.html", "calibration.json", "features.jsonl"),
    ),
    "experiment": Command(
        f"experiment --record run.csv {MODEL} --out out",
        (
            "experiment.html",
            "experiment.json",
            "orders.csv",
            "figures/01_summary.png",
        ),
    ),
}
WITHOUT = ("excite", "gap-fleet", "gap-check", "gap-calibrate")
WITH_INPUTS = [name for name in COMMANDS if name not in WITHOUT]


def write_log(folder: Path) -> None:
    """A record of a servo."""
    rng = np.random.default_rng(0)
    u, y = rng.choice([-1.0, 1.0], 400), np.zeros(400)
    for k in range(1, u.size):
        y[k] = 0.9 * y[k - 1] + 1e-3 * u[k - 1] + 1e-5 * rng.normal()
    columns = {"time_s": 0.01 * np.arange(u.size), "command_v": u, "position_m": 0.15 + y}
    write_record(make_record(columns), folder / "run.csv")


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", StandIn(), raising=False)
    write_log(tmp_path)
    write_rig(bench(), tmp_path / "rig.toml")
    write_features(tmp_path / "features.jsonl", drawn_machines(10, 1))
    machine = tmp_path / "machines" / "press"
    machine.mkdir(parents=True)
    write_rig(bench(), machine / "rig.toml")
    write_record(measured_record("one", 0, seconds=1.0, dt_s=5e-3), machine / "one.csv")
    (tmp_path / "out").mkdir()
    with workers(1):
        yield tmp_path


def run(name: str, code: int = 0) -> str:
    """Runs a command and returns its messages."""
    outcome = CliRunner().invoke(cli, COMMANDS[name].arguments.split())
    assert outcome.exit_code == code, outcome.output
    assert "Traceback" not in outcome.output
    return " ".join(outcome.stderr.split())


def contents(folder: Path) -> dict[str, bytes]:
    """All files below a folder but the manifests, and whatever else is hidden."""
    return {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and not (path.parent.name == FOLDER and path.suffix == ".json")
    }


@contextmanager
def full_disk(size: int) -> Iterator[None]:
    """No file may become larger than this, as on a disk that is nearly full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_replaces_its_own_files_and_no_others(name: str, here: Path) -> None:
    """One folder of results, and all that may happen to it before the command comes again."""
    out = here / "out"
    run(name)
    (out / "thesis.docx").write_text("mine")
    first = contents(out)
    assert set(COMMANDS[name].files) <= set(first)
    run(name)
    before = contents(out)
    assert set(before) == set(first)

    if name == "gap-fleet":
        (here / "machines" / "press" / "note.txt").write_text("diagnose it again")
    with full_disk(max(len(before[file]) for file in COMMANDS[name].files) - 1):
        message = run(name, code=2)
    assert "cannot be written to (File too large); make room there" in message
    assert contents(out) == before

    changed = out / COMMANDS[name].files[0]
    if name in WITH_INPUTS:
        for link in (Path.hardlink_to, Path.symlink_to):
            (here / "run.csv").unlink()
            link(here / "run.csv", changed)
            message = run(name, code=2)
            assert f"{changed.relative_to(here)}: this is an input of the command (run.csv)" in (
                message
            )
        (here / "run.csv").unlink()
        write_log(here)
    changed.write_text("what I made of it")
    assert f"{changed.relative_to(here)}: has been changed since" in run(name, code=2)
    assert contents(out) == {**before, COMMANDS[name].files[0]: b"what I made of it"}


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "gap-check"])
def test_a_file_of_somebody_else_is_refused_before_the_work(name: str, here: Path) -> None:
    path = here / "out" / COMMANDS[name].files[-1]
    path.parent.mkdir(exist_ok=True)
    path.write_text("mine")
    message = run(name, code=2)
    assert f"{path.relative_to(here)}: is there already and is not an earlier result" in message
    assert "move it away or name another --out" in message
    assert contents(here / "out") == {COMMANDS[name].files[-1]: b"mine"}
    assert not list(here.rglob(FOLDER))


@pytest.mark.parametrize(
    "name", [name for name in COMMANDS if name not in ("export", "simulate", "excite", "inject")]
)
def test_a_place_that_cannot_be_written_to_is_refused_before_the_work(
    name: str, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def works(*_: Any, **__: Any) -> None:
        raise AssertionError("the work must not begin")

    monkeypatch.setattr("ehsid.harness.diagnosis.diagnose", works, raising=False)
    (here / "out").rmdir()
    (here / "out").symlink_to("/proc/none")
    message = run(name, code=2)
    assert "--out out" in message
    assert "cannot be written to" in message
    assert "name another --out" in message

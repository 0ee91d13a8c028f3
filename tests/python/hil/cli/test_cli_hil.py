# SPDX-License-Identifier: MIT
"""`ehsid hil` as its user runs it, on the firmware of this host and in QEMU."""

import csv
import json
import shutil
import signal
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

import hil_firmware
import pytest
from hil_firmware import on_host
from interrupts import interruptible
from published_schemas import check_file
from sources import ROOT
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.records import read_record
from ehsid.harness.rigs.new import published_rig
from ehsid.harness.signals.simulation import velocity_gain
from ehsid.hil.faults import TO_HOST, TO_TARGET, Passing, Relay, relayed, undisturbed
from ehsid.hil.frames import decode, encode
from ehsid.hil.messages import Kind
from ehsid.lab.studies.rig_records import DT_S

SHORT = ("--loop", "open", "--duration", "2", "--dt", "0.02", "--excitation", "prbs")
SAFE_BODY = struct.Struct("<HIf")


@pytest.fixture
def relay() -> Iterator[Relay]:
    with relayed(on_host()) as made:
        yield made


def ended(*arguments: str) -> tuple[int, str, str]:
    result = CliRunner().invoke(cli, ["hil", *arguments])
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.slow
def test_a_run_and_its_files(relay: Relay, tmp_path: Path) -> None:
    out = tmp_path / "hil"
    code, said, errors = ended("--port", relay.port, *SHORT, "--json", "--out", str(out))
    assert code == 0, errors
    findings = json.loads(said)
    assert findings == json.loads((out / "hil.json").read_text())
    check_file(out / "hil.json")
    assert findings["equal_to_host"]
    assert findings["target"]["board"] == "host"
    (run,) = findings["runs"]
    assert run["samples"] == 100
    assert run["samples_that_differ"] == 0
    assert read_record(out / "record.csv").column("position_m").size == 100
    page = (out / "hil.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    assert "bit for bit" in page
    assert "http" not in page.replace("http://www.w3.org", "")  # works offline
    assert "100 of 100" in errors


@pytest.mark.slow
def test_a_run_of_a_servo_and_its_files(relay: Relay, tmp_path: Path) -> None:
    out = tmp_path / "hil"
    arguments = ("--port", relay.port, *SHORT, "--servo", "--setting", "drift=0.05")
    arguments += ("--cycles", "jitter=0.2", "--cycles", "lost=0.1", "--cycles", "overrun=0.1")
    code, said, errors = ended(*arguments, "--json", "--out", str(out))
    assert code == 0, errors
    check_file(out / "hil.json")
    findings = json.loads(said)
    assert findings["equal_to_host"]
    (run,) = findings["runs"]
    assert run["name"] == "servo"
    assert (run["forgetting"], run["orders"], run["converged"]) == (None, None, None)
    assert run["servo"]["delay"] in (1, 2)
    for name in ("gain", "omega_n", "xi"):
        low, high = run["servo"][name]["ci90"]
        assert low <= run["servo"][name]["value"] <= high
    assert run["servo"]["gain"]["reason_at_end"] == "starting"  # 2 s
    page = (out / "hil.html").read_text().replace("\N{NO-BREAK SPACE}", " ")
    assert "every reason why they are not trusted" in page
    assert "ServoEstimator, 0.02 s, delay 1, drift 0.05, tolerance 0.1" in page
    assert "K 0.0" in errors  # while it runs
    cycles, row = run["cycles"], read_csv(out / "estimates.csv")
    lost, late = (sum(int(one[name]) for one in row) for name in ("cycles_lost", "overrun"))
    assert (cycles["cycles_lost"], cycles["cycles_overrun"]) == (lost, late)
    assert lost > 0 < late
    assert cycles["cycles"] == run["samples"] + lost == 100
    assert 0.016 <= cycles["shortest_s"] < cycles["longest_s"] <= 0.024
    assert f"of 100 cycles {lost} were lost and the command of {late} came late" in page
    assert "Cycles: servo" in page


def read_csv(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.thorough
@pytest.mark.usefixtures("blank_pictures")
def test_the_experiment_of_a_servo(relay: Relay, tmp_path: Path) -> None:
    """K of the rig, before and behind a change of its load, whose omega_n falls to 1 / sqrt(2)."""
    code, said, errors = ended("--port", relay.port, "--servo", "--out", str(tmp_path))
    assert code == 0, errors
    assert "trusted, %" in said
    check_file(tmp_path / "hil.json")
    runs = {run["name"]: run for run in json.loads((tmp_path / "hil.json").read_text())["runs"]}
    assert list(runs) == ["servo", "changed"]
    for run in runs.values():
        low, high = run["servo"]["gain"]["ci90"]
        assert run["servo"]["gain"]["trusted"]
        assert low < velocity_gain(published_rig()) < high
        assert (tmp_path / run["name"] / "estimates.csv").exists()
    before, behind = (run["servo"]["omega_n"] for run in runs.values())
    low, high = (end / before["value"] for end in behind["ci90"])
    assert low < 0.5**0.5 < high


@pytest.mark.thorough
@pytest.mark.usefixtures("blank_pictures")
def test_the_experiment_has_a_folder_for_each_factor(relay: Relay, tmp_path: Path) -> None:
    code, said, errors = ended("--port", relay.port, "--out", str(tmp_path))
    assert code == 0, errors
    for name in ("varying", "lambda_0.99", "lambda_1", "f_ratio"):
        assert name in said
        assert (tmp_path / name / "estimates.csv").exists()
    names = ("varying", "lambda_0.99", "lambda_1", "f_ratio", "changed", "changed_reset")
    records = [tmp_path / name / "record.csv" for name in names]
    lines = [record.read_bytes().splitlines() for record in records]
    # An open loop: the same data, in the last two up to the sample at which the load changes.
    assert all(record == lines[0] for record in lines[:4])
    assert lines[4] == lines[5]
    assert lines[4][:1002] == lines[0][:1002]
    assert lines[4][1002:] != lines[0][1002:]
    check_file(tmp_path / "hil.json")
    runs = {run["name"]: run for run in json.loads((tmp_path / "hil.json").read_text())["runs"]}
    assert runs["changed_reset"]["resets"] >= 1 > runs["changed"]["resets"]
    assert read_record(records[0]).dt_s == pytest.approx(DT_S)


@pytest.mark.slow
def test_another_machine_must_be_of_the_same_kind(tmp_path: Path) -> None:
    axis = ROOT / "examples" / "rigs" / "axis.toml"
    code, _, errors = ended("--port", "loop://", "--actual", str(axis), "--out", str(tmp_path))
    assert code == 2
    assert 'a plant "axis"' in errors


@pytest.mark.usefixtures("blank_pictures")
def test_estimates_that_are_not_the_hosts_end_with_code_1(relay: Relay, tmp_path: Path) -> None:
    """As of a firmware compiled with fused multiply-add: here a record that was tampered with."""

    def other(way: str, number: int, frame: bytes) -> Passing:
        packet = decode(frame)
        if way == TO_TARGET and packet.kind == Kind.CONFIGURE:
            body = bytearray(packet.body)
            body[21] ^= 1  # the last bit of lambda
            return Passing(encode(packet.kind, packet.sequence, bytes(body))[1:])
        return undisturbed(way, number, frame)

    relay.disturb(other)
    arguments = ("--port", relay.port, *SHORT, "--forgetting", "constant", "--lambda0", "0.99")
    code, said, errors = ended(*arguments, "--out", str(tmp_path))
    assert code == 1, errors
    assert "not the host's at" in said.replace("\n", " ")
    assert "-ffp-contract=off" in said.replace("\n", " ")


def contents(folder: Path) -> dict[str, bytes]:
    """The files of the result, without those of runs that were not finished."""
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def _long_run(relay: Relay, out: Path) -> AbstractContextManager[subprocess.Popen[str]]:
    """The command as a process of its own, which takes 100 s: a sample every 50 ms."""
    command = [sys.executable, "-c", "from ehsid.harness.cli import main; main()", "hil"]
    command += ["--port", relay.port, "--loop", "open", "--duration", "100", "--dt", "0.05"]
    return interruptible([*command, "--real-time", "--out", str(out)])


class Watched:
    """Waits for sample 20, and for the target's word that the valve is closed."""

    def __init__(self) -> None:
        self.under_way, self.safe = threading.Event(), threading.Event()
        self.stopped = threading.Event()
        self.valve_v = float("nan")

    def __call__(self, way: str, number: int, frame: bytes) -> Passing:
        packet = decode(frame)
        sample = int.from_bytes(packet.body[:4], "little")
        if way == TO_TARGET and packet.kind == Kind.SAMPLE and sample == 20:
            self.under_way.set()
        if way == TO_TARGET and packet.kind == Kind.STOP:
            self.stopped.set()
        if way == TO_HOST and packet.kind == Kind.SAFE:
            self.valve_v = SAFE_BODY.unpack(packet.body)[2]
            self.safe.set()
        return undisturbed(way, number, frame)


@pytest.mark.thorough
@pytest.mark.usefixtures("blank_pictures")
def test_a_host_that_is_killed(relay: Relay, tmp_path: Path) -> None:
    """The target closes the valve, the record ends with a whole line, the next host can run."""
    assert ended("--port", relay.port, *SHORT, "--out", str(tmp_path))[0] == 0
    before = contents(tmp_path)
    watched = Watched()
    relay.disturb(watched)
    with _long_run(relay, tmp_path) as process:
        assert watched.under_way.wait(60.0)
        process.kill()
        process.communicate()
    assert watched.safe.wait(60.0)
    assert watched.valve_v == 0.0
    lines = (tmp_path / "unfinished_1" / "record.csv").read_bytes().split(b"\n")
    assert lines[-1] == b""
    columns = lines[0].count(b",")
    assert all(line.count(b",") == columns for line in lines[:-1])
    assert len(lines) - 2 >= 20  # sample 20 was on its way: those before had been written
    assert contents(tmp_path) == before
    relay.disturb(undisturbed)
    code, _, errors = ended("--port", relay.port, *SHORT, "--seed", "1", "--out", str(tmp_path))
    assert code == 0, errors
    assert contents(tmp_path)["record.csv"] != before["record.csv"]
    assert (tmp_path / "unfinished_1" / "record.csv").read_bytes().split(b"\n") == lines
    assert not (tmp_path / "unfinished_2").exists()


@pytest.mark.slow
def test_ctrl_c(relay: Relay, tmp_path: Path) -> None:
    watched = Watched()
    relay.disturb(watched)
    with _long_run(relay, tmp_path) as process:
        assert watched.under_way.wait(60.0)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60.0)
    assert process.returncode == 130
    assert f"interrupted; {tmp_path / 'unfinished_1'} holds the samples so far" in errors
    assert sorted(path.name for path in tmp_path.iterdir()) == ["unfinished_1"]
    assert "Traceback" not in errors
    assert watched.stopped.is_set()  # the valve is closed at once, not by the watchdog


@pytest.mark.slow
@pytest.mark.usefixtures("blank_pictures")
def test_a_line_that_is_closed_in_mid_run(relay: Relay, tmp_path: Path) -> None:
    hung_up: list[int] = []

    def hang_up(way: str, number: int, frame: bytes) -> Passing:
        if way == TO_TARGET and number == 30:
            hung_up.append(number)
            relay.hang_up()
        return undisturbed(way, number, frame)

    assert ended("--port", relay.port, *SHORT, "--out", str(tmp_path))[0] == 0
    before = contents(tmp_path)
    relay.disturb(hang_up)
    code, _, errors = ended("--port", relay.port, *SHORT, "--out", str(tmp_path))
    assert hung_up
    assert code == 2
    assert "the line was closed" in errors.replace("\n", " ")
    samples = len(read_csv(tmp_path / "unfinished_1" / "record.csv"))
    assert 20 < samples < 31
    assert contents(tmp_path) == before
    assert f"holds the {samples} samples before" in errors.replace("\n", " ")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("machine", "options", "samples"),
    [
        ("an386", ("--loop", "experiment"), [2000] * 6),
        ("an500", ("--loop", "open"), [1000]),
        ("an386", ("--servo",), [2000] * 2),
        ("an500", ("--loop", "position", "--bandwidth", "0.3", "--servo"), [1000]),
    ],
)
def test_a_run_on_the_emulated_cortex_m(
    machine: str, options: tuple[str, ...], samples: list[int], tmp_path: Path
) -> None:
    """The published experiment on one core and a test signal on the other: estimates are equal."""
    if shutil.which("qemu-system-arm") is None:
        pytest.skip("no qemu-system-arm: the firmware is not run on the emulated Cortex-M")
    image = hil_firmware.ON_TARGET.with_name(f"servo_{machine}.elf")
    if not image.exists():
        pytest.skip(
            "no firmware for the Cortex-M; build it: cmake --preset arm && "
            "cmake --build --preset arm"
        )
    arguments = ["--qemu", str(image), "--machine", f"mps2-{machine}", *options]
    code, said, errors = ended(*arguments, "--out", str(tmp_path), "--json")
    assert code == 0, errors
    findings = json.loads(said)
    assert findings["target"]["board"] == f"mps2-{machine}"
    assert [run["samples"] for run in findings["runs"]] == samples
    assert all(run["equal_to_host"] for run in findings["runs"])
    assert findings["runs"][0]["line"]["asked_again"] == 0


@pytest.mark.thorough
def test_the_record_goes_into_the_diagnosis(relay: Relay, tmp_path: Path) -> None:
    """A machine with a friction that the rig does not tell, under control of the target."""
    rig = ROOT / "examples" / "rigs" / "bench.toml"
    out = tmp_path / "hil"
    arguments = ["--port", relay.port, "--rig", str(rig), "--loop", "position", "--dt", "0.002"]
    arguments += ["--excitation", "steps", "--effect", "coulomb_friction.force_n=400"]
    code, _, errors = ended(*arguments, "--out", str(out))
    assert code == 0, errors
    gap = ["gap", str(out / "record.csv"), "--rig", str(rig), "--out", str(tmp_path / "gap")]
    result = CliRunner().invoke(cli, gap)
    assert result.exit_code == 0, result.output
    diagnosis = json.loads((tmp_path / "gap" / "diagnosis.json").read_text())
    assert ["coulomb_friction"] in diagnosis["which"]["ambiguity_set"] or [
        effect["id"] for effect in diagnosis["which"]["effects"]
    ] == ["coulomb_friction"]

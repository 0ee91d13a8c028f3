# SPDX-License-Identifier: MIT
"""One page of each kind, from made-up results or short runs, with a name where names may stand."""

from __future__ import annotations

import math
import struct
import tempfile
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from hil_runs import TIMEOUT_S
from hil_target import FakeDevice, Target
from identification_truth import model16
from made_checks import fair, made_answers, write_check
from made_diagnoses import made_diagnosis, measured_record
from made_machines import drawn_machines
from page_names import file_name

import ehsid
from ehsid.harness.diagnosis.limits import Limits
from ehsid.harness.diagnosis.result import Diagnosis, diagnosis_text
from ehsid.harness.diagnosis.schema import Remark
from ehsid.harness.fleet import read_fleet
from ehsid.harness.hunt.guard import Seen
from ehsid.harness.hunt.hunting import Cause, Hunt, Hunted, HuntExperiment, HuntStep
from ehsid.harness.hunt.running import Experiment, Ran
from ehsid.harness.models.identification import ArxOrders, IoData
from ehsid.harness.rigs.new import published_rig
from ehsid.harness.show.fleet_page import fleet_page
from ehsid.harness.show.gap_page import RecordLine, render_diagnosis
from ehsid.harness.show.hunt_page import hunt_page
from ehsid.harness.show.page import Page
from ehsid.harness.show.rendering import render_page
from ehsid.harness.show.watch_page import watch_page
from ehsid.harness.signals.simulation import suggested_controller
from ehsid.harness.signals.simulation.run import OUTPUTS_OF
from ehsid.harness.watch.store import Row
from ehsid.harness.watch.tracking import Estimated, Told
from ehsid.harness.watch.watching import Watch, watched
from ehsid.hil.comparison import compare
from ehsid.hil.faults import relayed
from ehsid.hil.frames import encode
from ehsid.hil.page import hil_page
from ehsid.hil.plan import Plan, open_plan
from ehsid.hil.recording import Recording
from ehsid.hil.run import run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import open_line
from ehsid.lab.calibration.checking import LEAST_MACHINES, calibrate
from ehsid.lab.calibration.machines import Found
from ehsid.lab.pages.calibration_page import calibration_page
from ehsid.lab.pages.check_page import check_page
from ehsid.lab.scoring.score import score_folder
from ehsid.lab.studies.pages.offline_sections import offline_sections
from ehsid.lab.studies.procedure import run_procedure

Make = Callable[[str, Path], str]
ARX = ArxOrders(3, 3, 1, offset=True)


@cache
def diagnosis() -> Diagnosis:
    return made_diagnosis("ambiguous", seconds=1.0)


def gap(name: str, _: Path) -> str:
    """The name is that of rig, rig file and records, and stands in a remark."""
    made = diagnosis()
    runs = tuple(replace(run, record=name) for run in made.runs)
    made = replace(
        made,
        rig=replace(made.rig, name=name),
        runs=runs,
        records={name: "held out"},
        remarks=(Remark(name, f"{name}: jitter"),),
    )
    return render_diagnosis(made, [RecordLine(name, "held out", f"data/{name}", "ab")], name)


def fleet(name: str, folder: Path) -> str:
    """The name is that of a machine with a result, of one with an error, of one left out."""
    name = file_name(name)
    judged, failed = f"1{name}", f"2{name}"
    for machine in (judged, failed):
        (folder / machine).mkdir()
    text = diagnosis_text(diagnosis(), [], name)
    (folder / judged / "diagnosis.json").write_text(text, encoding="utf-8")
    (folder / failed / "error.txt").write_text(f"ValueError: {name}\n", encoding="utf-8")
    refused = {f"3{name}": f"{name}: is in the way"}
    return render_page(fleet_page(read_fleet(folder, [judged, failed], refused)))


def life(name: str, _: Path) -> str:
    """The name is that of a machine and of a log that could not be used."""
    first = datetime(2026, 1, 1, tzinfo=UTC)
    leak = "effects.internal_leakage.coefficient_m3_s_pa"
    rows = [Row(name, first, Told(refused=f"{name}: is no record"))]
    for week in range(30):
        size = 1e-12 * (1.0 + 0.05 * math.sin(7.0 * week) + 2.0 * (week > 17))
        told = Told((Estimated(leak, "m^3/(s Pa)", size, 5e-14),))
        rows.append(Row(f"{week}", first + timedelta(weeks=week), told))
    return render_page(watch_page(Watch(1, "0", 1.0, (watched(name, rows),))))


def check(name: str, folder: Path) -> str:
    """The name is that of a case."""
    answers = {f"{file_name(name)}{i}": one for i, one in enumerate(made_answers(12).values())}
    return render_page(check_page(score_folder(write_check(folder, answers, fair))))


def calibration(name: str, _: Path) -> str:
    """The name is that of a family of machines."""
    named = tuple(
        replace(one, families={"seals": name if i % 2 else "Dahl"})
        for i, one in enumerate(drawn_machines(2 * LEAST_MACHINES, 1))
    )
    return render_page(calibration_page(calibrate(Found(named))))


@cache
def procedure() -> Any:
    u, y = model16(seed=1, n=600, noise=0.1)
    return run_procedure(IoData.from_arrays(u, y, dt_s=0.05))


def experiment(name: str, _: Path) -> str:
    """The name is that of a record."""
    sections = offline_sections(procedure(), record_name=name)
    return render_page(Page(name, [name], sections, sources=[name]))


@cache
def hunted() -> Hunted:
    """A hunt with one experiment, whose diagnosis was made by hand."""
    diagnosis = made_diagnosis("effects", seconds=2.3)
    record = measured_record("experiment1", 3, seconds=2.0, dt_s=5e-3)
    path = record.column("position_m")
    planned = Experiment("a swing", record.column("command_v"), path, 5e-3)
    ran = Ran(record, "", Seen((0.1, 0.2), 3.0, 0.05, 9e6), 2.0)
    told = HuntExperiment(
        *("a swing", (("coulomb_friction",), ("load_force",)), 12.0, 0.95, "experiment1.csv", ""),
        *((0.1, 0.2), 3.0, 0.05, 9e6),
    )
    causes = Cause(("coulomb_friction",), 0.6), Cause(("load_force",), 0.3)
    steps = (
        HuntStep((), "ambiguous", "Two causes.", causes, 0.1),
        HuntStep((told,), "effects", diagnosis.sentence, causes[:1], 0.01),
    )
    limits = Limits((0.0, 0.3), 10.0, pressure_pa=1.8e7)
    hunt = Hunt(1, "0", "press", limits, 3, "cause", "One cause is left after 1 experiment.", steps)
    return Hunted(hunt, diagnosis, (record,), ((planned, ran),))


def hunt(name: str, _: Path) -> str:
    """The name is that of the machine, and of the experiment and why it ended."""
    found = hunted()
    (step, last), ((planned, ran),) = found.told.steps, found.ran
    told = replace(last.experiments[0], description=name, stopped=name)
    steps = step, replace(last, experiments=(told,), sentence=name)
    return render_page(
        hunt_page(
            replace(
                found,
                told=replace(found.told, machine=name, steps=steps),
                ran=((replace(planned, description=name), replace(ran, stopped=name)),),
            )
        )
    )


class WithSeven(Target):
    """A target whose estimates have seven parameters."""

    def sample(self, packet: Any) -> bytes:
        (number,) = struct.unpack_from("<I", packet.body)
        self.expected += 1
        body = struct.pack("<I3fBBH", number, 0.0, 20.0, 0.05, 0, 0, 0)
        body += struct.pack("<5f", 0.0, 0.99, 98.5, 0.5, 1e-6) + struct.pack("<I3H", 1, 0, 0, 0)
        return encode(0x84, packet.sequence, body + struct.pack("<B7f", 7, *([0.5] * 7)))


@cache
def hil_run() -> Any:
    """A session's identity and a short run on a target that only answers."""
    rig = published_rig()
    plan: Plan = open_plan(
        rig,
        np.sin(np.arange(40.0)),
        suggested_controller(rig),
        dt_s=0.02,
        noise=np.zeros((40, 6)),
        orders=ARX,
        forgetting=ehsid.FRatio(),
        values={},
        watchdog_ms=60_000,
    )
    with relayed(FakeDevice(WithSeven())) as relay, open_line(relay.port) as line:
        session = Session(line, timeout_s=TIMEOUT_S, attempts=100)
        identity = session.hello()
        with (
            tempfile.TemporaryDirectory() as folder,
            Recording(Path(folder), OUTPUTS_OF[rig.plant], ARX) as recording,
        ):
            return identity, run_plan(plan, session, recording)


def hil(name: str, _: Path) -> str:
    """The name is that of the board, of the rig and of the run."""
    identity, run = hil_run()
    plan = replace(run.plan, rig=replace(run.plan.rig, name=name))
    run = replace(run, plan=plan)
    return render_page(hil_page(replace(identity, board=name), [(name, run, compare(run))]))


KINDS: dict[str, Make] = {
    "gap": gap,
    "fleet": fleet,
    "check": check,
    "hunt": hunt,
    "life": life,
    "calibration": calibration,
    "experiment": experiment,
    "hil": hil,
}

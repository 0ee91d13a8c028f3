# SPDX-License-Identifier: MIT
"""Computes and writes the report of `ehsid experiment`."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ehsid
from ehsid.harness.base.encoding import to_plain
from ehsid.harness.base.files import write_text
from ehsid.harness.cli.options import read_shown
from ehsid.harness.models.identification import ArxOrders, IoData, Preprocessing, fit_arx
from ehsid.harness.records import NO_HINTS, Hints, Record
from ehsid.harness.records.record import with_reading
from ehsid.harness.rigs import Rig
from ehsid.harness.show.page import Page, Picture, Section
from ehsid.harness.show.record_figure import record_figure
from ehsid.harness.show.rendering import write_page, write_pictures
from ehsid.harness.show.where_section import reading_section

from ..studies.claims import median_interval
from ..studies.experiment import (
    judge_claims,
    run_on_known_plant,
    run_on_record,
    run_on_rig,
    same_direction,
)
from ..studies.linearisation import small_signal_response
from ..studies.noises import on_noisy_sensor
from ..studies.pages.claims_sections import claims_picture, claims_sections, verdict_lead
from ..studies.pages.experiment_files import (
    claim_rows,
    csv_text,
    orders_table,
    plain_change,
    plain_runs,
    reset_rows,
)
from ..studies.pages.offline_model_blocks import outputs_picture
from ..studies.pages.offline_sections import offline_sections
from ..studies.pages.recursive_sections import known_plant_sections, record_sections, rig_sections
from ..studies.pages.sensor_section import plain_sensor, seeding_section, sensor_section
from ..studies.procedure import Procedure, run_procedure
from ..studies.recursive import noise_for_fit
from ..studies.rig_records import DT_S, ORDERS, SOURCE, rig_record
from ..studies.verdicts import Starts, compare_starts

# Seed of the record for the offline half. The runs of the recursive half have seeds from 0 on.
OFFLINE_SEED = 1000
# Factor on the load mass of the rig at half time: a second load, as heavy as the first, is added.
CHANGE_OF_MASS = 2.0
# Standard deviation of e(k) whose variance is the published loss.
LOSS_NOISE = 0.151
FILES = (
    *("experiment.html", "experiment.json", "orders.csv", "claims.csv", "resets.csv"),
    "figures/[0-9][0-9]_*.png",
)
THIRD_ORDER = ArxOrders(3, 3, 1, offset=True)


@dataclass(frozen=True, eq=False)
class Report:
    """Contents of the report: title, sentences, sections, plain values, tables by file name.

    `problems` say why the record allows no sound model; empty where it does. `picture` is the one
    above all sections.
    """

    title: str
    lead: list[str]
    sections: list[Section]
    plain: dict[str, Any]
    tables: dict[str, str]
    problems: list[str]
    picture: Picture


@dataclass(frozen=True)
class Offline:
    """Orders, delays in samples and preprocessing of the first attempt of the offline half."""

    orders: range
    delays: range
    preprocessing: Preprocessing

    def run(self, data: IoData) -> Procedure:
        """Runs the procedure of Fig. 3 of the paper."""
        return run_procedure(
            data, orders=self.orders, delays=self.delays, preprocessing=self.preprocessing
        )


def redo(rig: Rig, offline: Offline, runs: int, progress: Callable[[str, float], None]) -> Report:
    """Redoes the whole published experiment on a simulated rig."""
    record = rig_record(rig, OFFLINE_SEED)
    data = IoData.from_record(record, "command_v", "position_m")
    procedure = offline.run(data)
    amplitude = 0.5 * float(data.u.std())
    response = small_signal_response(rig, DT_S, amplitude_v=amplitude)
    noise = noise_for_fit()
    claims = judge_claims(noise, progress)
    known = run_on_known_plant(runs, claims, noise, progress)
    alike = same_direction(known)
    change = {"load.mass_kg": CHANGE_OF_MASS * rig.values["load.mass_kg"]}
    on_rig = run_on_rig(rig, record, fit_arx(data, THIRD_ORDER), change, runs, progress)
    starts: dict[float, Starts] = {}
    for level in (noise, LOSS_NOISE):
        progress("starts from the offline model", 0.5 * len(starts))
        starts[level] = compare_starts(ehsid.FRatio(), range(runs), noise=level)
    progress("noise of the position sensor", 0.0)
    noisy_sensor = on_noisy_sensor(range(runs))
    return Report(
        title="The published experiment, redone",
        lead=[
            *verdict_lead(claims.verdicts),
            f"A start at theta = 0 that is trusted, P(0) near {claims.start_of_one:.2g} I, leaves "
            "lambda = 1 an error as large as that of the paper's column, but in other parameters "
            f"(cosine of both errors {alike:.2f}): it does not explain the column.",
        ],
        sections=[
            *offline_sections(
                procedure, record_name=record.name, published=ORDERS, rig_response=response
            ),
            *known_plant_sections(known, runs),
            *rig_sections(on_rig, runs, rig.name),
            *claims_sections(claims),
            seeding_section(starts, runs),
            sensor_section(noisy_sensor, runs),
        ],
        plain={
            "offline": procedure.to_dict(),
            "known_plant": {
                "noise": known.noise,
                "loop": to_plain(known.loop),
                "runs": plain_runs(known.runs, DT_S),
                "changed": plain_change(known.changed),
            },
            "rig": {
                "name": rig.name,
                "runs": plain_runs(on_rig.runs, DT_S),
                "change": dict(change),
                "changed": plain_change(on_rig.changed),
                "reading": to_plain(on_rig.servo.rig),
                "sampled": to_plain(on_rig.servo.sampled),
            },
            "claims": [to_plain(verdict) for verdict in claims.verdicts],
            "seeded": [
                {
                    "noise": level,
                    "samples_from_nothing": to_plain(median_interval(start.settled()[1])),
                    "samples_from_the_model": to_plain(median_interval(start.settled()[0])),
                }
                for level, start in starts.items()
            ],
            "noisy_sensor": plain_sensor(noisy_sensor),
            "start_of_lambda_1": {
                "p0": claims.start_of_one,
                "error": claims.error_of_one,
                "cosine": alike,
            },
        },
        tables={
            **orders_table(procedure),
            "claims.csv": csv_text(claim_rows(claims.judged)),
            "resets.csv": csv_text(reset_rows(claims.resets)),
        },
        problems=[finding.text for finding in procedure.problems],
        picture=claims_picture(claims.judged, claims.resets, claims.verdicts),
    )


def on_record(
    path: Path,
    rig: Rig | None,
    offline: Offline,
    input_name: str,
    output_name: str,
    hints: Hints = NO_HINTS,
) -> Report:
    """Runs the offline and the recursive half of the experiment on one record.

    A record has no known truth and no other random draws, so the claims cannot be judged.
    """
    columns = [input_name, output_name]
    record = read_shown(path, hints, columns=columns, layout={} if rig is None else rig.columns)
    data = IoData.from_record(record, input_name, output_name)
    procedure = offline.run(data)
    response = None
    if rig is not None and data.dt_s is not None:
        response = small_signal_response(rig, data.dt_s, amplitude_v=0.5 * float(data.u.std()))
    sections = offline_sections(
        procedure, record_name=record.name, rig_response=response, with_outputs=False
    )
    plain = with_reading({"offline": procedure.to_dict()}, record.origin)
    problems = [finding.text for finding in procedure.problems]
    lead = [*procedure.meaning, *problems]
    if record.origin is not None:
        sections.append(reading_section(record.origin))
    model = None if procedure.kept is None else procedure.best.model
    if model is not None:
        results = run_on_record((data.u, data.y), model, data.dt_s, rig)
        sections += record_sections(results, data.dt_s, record.name)
        plain |= {
            "recursive": plain_runs(results.runs, data.dt_s or 1.0),
            "reading": None if results.servo is None else to_plain(results.servo.rig),
            "sampled": None if results.servo is None else to_plain(results.servo.sampled),
        }
    title = f"The experiment on {record.name}"
    picture = _record_picture(record) if model is None else outputs_picture(procedure)
    return Report(title, lead, sections, plain, orders_table(procedure), problems, picture)


def _record_picture(record: Record) -> Picture:
    caption = "The record, of which no model was kept."
    return Picture(record_figure(record), caption, "The signals of the record over time")


def write_report(folder: Path, report: Report, provenance: Mapping[str, Any]) -> None:
    """Writes the files `FILES`: report, JSON, CSV tables and pictures."""
    plain = {**report.plain, "problems": report.problems, "provenance": dict(provenance)}
    texts = {
        **report.tables,
        "experiment.json": json.dumps(to_plain(plain), indent=2, allow_nan=False),
    }
    page = Page(
        report.title, report.lead, report.sections, sources=[SOURCE], summary=[report.picture]
    )
    write_page(folder / "experiment.html", page)
    write_pictures(folder / "figures", page)
    for name, text in texts.items():
        write_text(folder / name, text)

# SPDX-License-Identifier: MIT
"""Renders the report of a diagnosis: one offline HTML file, verdict first, details folded."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass

import jinja2

import ehsid
from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.schema import Candidate, Diagnosis, FoundEffect
from ehsid.harness.report import gap_marks
from ehsid.harness.report.gap_plots import draw_plots
from ehsid.harness.report.gap_words import (
    SIMULATIONS,
    VERDICTS,
    effect_set,
    first_upper,
    interval,
    percent,
    percent_ends,
    percent_interval,
    plain_name,
    quantity,
    unit_of,
    value_name,
)

# Number of candidates that the page shows unfolded.
SHOWN_CANDIDATES = 8


@dataclass(frozen=True)
class RecordLine:
    """Source of a record: its name, its role in the diagnosis, its file and its SHA-256."""

    name: str
    role: str
    file: str
    sha256: str


@dataclass(frozen=True)
class EffectCard:
    """An effect that the diagnosis found, as text for the page."""

    id: str
    words: str
    subsystem: str
    probability: str
    share: str
    parameters: Sequence[tuple[str, str, str]]
    equation: str
    source: str


@dataclass(frozen=True)
class CandidateRow:
    """A candidate (a set of effects that was fitted), as text for the page."""

    words: str
    score: str
    bar: gap_marks.Bar
    sizes: str
    marked: bool


def render_diagnosis(diagnosis: Diagnosis, records: Sequence[RecordLine], rig_file: str) -> str:
    """Returns the HTML page of a diagnosis, which needs no other files.

    Parameters
    ----------
    diagnosis
        the findings to show.
    records
        all records that the diagnosis used.
    rig_file
        path of the rig file, as the page shows it and uses it in a command.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("ehsid.harness.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {
        "percent": percent,
        "percent_interval": percent_interval,
        "percent_ends": percent_ends,
        "first_upper": first_upper,
        "plain_name": plain_name,
        "effect_set": effect_set,
        "channel": lambda name: shown_channel(name)[0],
    }
    coming = diagnosis.next_experiment
    title, meaning = VERDICTS[diagnosis.verdict]
    several = diagnosis.verdict == "effects" and len(diagnosis.effects) > 1
    where = diagnosis.where
    # Without added effects there is no third simulation to show.
    kinds = tuple(SIMULATIONS)[: 3 if diagnosis.effects else 2]
    return environment.get_template("gap.html.j2").render(
        d=diagnosis,
        title="Missing effects" if several else title,
        meaning=meaning,
        kinds=[SIMULATIONS[kind] for kind in kinds],
        gap_bars=[] if diagnosis.how_far is None else gap_marks.gap_bars(diagnosis.how_far, kinds),
        plots=draw_plots(diagnosis.runs, None if coming is None else coming.record, kinds),
        subsystems=gap_marks.subsystem_bars(diagnosis),
        regimes=[
            gap_marks.share_bar(
                share.condition,
                share.share_of_gap,
                note=f"in {percent(share.share_of_time)} of the time",
            )
            for share in where.regimes
        ],
        bands=[
            gap_marks.share_bar(f"{band[0]:g} to {band[1]:g} Hz", share.share_of_gap)
            for share in where.frequency
            for band in [share.band_hz]
        ],
        stretches=gap_marks.time_stretches(where.time),
        cards=[_card(effect) for effect in diagnosis.effects],
        candidates=[_row(candidate) for candidate in diagnosis.candidates],
        shown_candidates=SHOWN_CANDIDATES,
        dots=gap_marks.parameter_dots(diagnosis, nuisances=False),
        nuisances=gap_marks.parameter_dots(diagnosis, nuisances=True),
        axis_sigmas=gap_marks.AXIS_SIGMAS,
        records=records,
        rig_file=rig_file,
        again=_again(records, rig_file),
        settings=[(name, _setting(value)) for name, value in diagnosis.settings.items()],
        version=ehsid.__version__,
    )


def _card(effect: FoundEffect) -> EffectCard:
    info = effects()[effect.id]
    meanings = {parameter.name: parameter.meaning for parameter in info.parameters}
    parameters = [
        (
            meanings.get(name, plain_name(name)),
            *interval(estimate, unit_of(ParameterKey.of_effect(effect.id, name))),
        )
        for name, estimate in effect.parameters.items()
    ]
    return EffectCard(
        effect.id,
        plain_name(effect.id),
        info.subsystem,
        percent(effect.probability),
        percent(effect.share_of_shrinkage),
        parameters,
        info.equation,
        info.source,
    )


def _row(candidate: Candidate) -> CandidateRow:
    sizes = ", ".join(
        f"{value_name(f'effects.{name}')} "
        f"{quantity(value, unit_of(f'effects.{name}'), 3)}".partition(": ")[2]
        for name, value in candidate.parameters.items()
    )
    return CandidateRow(
        effect_set(candidate.effects),
        f"{candidate.score:.1f}",
        gap_marks.share_bar("", candidate.held_out_shrinkage),
        sizes,
        candidate.in_confidence_set,
    )


def _again(records: Sequence[RecordLine], rig_file: str) -> str:
    """Returns the `ehsid gap` command that repeats the diagnosis with the next record included."""
    fitted = [record.file for record in records if record.role != "held out"]
    judged = [part for r in records if r.role == "held out" for part in ("--validate", r.file)]
    parts = ["ehsid", "gap", *fitted, "new.csv", "--rig", rig_file, *judged, "--out", "again"]
    return shlex.join(parts)


def _setting(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(str(item) for item in value) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)

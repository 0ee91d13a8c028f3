# SPDX-License-Identifier: MIT
"""Makes the page of a diagnosis: verdict first, details folded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.catalogue.parameters import effects
from ehsid.harness.gap.schema import (
    Candidate,
    Diagnosis,
    Estimate,
    FoundEffect,
    HowFar,
    NextExperiment,
    Remark,
    Where,
)
from ehsid.harness.records import Origin
from ehsid.harness.report.gap_marks import (
    gap_bars,
    share_bar,
    subsystem_bars,
    timelines,
    value_table,
)
from ehsid.harness.report.gap_plots import next_plots, run_blocks
from ehsid.harness.report.gap_words import (
    SIMULATIONS,
    STANDINGS,
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
from ehsid.harness.report.law_section import missing_law_section
from ehsid.harness.report.next_words import again_command, experiment_steps, experiment_words
from ehsid.harness.report.page import (
    Bars,
    Beside,
    Block,
    Card,
    Code,
    Folded,
    Heading,
    Items,
    KeyFigure,
    Note,
    Page,
    Section,
    Table,
    Tagged,
    render_page,
)
from ehsid.harness.report.reading_section import reading_folded
from ehsid.harness.report.unknown_input_section import unknown_input_card
from ehsid.harness.rigs.table_words import TERM_WORDS

# Number of candidates that the page shows unfolded.
SHOWN_CANDIDATES = 8


@dataclass(frozen=True)
class RecordLine:
    """Source of a record: its name, its role in the diagnosis, its file and its SHA-256.

    `origin` says how a log was read that does not follow the schema of records.
    """

    name: str
    role: str
    file: str
    sha256: str
    origin: Origin | None = None


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
    badge, meaning = VERDICTS[diagnosis.verdict]
    if diagnosis.verdict == "effects" and len(diagnosis.effects) > 1:
        badge = "Missing effects"
    serious = [_remark(remark) for remark in diagnosis.remarks if remark.serious]
    number = f"{len(records)} record{'s' if len(records) > 1 else ''}"
    # Without added effects there is no third simulation to show.
    added = bool(diagnosis.effects or diagnosis.missing_laws)
    kinds = tuple(SIMULATIONS)[: 3 if added else 2]
    sections = [
        missing_law_section(diagnosis.missing_laws),
        _signals(diagnosis, kinds),
        _where(diagnosis),
        _which(diagnosis),
        _next(diagnosis.next_experiment, records, rig_file),
        _values(diagnosis),
        _limits(diagnosis),
        _settings(diagnosis, records),
    ]
    return render_page(
        Page(
            title=diagnosis.sentence,
            lead=[Items([*serious, *diagnosis.reasons]), Note(meaning)],
            sections=[section for section in sections if section.blocks],
            overline=f"Diagnosis of the gap between {diagnosis.rig.name} and its simulation"
            + (f" · {number}" if records else ""),
            badge=badge,
            kind=diagnosis.verdict,
            summary=[] if diagnosis.how_far is None else _gap(diagnosis, diagnosis.how_far, kinds),
            footer=[f"rig file {rig_file}", f"{diagnosis.seconds:.0f} s"],
            window_title=f"{badge}: {diagnosis.rig.name}",
        )
    )


def _remark(remark: Remark) -> Tagged:
    about = f"{remark.record}: " if remark.record else ""
    return Tagged(about + remark.what, "serious" if remark.serious else "")


def _change(smaller: Estimate) -> tuple[Estimate, str]:
    """A change of the gap as a positive number, and whether it became smaller or larger."""
    if smaller.value >= 0.0:
        return smaller, "smaller"
    return Estimate(-smaller.value, -smaller.high, -smaller.low), "larger"


def _gap(diagnosis: Diagnosis, gap: HowFar, kinds: Sequence[str]) -> list[Block]:
    """Returns the gap of each simulation, how much smaller it became, and the gap by output."""
    window_s = diagnosis.settings.get("window_s", 0.5)
    outputs = ", ".join(shown_channel(name)[0] for name in diagnosis.outputs)
    change, word = _change(gap.from_nominal)
    if gap.of_explainable is not None and (diagnosis.effects or diagnosis.missing_laws):
        ends = f"90 % interval for other motions: {percent_ends(gap.of_explainable)}"
        if gap.of_explainable.high > 1.0:
            ends += "; beyond 100 % the noise is smaller than was estimated"
        key = KeyFigure(
            percent(min(gap.of_explainable.value, 1.0)),
            "of the gap that remained after the rig's values were fitted is removed by the added "
            f"{_added(diagnosis)}; the noise floor is not counted",
            ends,
        )
    else:
        key = KeyFigure(
            percent(change.value),
            f"{word} than the gap of the simulator as configured",
            f"90 % interval: {percent_ends(change)}",
        )
    details: list[Block] = [
        Table(
            "",
            ("output", *(SIMULATIONS[kind] for kind in kinds)),
            [
                (shown_channel(name)[0], *map(percent, gaps[: len(kinds)]))
                for name, gaps in gap.per_output.items()
            ],
        ),
        "Compared with the simulator as configured, the gap of the last simulation is "
        f"{word} by {percent_interval(change)}.",
    ]
    if gap.carries_over is not None:
        small, large = map(percent, gap.carries_over)
        details.append(
            f"In held-out windows with small commands the added effects remove {small} of the gap "
            f"above the noise floor, in windows with large commands {large}. A wrong cause rarely "
            "helps at both."
        )
    if diagnosis.outputs_left_out:
        left_out = ", ".join(shown_channel(name)[0] for name in diagnosis.outputs_left_out)
        details.append(
            f"Not compared, because what they show within a window is noise: {left_out}."
        )
    meaning = Note(
        "Error on held-out data as a share of how much the signals move within "
        f"{window_s:g} s, mean of {outputs}. Below the noise floor nothing can be explained. In "
        "the files the simulations are called nominal, calibrated and augmented."
    )
    bars = Bars("gap on held-out data", gap_bars(gap, kinds))
    return [
        Beside([[bars, meaning], [key]]),
        Folded("By output, and whether it carries over", details),
    ]


def _added(diagnosis: Diagnosis) -> str:
    """Names what the last simulation has besides fitted values."""
    laws = "law" if len(diagnosis.missing_laws) == 1 else "laws"
    names = [
        name
        for name, any_ in (("effects", diagnosis.effects), (laws, diagnosis.missing_laws))
        if any_
    ]
    return " and ".join(names)


def _signals(diagnosis: Diagnosis, kinds: Sequence[str]) -> Section:
    plots = run_blocks(diagnosis.runs, kinds)
    stretches = " in these stretches" if "fit and held out" in diagnosis.records.values() else ""
    text = (
        f"Held-out data, which no fit has seen{stretches}. In each window the position starts "
        "where it was measured and then follows the logged command alone, so the curves begin anew "
        "there. Drag over a stretch to zoom, click a name above a plot to hide its curve; the "
        "tools appear at the right of a plot."
    )
    return Section("Measured and simulated", [text, *plots] if plots else [])


def _where(diagnosis: Diagnosis) -> Section:
    where = diagnosis.where
    regimes = [
        share_bar(
            share.condition,
            share.share_of_gap,
            note=f"in {percent(share.share_of_time)} of the time",
        )
        for share in where.regimes
    ]
    bands = [
        share_bar(f"{share.band_hz[0]:g} to {share.band_hz[1]:g} Hz", share.share_of_gap)
        for share in where.frequency
    ]
    groups: list[list[Block]] = []
    if where.subsystem:
        bars = Bars("shares by part of the machine", subsystem_bars(diagnosis))
        groups.append([Heading("Part of the machine"), bars])
    if regimes:
        note = Note("Regimes overlap: their shares need not add up.")
        groups.append([Heading("Way of running"), Bars("shares by regime", regimes), note])
    if bands:
        groups.append([Heading("Frequency"), Bars("shares by frequency", bands)])
    if where.time:
        groups.append([Heading("Time"), *timelines(where.time)])
    if not groups and not where.equations:
        return Section("Where the gap lies", [])
    blocks: list[Block] = [
        "Shares of what remains after the values of the rig have been fitted, above the noise. "
        "Whiskers are intervals of 90 %.",
        Beside(groups),
    ]
    if where.equations:
        blocks.append(Folded("What each equation of the simulator lacks", _equations(where)))
    return Section("Where the gap lies", [*blocks, *where.notes])


def _equations(where: Where) -> list[Block]:
    table = Table(
        "To one equation at a time, terms of free form were added and fitted through the simulator "
        "together with all values of the rig, without any effect of the catalogue. The gain is the "
        "logarithm of the evidence, in nats: what differs by less than about ten is alike.",
        ("term", "part", "share", "gain"),
        [
            (
                first_upper(TERM_WORDS[row.equation]),
                row.subsystem,
                percent(row.share),
                f"{row.gain:.0f}",
            )
            for row in where.equations
        ],
        [i for i, row in enumerate(where.equations) if row.unknown_input is not None],
    )
    cards = [
        unknown_input_card(row.unknown_input)
        for row in where.equations
        if row.unknown_input is not None
    ]
    return [table, *cards]


def _which(diagnosis: Diagnosis) -> Section:
    blocks: list[Block] = []
    several = len(diagnosis.ambiguity_set) > 1
    if several:
        sets = [effect_set(names) for names in diagnosis.ambiguity_set]
        blocks += [
            "The data cannot tell these apart, best first:",
            Items(sets, numbered=True),
        ]
    blocks += [
        _card(effect, several=several, shared=len(diagnosis.effects) > 1)
        for effect in diagnosis.effects
    ]
    if diagnosis.candidates:
        rest = len(diagnosis.candidates) - SHOWN_CANDIDATES
        blocks += [
            Heading("All that was tried, ranked on held-out data"),
            _candidates(diagnosis.candidates, 0, SHOWN_CANDIDATES),
        ]
        if rest > 0:
            table = _candidates(diagnosis.candidates, SHOWN_CANDIDATES, None)
            blocks.append(Folded(f"{rest} more", [table]))
        blocks.append(
            Note(
                "Every set was fitted together with all values of the rig, with the same budget. "
                '"Behind" is the held-out log-likelihood below that of the first, in nats. "Gap '
                'removed" is the share of the gap above the noise floor that remained after the '
                "rig's values were fitted. Marked sets are those the data cannot tell from the "
                "best."
            )
        )
    if diagnosis.outside_probability is not None:
        blocks.append(
            Note(
                "Probability of a cause outside of the catalogue: "
                f"{percent(diagnosis.outside_probability)}."
            )
        )
    return Section("Which effect", blocks)


def _card(effect: FoundEffect, *, several: bool, shared: bool) -> Card:
    info = effects()[effect.id]
    meanings = {parameter.name: parameter.meaning for parameter in info.parameters}
    notes = [
        *(["most probable of the set"] if several else []),
        info.subsystem,
        effect.id,
        f"probability {percent(effect.probability)}",
        *([f"{percent(effect.share_of_shrinkage)} of the gain"] if shared else []),
    ]
    sizes = Table(
        "",
        ("size", "estimate", "90 % interval"),
        [
            (
                meanings.get(name, plain_name(name)),
                *interval(estimate, unit_of(ParameterKey.of_effect(effect.id, name))),
            )
            for name, estimate in effect.parameters.items()
        ],
    )
    source = [Note(info.source)] if info.source else []
    equation = Folded("Equation", [Code(info.equation), *source])
    return Card(plain_name(effect.id), [Note(" · ".join(notes)), sizes, equation])


def _candidates(candidates: Sequence[Candidate], first: int, end: int | None) -> Table:
    rows = [
        (
            Tagged(
                f"{rank}. {effect_set(candidate.effects)}",
                STANDINGS[candidate.standing.kind] if candidate.in_confidence_set else "",
            ),
            f"{candidate.score:.1f}",
            share_bar("", candidate.held_out_shrinkage),
            "" if candidate.probability is None else percent(candidate.probability),
            ", ".join(
                f"{value_name(f'effects.{name}')} "
                f"{quantity(value, unit_of(f'effects.{name}'), 3)}".partition(": ")[2]
                for name, value in candidate.parameters.items()
            ),
            _decision(candidate),
        )
        for rank, candidate in enumerate(candidates[first:end], start=first + 1)
    ]
    marked = [i for i, candidate in enumerate(candidates[first:end]) if candidate.in_confidence_set]
    columns = ("effects", "behind", "gap removed", "probability", "sizes", "decision")
    return Table("", columns, rows, marked)


def _decision(candidate: Candidate) -> str:
    standing = candidate.standing
    return ": ".join(filter(None, (STANDINGS[standing.kind], standing.why)))


def _next(coming: NextExperiment | None, records: Sequence[RecordLine], rig_file: str) -> Section:
    title = "The next experiment"
    if coming is None:
        return Section(title, [])
    fitted = [record.file for record in records if record.role != "held out"]
    judged = [record.file for record in records if record.role == "held out"]
    return Section(
        title,
        [
            experiment_words(coming.description, coming.separates, coming.power),
            *next_plots(coming.record),
            Items(
                [
                    *experiment_steps(coming.sensors),
                    "Diagnose again with the new record beside the old ones:",
                ],
                numbered=True,
            ),
            Code(again_command(fitted, judged, rig_file)),
        ],
    )


def _values(diagnosis: Diagnosis) -> Section:
    values = value_table(diagnosis, nuisances=False)
    nuisances = value_table(diagnosis, nuisances=True)
    blocks: list[Block] = []
    if values.rows:
        blocks += [
            "What the fit makes of the numbers in the rig file. The grey band is one standard "
            "deviation of what was known before; a value is marked where its move matters in size "
            "and cannot be chance.",
            values,
        ]
    if nuisances.rows:
        text = (
            "Every real servo has these; they are fitted inside bounds so that they do not come "
            "back as effects."
        )
        title = f"What no data sheet states ({len(nuisances.rows)})"
        blocks.append(Folded(title, [text, nuisances], unfolded=not values.rows))
    return Section("Values of the rig", blocks)


def _limits(diagnosis: Diagnosis) -> Section:
    blocks: list[Block] = ["Every effect of the catalogue would have shown in these records."]
    if diagnosis.cannot_judge:
        rows = [(plain_name(effect.id), effect.why) for effect in diagnosis.cannot_judge]
        blocks = [
            "These effects may be there or not: the records do not show. Not judged does not mean "
            "absent.",
            Table("", ("effect", "why"), rows),
        ]
    if diagnosis.remarks:
        blocks += [Heading("About the records"), Items([*map(_remark, diagnosis.remarks)])]
    return Section("What could not be judged", blocks)


def _settings(diagnosis: Diagnosis, records: Sequence[RecordLine]) -> Section:
    files = [
        ("diagnosis.json", "All of this as data."),
        (
            "simulation.csv",
            "Held-out data beside the three simulations, so that anyone can recompute the gap.",
        ),
        (
            "rig.augmented.toml",
            "The rig with the estimated values and effects; this command runs it: ehsid simulate "
            "rig.augmented.toml --command RECORD",
        ),
    ]
    if diagnosis.next_experiment is not None:
        files.append(("next_experiment.csv", "The command to be sent next."))
    settings = [(name, _setting(value)) for name, value in diagnosis.settings.items()]
    return Section(
        "Records and settings",
        [
            Table(
                "",
                ("record", "role", "file", "SHA-256"),
                [(record.name, record.role, record.file, record.sha256) for record in records],
            ),
            *(reading_folded(one.name, one.origin) for one in records if one.origin is not None),
            Folded("Settings", [Table("", ("setting", "value"), settings)]),
            Folded("Files beside this page", [Table("", ("file", "contents"), files)]),
        ],
    )


def _setting(value: object) -> str:
    if isinstance(value, list | tuple):
        return ", ".join(str(item) for item in value) or "none"
    return f"{value:g}" if isinstance(value, float) else str(value)

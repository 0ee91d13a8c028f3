# SPDX-License-Identifier: MIT
"""Gap: the diagnosis, with a time to go and to be cancelled, its signals, and its report.

A diagnosis at work shows what it knows so far: its stages, the gap, the sets ahead, the signals.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import panel as pn

from ehsid.harness.base.encoding import read_json
from ehsid.harness.catalogue.channels import shown_channel
from ehsid.harness.diagnosis import STAGES, in_words
from ehsid.harness.show.gap_words import first_upper
from ehsid.harness.show.page import Bar, Table, whole
from ehsid.harness.show.units import percent

from .. import look
from ..downsampling import opened
from ..flow import step_states
from ..plots import Line, Panel, Stack, stacked
from ..so_far import ERROR, FOUND, TIME, Run, SoFar, found_runs, key, latest
from .step import StepView, progress

FILE_WORDS = {
    "report.html": "report, to be sent and read without ehsid",
    "diagnosis.json": "all numbers",
    "simulation.csv": "measured and simulated, sample by sample",
    "rig.augmented.toml": "rig file with the values and effects that were found",
    "next_experiment.csv": "command of the next experiment",
}
REPORT, SETS = "Report", "Sets tried"  # sheets beside those of the signals
AT_WORK = {"calibrated": "values fitted", "augmented": "set that is ahead"}
AT_THE_END = {"nominal": "as configured", "calibrated": "values fitted", "augmented": "as found"}
SOMETIMES = ("together", "laws", "where", "experiment")  # stages that need not take place
BARS = {"nominal": "as configured", **AT_WORK, "floor": "noise floor"}


class Sentence(msgspec.Struct):
    """What the page itself reads of a diagnosis."""

    sentence: str = ""


class GapStep(StepView):
    """The page of the step."""

    def __init__(self, page: Any) -> None:
        super().__init__(page)
        self._start = self.button("Start the diagnosis", primary=True)
        self._start.on_click(page.told(lambda event: self.workbench.diagnose(self.session)))
        self._cancel, self._status = self.follow("gap")
        self._plan, self._result, self._known, self._sets, self._report = (
            look.words("") for _ in range(5)
        )
        self._signals = Signals(page.theme)
        self._sheets = look.Switch(self._turn)
        self._at_work = False
        work = [
            self._plan,
            pn.Row(self._start, self._cancel),
            self._status,
            self._result,
            self._known,
        ]
        shown = [self._sheets.layout, self._signals.layout, self._sets, self._report]
        self.layout.objects = [look.panes(work, shown, (2, 5))]

    def refresh(self) -> None:
        """Shows how the diagnosis goes, and what it found."""
        job = self.workbench.job(self.session, "gap")
        running = job is not None and job.running
        state = step_states(self.session)["gap"]
        self._start.disabled = running
        self._start.name = "Start the diagnosis again" if state.done else "Start the diagnosis"
        self._cancel.visible = running
        self._status.object = progress(job)
        entries = self.session.settings.records
        fitted = [entry.id for entry in entries if not entry.held_out]
        held_out = [entry.id for entry in entries if entry.held_out]
        judged = f"judged by {', '.join(held_out)}" if held_out else "judged by blocks held out"
        self._plan.object = (
            f"<p>Fitted: {look.plain(', '.join(fitted))}; {look.plain(judged)}. "
            '<span class="soft">It takes minutes. The page may be closed or reloaded meanwhile.'
            "</span></p>"
        )
        if running != self._at_work:
            self._at_work, self._sheets.chosen = running, ""
        if running:
            self._show_so_far()
        else:
            self._show_found(state.why)

    def _turn(self) -> None:
        """Shows the sheet that was chosen."""
        chosen = self._sheets.chosen
        self._sets.visible, self._report.visible = chosen == SETS, chosen == REPORT
        self._signals.choose(chosen)

    def _show_so_far(self) -> None:
        found = latest(self.session.folder)
        _set(self._result, "")
        _set(self._report, "")
        _set(self._known, "" if found is None else _words(found[1]))
        _set(self._sets, "" if found is None else _tried(found[1]))
        names: list[str] = []
        if found is not None and found[1].stage != "values":
            folder, known = found
            kinds = dict(list(AT_WORK.items())[: 2 if known.ahead else 1])
            names = [
                *self._signals.show(folder, known.runs, kinds),
                *([SETS] if known.sets else []),
            ]
        self._sheets.offer(names)

    def _show_found(self, why: str) -> None:
        folder = self.session.folder / "gap"
        found = read_json(folder / "diagnosis.json", Sentence)
        for part in (self._known, self._sets):
            _set(part, "")
        if found is None:
            _set(self._result, "")
            _set(self._report, "")
            self._sheets.offer([])
            return
        stale = f'<p class="bad">{look.plain(why)}</p>' if why else ""
        address = f"/result/{self.session.name}/gap"
        there = {name: one for name, one in FILE_WORDS.items() if (folder / name).exists()}
        stamp = (folder / "diagnosis.json").stat().st_mtime_ns
        _set(
            self._result,
            f'{stale}<p class="verdict">{look.plain(whole(found.sentence))}</p>'
            f"{look.files(address, there)}",
        )
        _set(
            self._report,
            f'<iframe src="{address}/report.html?made={stamp}" title="Report of the diagnosis">'
            "</iframe>",
        )
        runs = found_runs(self.session.folder)
        drawn = self._signals.show(self.session.folder / FOUND, runs, AT_THE_END, stamp)
        self._sheets.offer([REPORT, *drawn])


def _set(part: pn.pane.HTML, html: str) -> None:
    """Shows HTML; what is shown already stays as it is, with the place that is read."""
    if part.object != html:
        part.object = html


class Signals:
    """Plots of the first held-out record: each output, and below it what simulations miss of it.

    One output is shown at a time. All have one time axis and one cursor, so that the range that
    is looked at stays when another one is chosen.
    """

    def __init__(self, theme: str) -> None:
        self._theme = theme
        self.layout = pn.Column(sizing_mode="stretch_width")
        self._made: object = None
        self._names: list[str] = []
        self._chosen = ""
        self._stack: Stack | None = None

    def show(
        self, folder: Path, runs: Sequence[Run], kinds: Mapping[str, str], stamp: int = 0
    ) -> list[str]:
        """Draws the signals of a folder where they are new, and returns the names of the outputs.

        Parameters
        ----------
        folder
            with the signals.
        runs
            what is there.
        kinds
            words of the simulations that are drawn.
        stamp
            of another run whose signals are in the same folder.
        """
        made = (folder, stamp) if runs else None
        if made != self._made:
            self._made = made
            before, self._stack = self._stack, self._drawn(folder, runs, kinds) if runs else None
            if before is not None and self._stack is not None:  # the range that is looked at stays
                seen = before.plots[0].x_range
                self._stack.plots[0].x_range.update(start=seen.start, end=seen.end)
            self._turn()  # before they are on the page: else all of them are seen for a moment
            self.layout.objects = [] if self._stack is None else [self._stack.layout]
        return self._names if runs else []

    def choose(self, name: str) -> None:
        """Shows an output; nothing for another name."""
        self._chosen = name
        self.layout.visible = name in self._names
        self._turn()

    def _turn(self) -> None:
        """Shows the two plots of the chosen output, else those of the first one."""
        chosen = self._chosen if self._chosen in self._names else next(iter(self._names), "")
        for number, plot in enumerate(self._stack.plots if self._stack else ()):
            plot.visible = self._names[number // 2] == chosen

    def _drawn(self, folder: Path, runs: Sequence[Run], kinds: Mapping[str, str]) -> Stack:
        panels = []
        self._names = []
        for place, output in enumerate(runs[0].outputs):
            words, factor, unit = shown_channel(output)
            self._names.append(first_upper(words))

            def line(kind: str, words: str, place: int = place, factor: float = factor) -> Line:
                role = kind.removesuffix(ERROR)
                return Line(words, opened(folder, key(0, place, kind)), factor, role=role)

            simulated = [line(kind, of) for kind, of in kinds.items()]
            errors = [line(kind + ERROR, of) for kind, of in kinds.items()]
            panels.append(Panel(f"{words} in {unit}", [line("measured", "measured"), *simulated]))
            panels.append(Panel(f"error in {unit}", errors))
        time_s = np.load(folder / f"0_{TIME}.npy")
        axis = f"time in s, held-out data of {runs[0].record}; error: simulated minus measured"
        return stacked(panels, time_s, self._theme, axis, [2] * len(self._names))


def _words(known: SoFar) -> str:
    """Returns stages and gaps as HTML."""
    past = dict.fromkeys(known.past)
    stages = "".join(
        f"<li>{'▸ <b>' if stage == known.stage else '✓ ' if stage in past else ''}{words}"
        f"{'</b>' if stage == known.stage else ''}</li>"
        for stage, words in STAGES.items()
        if stage == known.stage or stage in past or stage not in SOMETIMES
    )
    html = f'<ul class="stages">{stages}</ul>'
    if known.stage == "values":
        return html
    gaps = {kind: getattr(known, kind) for kind in BARS}
    if known.stage == "alone":
        del gaps["augmented"]
    html += f"<b>Gap on held-out data, so far</b>{look.told(_bars(gaps))}"
    return html + '<p class="soft">Not a result yet: what has more values always leaves less.</p>'


def _tried(known: SoFar) -> str:
    """Returns the best sets as HTML."""
    rows = [(first_upper(in_words(ids)), _percent(gap)) for ids, gap in known.sets]
    headings = ("sets that were tried, so far", "gap that is left")
    return look.told(Table("", headings, rows)) if rows else ""


def _bars(gaps: dict[str, float | None]) -> Table:
    largest = max((gap for gap in gaps.values() if gap is not None), default=0.0) or 1.0
    rows = [
        (BARS[kind], Bar("", _percent(gap), 100.0 * (gap or 0.0) / largest))
        for kind, gap in gaps.items()
    ]
    return Table("", ("simulation", "gap"), rows)


def _percent(gap: float | None) -> str:
    return "diverges" if gap is None else percent(gap)

# SPDX-License-Identifier: MIT
"""The part of the playground that hides an effect, asks for a guess, and shows the truth.

The way of a lesson: its records are read and checked, a guess is made, the diagnosis runs.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Any

import panel as pn

from ehsid.harness.base.files import write_text
from ehsid.harness.catalogue.parameters import plain_name, size_name
from ehsid.harness.catalogue.spellings import ParameterKey
from ehsid.harness.diagnosis.schema import DiagnosisFile, read_diagnosis_file
from ehsid.harness.rigs import read_rig, rig_text
from ehsid.harness.show.gap_words import effect_set, first_upper, interval, quantity, unit_of
from ehsid.harness.show.page import Table, Tagged, whole

from . import look
from .flow import step_states
from .lesson import Lesson, candidates, guessed, lesson_of, truth
from .page import View
from .playground_rigs import chosen_rig
from .session import Session
from .steps.step import progress
from .workbench import Workbench


class Stage(StrEnum):
    """Where a lesson is."""

    preparing = "preparing"
    guess = "guess"
    diagnosing = "diagnosing"
    stopped = "stopped"
    found = "found"
    broken = "broken"


def lessons(workbench: Workbench) -> list[str]:
    """Returns the names of the sessions that are lessons, the one that was changed last first."""
    return [
        name for name in workbench.names() if (workbench.folder / name / "lesson.json").is_file()
    ]


def advance(workbench: Workbench, session: Session) -> Stage:
    """Starts what comes next in a lesson, with the same work as the steps; returns its stage.

    `stopped` is a diagnosis that was cancelled or lost, `broken` a session whose records or rig
    someone has changed so that they cannot be checked.
    """
    lesson = lesson_of(session)
    if lesson is None:
        return Stage.broken
    if not session.settings.records:
        for path in sorted((session.folder / "logs").glob("*.csv")):
            workbench.read(session, session.add(path))
    if workbench.is_reading(session):
        return Stage.preparing
    found = step_states(session)
    if not found["check"].open:
        return Stage.broken
    if found["gap"].done:
        return Stage.found if lesson.guess else Stage.guess
    check, gap = workbench.job(session, "check"), workbench.job(session, "gap")
    if not found["check"].done:
        if check is None:
            workbench.check(session)
        elif not check.running:
            return Stage.broken
        return Stage.preparing
    if gap is not None and gap.running:
        return Stage.diagnosing
    if not lesson.guess:
        return Stage.guess
    if gap is None:
        workbench.diagnose(session)
        return Stage.diagnosing
    return Stage.stopped


LOOK_MS = 1000  # between two looks at the work
WHY = (
    "<h2>Hide an effect and let the diagnosis find it</h2><p>An effect and its sizes are drawn at "
    "random and built into a machine with the rig that is chosen above. You get three logs of it, "
    "with sensor noise. Look at them as at those of any machine, guess, and see whether the "
    "diagnosis finds the effect.</p>"
)
NO_IDEA = "I have no idea"


class LessonPart:
    """Buttons, progress and outcome. `rig_title` is the field in which a rig is chosen."""

    def __init__(self, view: View, rig_title: pn.widgets.Select) -> None:
        self._view, self._workbench, self._rig_title = view, view.workbench, rig_title
        self._hide = view.button("Hide an effect")
        self._hide.on_click(view.told(self._begin))
        self._which = look.select("lesson", width=200)
        self._which.param.watch(view.told(lambda event: self.refresh()), "value")
        self._told, self._status, self._outcome = (look.words("") for _ in range(3))
        self._guess = look.select("your guess", width=290)
        self._find = view.button("Guess, and start the diagnosis", primary=True)
        self._find.on_click(view.told(self._answer))
        self._again = view.button("Start the diagnosis again")
        self._again.on_click(view.told(lambda event: self._diagnose()))
        self._cancel = view.button("Cancel")
        self._cancel.on_click(view.told(self._end))
        self._hiding: Session | None = None
        self.layout = pn.Column(
            look.words(WHY),
            pn.FlexBox(self._hide, self._which, align_items="end"),
            self._told,
            pn.FlexBox(self._guess, self._find, align_items="end"),
            self._status,
            pn.FlexBox(self._again, self._cancel),
            self._outcome,
            sizing_mode="stretch_width",
        )
        look_again = view.told(self.refresh, keep=True)
        look_again()
        pn.state.add_periodic_callback(look_again, period=LOOK_MS)

    def _begin(self, _event: Any) -> None:
        rig = chosen_rig(self._workbench, str(self._rig_title.value))
        if rig.plant != "ehs":
            raise ValueError(
                f"{rig.name}: a lesson needs a hydraulic rig: expected one with valve and "
                "cylinder; choose another rig above"
            )
        self._hiding = self._workbench.begun("lesson")
        write_text(self._hiding.rig_file, rig_text(rig))
        self._workbench.hide(self._hiding)
        self.refresh()

    def _answer(self, _event: Any) -> None:
        guessed(self._chosen(), self._guess.value)
        self.refresh()

    def _diagnose(self) -> None:
        self._workbench.diagnose(self._chosen())
        self.refresh()

    def _end(self, _event: Any) -> None:
        self._workbench.cancel(self._chosen(), "gap")
        self.refresh()

    def _chosen(self) -> Session:
        return self._workbench.opened(self._which.value)

    def refresh(self) -> None:
        """Starts what comes next, and shows where the lesson is."""
        names = lessons(self._workbench)
        hiding = self._hiding
        job = None if hiding is None else self._workbench.job(hiding, "lesson")
        if hiding is not None and hiding.name in names:
            self._hiding = None
        chosen = hiding.name if hiding is not None and hiding.name in names else self._which.value
        if sorted(names) != self._which.options:
            self._which.options = sorted(names)
        if names:
            self._which.value = chosen if chosen in names else names[0]
        self._which.visible = len(names) > 1
        self._hide.disabled = job is not None and job.running
        if job is not None and (job.running or job.message):
            self._show(None, progress(job))
        elif names:
            self._show_stage(self._chosen())
        else:
            self._show(None, "")

    def _show_stage(self, session: Session) -> None:
        stage = advance(self._workbench, session)
        key = "check" if stage in (Stage.preparing, Stage.broken) else "gap"
        job = self._workbench.job(session, key)
        status = progress(job)
        if stage is Stage.preparing and not status:
            status = '<p role="status">The logs are read.</p>'
        if stage is Stage.broken and not status:
            status = look.error(
                f"{session.name}: this lesson cannot go on, because its records or its rig were "
                "changed: expected them as they were made; hide another effect"
            )
        if stage is Stage.guess and not self._guess.options:
            options = {
                first_upper(plain_name(effect.id)): effect.id
                for effect in candidates(read_rig(session.rig_file))
            }
            self._guess.options = {NO_IDEA: "none", **dict(sorted(options.items()))}
        self._show(stage, status, session)

    def _show(self, stage: Stage | None, status: str, session: Session | None = None) -> None:
        """Shows the parts that belong to a stage; None: there is no lesson yet."""
        self._guess.visible = self._find.visible = stage is Stage.guess
        self._again.visible = stage is Stage.stopped
        self._cancel.visible = stage is Stage.diagnosing
        self._set(self._status, status)
        told, outcome = "", ""
        if session is not None and stage is not None:
            link = f"/?session={session.name}&amp;theme={self._view.theme}"
            told = (
                f"<p><b>{session.name}</b>: an effect is hidden in this machine. "
                f'<a href="{link}&amp;step=map" target="_blank">Look at its records</a></p>'
            )
            lesson = lesson_of(session)
            if stage is Stage.found and lesson is not None:
                outcome = outcome_html(session, lesson)
        self._set(self._told, told)
        self._set(self._outcome, outcome)

    @staticmethod
    def _set(part: pn.pane.HTML, html: str) -> None:
        if part.object != html:
            part.object = html


def outcome_html(session: Session, lesson: Lesson) -> str:
    """Returns the outcome of a lesson whose diagnosis holds, as HTML."""
    found = read_diagnosis_file(session.folder / "gap" / "diagnosis.json")
    effect, sizes = truth(read_rig(session.rig_file), lesson.seed)
    sizes_told = [
        f"{size_name(key)}: {quantity(size, unit_of(key), 3)}" for key, size in sizes.items()
    ]
    rows: list[tuple[str | Tagged, ...]] = [
        ("your guess", _marked(_guess(lesson), lesson.guess == effect), ""),
        ("the diagnosis", _marked(named(found), is_found(found, effect)), _found_sizes(found)),
        ("the truth", first_upper(plain_name(effect)), "; ".join(sizes_told)),
    ]
    report = f"/result/{session.name}/gap/report.html"
    return (
        f'<p class="verdict">{look.plain(whole(found.sentence))}</p>'
        + look.told(Table("", ("", "effect", "size (interval of 90 %)"), rows))
        + f'<p class="soft">Seed of this lesson: {lesson.seed}. '
        f'<a href="{report}" target="_blank">Report of the diagnosis</a></p>'
    )


def named(found: DiagnosisFile) -> str:
    """Returns in words what a diagnosis names as the cause."""
    sets = found.which.ambiguity_set if found.verdict == "ambiguous" else ()
    if sets:
        return " or ".join(map(effect_set, sets))
    return effect_set(tuple(effect.id for effect in found.which.effects))


def is_found(found: DiagnosisFile, effect: str) -> bool | None:
    """Whether a diagnosis names just this effect; None where it is one of several answers."""
    ids = [one.id for one in found.which.effects]
    if found.verdict == "ambiguous" and (effect,) in found.which.ambiguity_set:
        return None
    if ids == [effect]:
        return True
    return None if effect in ids else False


def _guess(lesson: Lesson) -> str:
    return "no idea" if lesson.guess == "none" else plain_name(lesson.guess)


def _marked(words: str, right: bool | None) -> Tagged:
    text = first_upper(words)
    if right is None:
        return Tagged(f"≈ {text}: among others", kind="soft")
    return Tagged(f"✓ {text}", kind="good") if right else Tagged(f"✗ {text}", kind="bad")


def _found_sizes(found: DiagnosisFile) -> str:
    lines = []
    for effect in found.which.effects:
        for name, size in effect.parameters.items():
            key = ParameterKey.of_effect(effect.id, name)
            value, ends = interval(size, unit_of(key))
            lines.append(f"{size_name(key)}: {value} ({ends})")
    return "; ".join(lines)

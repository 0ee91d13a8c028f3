# SPDX-License-Identifier: MIT
"""The steps of the workbench, and what opens each: a step opens when the one before holds."""

from __future__ import annotations

from dataclasses import dataclass

from ehsid.harness.catalogue.channels import COMMAND, POSITION
from ehsid.harness.rigs import RigError, read_rig

from .reading import reading_of
from .session import Session

IDENTIFIED = "model/identify.json"


@dataclass(frozen=True)
class Step:
    """A step: its key and title, what it is for in one sentence, and whether it may be left out."""

    key: str
    title: str
    purpose: str
    optional: bool = False


STEPS = (
    Step("load", "Load", "Bring the logs of one machine, as they are."),
    Step("map", "Map", "See which column was taken for which signal, and correct it."),
    Step("rig", "Rig", "Describe the machine: cylinder, valve, supply and load."),
    Step("check", "Check", "See what these records can show, before anything is fitted."),
    Step("model", "Model", "Fit a linear model, and run the estimator of the firmware.", True),
    Step("gap", "Gap", "Find where simulation and machine disagree, and which effect causes it."),
    Step("next", "Next", "Use what was found: experiment, rig file, firmware header, report."),
)


@dataclass(frozen=True)
class StepState:
    """Where a step stands."""

    open: bool
    """Whether it can be entered."""
    done: bool
    """Whether its result holds."""
    why: str = ""
    """Why it is not open, or what its result lacks; "" where all is well."""


def step_states(session: Session) -> dict[str, StepState]:
    """Returns where each step stands, by its key; a step that may be left out opens the next."""
    found: dict[str, StepState] = {}
    before = ""
    for step in STEPS:
        if before:
            found[step.key] = StepState(False, False, before)
            continue
        lacks = _LACKS[step.key](session)
        found[step.key] = StepState(True, not lacks, lacks)
        before = f"{step.title} comes first: {lacks}" if lacks and not step.optional else ""
    return found


def next_step(session: Session) -> str:
    """Returns the key of the first needed step whose result does not hold, else of the last one."""
    found = step_states(session)
    needed = (step.key for step in STEPS if not step.optional)
    return next((key for key in needed if not found[key].done), STEPS[-1].key)


def _load_lacks(session: Session) -> str:
    if not session.settings.records:
        return "there is no record yet."
    unread = [one.id for one in session.settings.records if reading_of(session, one) is None]
    return f"{', '.join(unread)} is not read yet." if unread else ""


def _map_lacks(session: Session) -> str:
    for entry in session.settings.records:
        reading = reading_of(session, entry)
        if reading is None or reading.told != entry.told():
            return f"{entry.id} is not read yet."
        if reading.problem:
            return f"{entry.id} could not be read as a record."
        for channel, words in ((COMMAND, "command"), (POSITION, "position")):
            if channel not in reading.channels:
                return f"the {words} of {entry.id} is not known."
        if reading.dt_s is None:
            return f"the sampling time of {entry.id} is not known."
    if all(entry.held_out for entry in session.settings.records):
        return "every record is held out; at least one has to be fitted."
    return ""


def _rig_lacks(session: Session) -> str:
    if not session.rig_file.exists():
        return "the machine is not described yet."
    try:
        read_rig(session.rig_file)
    except RigError as error:
        return str(error)
    return ""


def _check_lacks(session: Session) -> str:
    return _result_lacks(session, "check", "check/rig_check.json")


def _model_lacks(session: Session) -> str:
    if not (session.folder / IDENTIFIED).exists():
        return "no model was identified yet."
    if session.settings.made_of.get("identify") != session.made_from("identify"):
        return "the record or the choices have changed since; identify again."
    return ""


def _gap_lacks(session: Session) -> str:
    return _result_lacks(session, "gap", "gap/diagnosis.json")


def _next_lacks(session: Session) -> str:
    del session  # all that it offers is there as soon as the diagnosis holds
    return ""


def _result_lacks(session: Session, key: str, file: str) -> str:
    if not (session.folder / file).exists():
        return "it was not run yet."
    if session.settings.made_of.get(key) != session.digest(rig=True):
        return "records or rig have changed since; run it again."
    return ""


_LACKS = {
    "load": _load_lacks,
    "map": _map_lacks,
    "rig": _rig_lacks,
    "check": _check_lacks,
    "model": _model_lacks,
    "gap": _gap_lacks,
    "next": _next_lacks,
}

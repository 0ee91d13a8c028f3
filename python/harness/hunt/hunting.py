# SPDX-License-Identifier: MIT
"""Diagnoses, runs the experiment that tells most, and diagnoses again, until one cause is left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

import ehsid

from ..base.parallel import Progress, part_of
from ..catalogue.channels import COMMAND, POSITION
from ..diagnosis import Diagnosis, Limits, diagnose, limits_of
from ..diagnosis.next_experiment import simulate_experiment
from ..diagnosis.options import DEFAULTS, DiagnosisOptions
from ..diagnosis.schema import Verdict
from ..records import Record
from ..rigs import Rig
from ..signals.excitation.menu import MENU
from .machines import Machine
from .running import LEAST_S, Experiment, Ran, run_experiment

# An experiment of which less is expected is not run.
LEAST_POWER = 0.1
# The same experiment, with new noise, is run so often at most.
MOST_REPEATS = 2
# Sizes of the first look, as shares of that of the menu: the largest one inside the limits is run.
LOOKS = (1.0, 0.5, 0.25, 0.12)
# Verdicts after which an experiment may tell more.
OPEN = ("ambiguous", "insufficient_data", "outside_catalogue")
# Sampling time of the experiments where no record tells that of the machine, s.
DT_S = 1e-3

Ending = Literal["cause", "sound", "outside", "nothing_more", "insufficient", "budget"]


@dataclass(frozen=True)
class Cause:
    """A set of effects that may be the cause, with its probability."""

    effects: tuple[str, ...]
    probability: float | None


@dataclass(frozen=True)
class HuntExperiment:
    """An experiment, what was expected of it, and what the machine did."""

    description: str
    separates: tuple[tuple[str, ...], ...]
    """Sets that it was chosen to separate; none of the first look at a machine."""
    nats: float | None
    power: float | None
    """What it was expected to tell: evidence between the best set and the one that is hardest to
    separate from it, and the probability that they are separated."""
    record: str
    """File of its record; "" where too few samples were taken."""
    stopped: str
    """Why the guard ended it, or why its record cannot be used; "" where neither is so."""
    position_m: tuple[float, float]
    command_v: float
    speed_m_s: float
    pressure_pa: float | None
    """Positions between which the rod was, and the largest |command|, |speed| and pressure of a
    chamber; None where no pressure was measured."""


@dataclass(frozen=True)
class HuntStep:
    """An experiment and the diagnosis of all records until then."""

    experiments: tuple[HuntExperiment, ...]
    """Empty where the records were given; several where the guard ended the first ones early."""
    verdict: Verdict
    sentence: str
    causes: tuple[Cause, ...]
    """Sets that cannot be told apart, the most probable first."""
    outside_probability: float | None


@dataclass(frozen=True)
class Hunt:
    """What `hunt.json` has."""

    schema_version: Literal[1]
    ehsid_version: str
    machine: str
    limits: Limits
    budget: int
    """Most experiments."""
    ending: Ending
    sentence: str
    """Why the hunt ended, in a sentence."""
    steps: tuple[HuntStep, ...]

    @property
    def experiments(self) -> tuple[HuntExperiment, ...]:
        """Those that were run, in order."""
        return tuple(one for step in self.steps for one in step.experiments)


@dataclass(frozen=True, eq=False)
class Hunted:
    """A hunt with the data behind it."""

    told: Hunt
    diagnosis: Diagnosis
    """The last one."""
    records: tuple[Record, ...]
    """All records, those that were given first."""
    ran: tuple[tuple[Experiment, Ran], ...]
    """The experiments with what came of them, in order."""


@dataclass(frozen=True, eq=False)
class _Plan:
    experiment: Experiment
    separates: tuple[tuple[str, ...], ...] = ()
    nats: float | None = None
    power: float | None = None


def experiment_dt(records: Sequence[Record]) -> float:
    """Returns the sampling time of experiments, s: the shortest one of the records."""
    return min((one.dt_s for one in records if one.dt_s is not None), default=DT_S)


def hunt(
    machine: Machine,
    rig: Rig,
    records: Sequence[Record] = (),
    *,
    budget: int = 3,
    options: DiagnosisOptions = DEFAULTS,
    progress: Progress | None = None,
    note: Callable[[str], None] | None = None,
) -> Hunted:
    """Hunts the cause of the gap between a machine and its rig file.

    Without records the first experiment is a look at the whole machine. Then each experiment is the
    one of the menu that separates best the sets that the records cannot tell apart, see
    `diagnosis.next_experiment`. The hunt ends where one cause is left, nothing is missing, nothing
    more can be told within the limits, or `budget` experiments were run.

    Parameters
    ----------
    machine
        the machine, stepped with the `experiment_dt` of the records.
    rig
        the machine as its rig file tells it; of a plant of ehsid.
    records
        records of the machine that there are.
    budget
        most experiments, >= 1.
    options
        of each diagnosis; its `limits` are what may not be passed, by default what the rig file
        tells.
    progress
        called with the share of the largest possible work that is done, 0 to 1.
    note
        called with a line for each experiment and each diagnosis.

    Raises
    ------
    ValueError
        the rig has a simulator of the user, or does not tell its limits.
    """
    if rig.simulator is not None:
        raise ValueError(
            f"{rig.name}: its plant is a simulator of the user, for which no experiment is chosen: "
            "expected a rig of a plant of ehsid"
        )
    limits = options.limits or limits_of(rig, records)
    if limits is None:
        raise ValueError(
            f"{rig.name}: the rig file tells no stroke or no rated command: give the limits"
        )
    on = _Field(machine, rig, limits, budget, note or (lambda _: None))
    known, steps = list(records), list[HuntStep]()
    chosen = replace(options, limits=limits)
    dt_s = experiment_dt(records)
    plan = None if known else _first_look(rig, limits, dt_s)
    try:
        while True:
            told = [] if plan is None else on.carry_out(plan)
            new = [ran.record for _, ran in on.ran[len(on.ran) - len(told) :] if ran.record]
            known += new
            if not known:
                why = on.ran[-1][1].stopped if on.ran else "no signal stays inside them"
                raise ValueError(
                    f"{machine.name}: no experiment could be run within the limits: {why}; widen "
                    "the limits, or check the rig file"
                )
            if new or not steps:
                share = len(steps) / (budget + 1), (len(steps) + 1) / (budget + 1)
                diagnosis = diagnose(known, rig, options=chosen, progress=part_of(progress, *share))
                on.note(diagnosis.sentence)
                plan = _next(diagnosis, rig, limits, dt_s, on.ran)
            else:
                plan = None  # what the machine cannot do once it cannot do again
            steps.append(_step(told, diagnosis))
            ending = _ending(diagnosis, plan, len(on.ran) < budget)
            if ending is not None:
                break
    finally:
        machine.step(0.0)  # the valve is closed at every end
    sentence = _sentence(ending, len(on.ran))
    return Hunted(
        Hunt(1, ehsid.__version__, machine.name, limits, budget, ending, sentence, tuple(steps)),
        diagnosis,
        tuple(known),
        tuple(on.ran),
    )


@dataclass(frozen=True, eq=False)
class _Field:
    """The machine, and the experiments that were run on it."""

    machine: Machine
    rig: Rig
    limits: Limits
    budget: int
    note: Callable[[str], None]
    ran: list[tuple[Experiment, Ran]] = field(default_factory=list)

    def carry_out(self, plan: _Plan) -> list[HuntExperiment]:
        """Runs an experiment; again with half the command where the guard ended it too early."""
        told = []
        while len(self.ran) < self.budget:
            place = len(self.ran) + 1
            what = plan.experiment.description
            self.note(f"experiment {place} of {self.budget} at most: {what}")
            name = f"experiment{place}"
            ran = run_experiment(self.machine, plan.experiment, self.rig, self.limits, name)
            self.ran.append((plan.experiment, ran))
            told.append(_told(plan, ran))
            if ran.stopped:
                self.note(f"experiment {place} ended: {ran.stopped}")
            if ran.record is not None or ran.seconds >= LEAST_S:
                break
            plan = _halved(plan)
        return told


def _first_look(rig: Rig, limits: Limits, dt_s: float) -> _Plan | None:
    """The richest excitation of the menu, as large as the limits let it be; None where none is."""
    richest = MENU[-1]
    smaller = [replace(richest, size=share * richest.size) for share in LOOKS]
    for entry in (*smaller, *reversed(MENU[:-1])):
        found = simulate_experiment(entry, rig, {}, dt_s=dt_s, limits=limits)
        if found is not None:
            return _Plan(_experiment(found.description, found.record, dt_s))
    return None


def _next(
    diagnosis: Diagnosis,
    rig: Rig,
    limits: Limits,
    dt_s: float,
    ran: Sequence[tuple[Experiment, Ran]],
) -> _Plan | None:
    """The experiment that the diagnosis asks for, or a first look; None where none helps."""
    if diagnosis.verdict not in OPEN:
        return None
    coming, record = diagnosis.next_experiment, diagnosis.next_record
    done = [experiment.description for experiment, _ in ran]
    if coming is not None and record is not None and coming.power >= LEAST_POWER:
        # What the guard has ended it would end again.
        repeats = [each.stopped for one, each in ran if one.description == coming.description]
        if len(repeats) < MOST_REPEATS and not any(repeats):
            sets = tuple(tuple(names.split("+")) for names in coming.separates)
            experiment = _experiment(coming.description, record, dt_s)
            return _Plan(experiment, sets, coming.nats, coming.power)
        return None
    look = _first_look(rig, limits, dt_s)
    return None if look is None or look.experiment.description in done else look


def _experiment(description: str, record: Record, dt_s: float) -> Experiment:
    return Experiment(description, record.column(COMMAND), record.column(POSITION), dt_s)


def _halved(plan: _Plan) -> _Plan:
    """The experiment with half the command, about the same middle."""
    of = plan.experiment
    middle = 0.5 * float(of.path_m.min() + of.path_m.max())
    half = replace(
        of,
        description=f"half of: {of.description.removeprefix('half of: ')}",
        command_v=0.5 * of.command_v,
        path_m=middle + 0.5 * (of.path_m - middle),
    )
    return replace(plan, experiment=half)


def _ending(diagnosis: Diagnosis, plan: _Plan | None, is_left: bool) -> Ending | None:
    """Why the hunt ends after this diagnosis; None where it goes on."""
    if diagnosis.verdict == "effects":
        return "cause"
    if diagnosis.verdict in ("no_gap", "parameters"):
        return "sound"
    if plan is not None:
        return None if is_left else "budget"
    if diagnosis.verdict == "outside_catalogue":
        return "outside"
    return "insufficient" if diagnosis.verdict == "insufficient_data" else "nothing_more"


def _told(plan: _Plan, ran: Ran) -> HuntExperiment:
    """Returns what was planned, and what the machine did, as data."""
    seen = ran.seen
    return HuntExperiment(
        plan.experiment.description,
        plan.separates,
        plan.nats,
        plan.power,
        "" if ran.record is None else f"{ran.record.name}.csv",
        ran.stopped,
        seen.position_m,
        seen.command_v,
        seen.speed_m_s,
        seen.pressure_pa,
    )


def _step(told: Sequence[HuntExperiment], diagnosis: Diagnosis) -> HuntStep:
    weighed = {one.effects: one.probability for one in diagnosis.candidates}
    sets = diagnosis.ambiguity_set or ((tuple(one.id for one in diagnosis.effects),))
    return HuntStep(
        tuple(told),
        diagnosis.verdict,
        diagnosis.sentence,
        tuple(Cause(tuple(one), weighed.get(tuple(one))) for one in sets if one),
        diagnosis.outside_probability,
    )


def _sentence(ending: Ending, count: int) -> str:
    """Why the hunt ended."""
    after = f"after {count} experiment{'' if count == 1 else 's'}"
    return {
        "cause": f"One cause is left {after}.",
        "sound": f"No effect is missing, {after}.",
        "outside": f"The cause is none of the catalogue, {after}.",
        "nothing_more": f"No experiment within the limits tells more, {after}.",
        "insufficient": f"The records do not carry a diagnosis, {after}.",
        "budget": f"The budget is spent {after}; another experiment would tell more.",
    }[ending]

# SPDX-License-Identifier: MIT
"""A diagnosis as a task: it takes data and returns files, so it may run on another machine.

How much of its time a diagnosis has behind it, as far as this can be known.

The stages of a diagnosis take very different times, and some of them take place only where the
records ask for them. The time that is expected is counted in units of the stage that tries each
effect alone: all other stages make fits of the same kind, so that they take a multiple of it on any
machine and for any record. How many of them are made is known when a stage begins. Which stages are
to come follows, for the most part, from the errors above the noise floor. Where this is in doubt, a
stage is expected that may be left out: the time to go never rises, and falls at once where less is
to do. The numbers below were fitted to diagnoses of generated records. benchmarks/time_to_go.py
measures on others how well the time to go is told.

Tells what is known while a diagnosis is at work.
"""

from __future__ import annotations

import logging
import math
import tempfile
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from ..base.error_words import error_words, fault_words
from ..base.files import FULL, result_folder, temporary_folder
from ..base.parallel import Progress, run_unordered, workers
from ..records import Record
from ..rigs import Rig
from .deciding import WORSE_HELD_OUT
from .decision import results
from .model.case import Case
from .options import DEFAULTS, DiagnosisOptions
from .result import Diagnosis, Interim, Stage
from .search.candidates import FittedCandidate
from .search.gap_reduction import mean_gap
from .search.intervals import above_floor
from .search.score import left
from .search.search import Look

DIAGNOSIS = "diagnosis.json"
ERROR = "error.txt"
# Name of the result of a diagnosis in its folder: that of `ehsid gap`.
RESULT = "gap"

# `ehsid.harness.diagnosis.diagnose`, or a function that replaces it.
Diagnose = Callable[..., Diagnosis]
# Writes the files of a diagnosis. Arguments: folder, diagnosis, records, rig file.
Write = Callable[[Path, Diagnosis, Sequence[Record], str], object]


@dataclass(frozen=True)
class Job:
    """Everything that a diagnosis may know."""

    name: str
    """Name of the case or the machine."""
    rig: Rig
    """The rig as configured; `rig_file` is the path that the results name."""
    rig_file: str
    fitted: tuple[Record, ...]
    held_out: tuple[Record, ...]
    """Records to fit, and held-out records."""
    options: DiagnosisOptions = DEFAULTS
    """The options of the diagnosis."""


@dataclass(frozen=True)
class Outcome:
    """Result of a job."""

    name: str
    """Name of the job."""
    files: dict[str, bytes]
    """Contents of the files by name; only `ERROR` where the diagnosis raised an exception."""
    word: str
    """The verdict, or the last line of the error."""
    seconds: float
    """Time that the job took, s."""
    said: str = ""
    """What was to be shown on stderr meanwhile, such as what was taken for what in a log."""

    @property
    def failed(self) -> bool:
        """Whether the diagnosis raised an exception."""
        return ERROR in self.files


def run_job(job: Job, diagnose: Diagnose, write: Write) -> Outcome:
    """Runs the diagnosis on one core; an exception becomes an outcome, too.

    Raises
    ------
    ValueError
        the disk of temporary files is full: this says nothing about the job.
    """
    began = time.monotonic()
    try:
        with workers(1):
            found = diagnose(
                list(job.fitted), job.rig, validate=list(job.held_out), options=job.options
            )
        with temporary_folder() as folder:
            write(folder, found, (*job.fitted, *job.held_out), job.rig_file)
            files = {path.name: path.read_bytes() for path in sorted(folder.iterdir())}
        word: str = found.verdict
    except Exception as error:
        check_room(error)
        files, word = failure(error)
    return Outcome(job.name, files, word, time.monotonic() - began)


def check_room(error: Exception) -> None:
    """Checks that an error does not only say that there is no room for temporary files.

    Raises
    ------
    ValueError
        it does.
    """
    if isinstance(error, OSError) and error.errno in FULL:
        raise ValueError(
            f"{tempfile.gettempdir()}: cannot be written to ({error.strerror}); make room "
            "there, or let TMPDIR name another folder"
        ) from None


def failure(error: Exception) -> tuple[dict[str, bytes], str]:
    """Returns the file of an exception, whose last line is its message, and that message."""
    message = one_line(f"{type(error).__name__}: {error}")
    if error_words(error) is None:
        message = fault_words(error)
    text = "".join(traceback.format_exception(error))
    return {ERROR: f"{text}\n{message}\n".encode()}, message


def one_line(text: str) -> str:
    """Returns the text without line breaks, for a log or a cell of a table."""
    return " ".join(text.split())


def keep(outcome: Outcome, folder: Path) -> None:
    """Writes the files to folder/NAME, all or none; they replace an earlier result.

    Raises
    ------
    ValueError
        as `result_folder`: a file that is not of an earlier result is in the way.
    """
    with result_folder(folder / outcome.name, RESULT, list(outcome.files)) as made:
        for name, content in outcome.files.items():
            (made / name).write_bytes(content)


def run_and_keep(tasks: Iterable[Callable[[], Outcome]], folder: Path) -> Iterator[Outcome]:
    """Runs the tasks and yields each outcome as it comes, after writing it into the folder."""
    for outcome in run_unordered(tasks):
        keep(outcome, folder)
        yield outcome


# Sizes of stages in units of "alone".
VALUES = 0.2
AT_LENGTH, ONE_AT_LENGTH = 0.04, 0.115  # and for each long fit
TOGETHER = 0.95  # for each set that is extended
LATER_ROUND, ONE_LATER = 0.7, 0.55  # and for each set that is extended
DECIDING = 0.115
LAWS, LAWS_BESIDE_EFFECTS = 0.7, 2.2
WHERE = 0.75
EXPERIMENT = 1.9
# A second search, on all records together, has more to simulate than the first one.
JOINT = 2.0
SECOND_SEARCH = 2.2

# All errors are ln of the held-out errors over the noise floor.
AT_FLOOR = 0.05  # of the best set: no further effect is looked for
GAIN = 0.1  # of the best effect: with less it is not extended
GAP = 0.35  # of the rig with its values fitted: it is a gap
UNEXPLAINED = 1.0  # of the best set: a further round of sets is expected
NO_CAUSE = 1.5  # of the best set: laws that the catalogue lacks are expected
SECOND = 0.6  # of a best set that is apart, see Known: a second search is expected

# Units behind "alone", before any effect was tried, by the largest error of the calibrated rig.
BEHIND_ALONE = ((0.35, 0.5), (0.6, 1.1), (2.4, 2.4), (math.inf, 4.6))
# Units behind "at length" where sets with more effects are expected, by the largest error of the
# best set; below UNEXPLAINED they follow from the number of sets.
BEHIND_AT_LENGTH = ((2.2, 2.6), (math.inf, 5.6))
# Units behind the first round of sets.
BEHIND_TOGETHER = ((3.0, 2.4), (math.inf, 4.0))


@dataclass(frozen=True)
class Known:
    """What is known when a stage begins."""

    calibrated: float
    best: float
    """ln of the held-out errors over the noise floor, of the rig with its values fitted and of the
    set that is ahead."""
    apart: bool = False
    """Whether the set that is ahead explains held-out data clearly less than those fitted."""
    tasks: int = 0
    """Long fits of "at length", sets that "together" extends, sets that "laws" begins with, sets
    beside the best one that "where" leaves to an experiment; 0 for other stages."""


class Pace:
    """Tells the expected share of the time that is over; it never falls."""

    def __init__(self, progress: Progress | None, *, may_be_joint: bool) -> None:
        """Begins.

        Parameters
        ----------
        progress
            called with the share of the expected time that is over, 0 to 1.
        may_be_joint
            whether a second search may follow, which fits the held-out records too.
        """
        self._progress = progress
        self._may_be_joint = may_be_joint
        self._scale = 1.0
        self._done = 0.0  # units before the present stage
        self._size = 0.0  # of the present stage
        self._left = 0.0  # units behind the present stage
        self._share = 0.0
        self._rounds = 0

    def begin(self, stage: Stage, known: Known) -> None:
        """Begins a stage."""
        if stage == "values" and self._size:  # the second search
            self._scale, self._may_be_joint, self._rounds = JOINT, False, 0
        self._done += self._size
        self._rounds = self._rounds + 1 if stage == "together" else self._rounds
        self._size = self._scale * self._size_of(stage, known.tasks)
        self._left = self._scale * self._after(stage, known)
        self.within(0.0)

    def within(self, share: float) -> None:
        """Takes the share of the present stage that is done, 0 to 1."""
        done = self._done + share * self._size
        left = self._left + (1.0 - share) * self._size
        if done + left > 0.0:
            self._share = max(self._share, done / (done + left))
        if self._progress is not None:
            self._progress(self._share)

    def _size_of(self, stage: Stage, tasks: int) -> float:
        if stage == "at length":
            return AT_LENGTH + tasks * ONE_AT_LENGTH
        if stage == "together":
            later = self._rounds > 1
            return LATER_ROUND + tasks * ONE_LATER if later else tasks * TOGETHER
        if stage == "laws":
            return LAWS if tasks < 2 else LAWS_BESIDE_EFFECTS
        sizes: dict[Stage, float] = {
            "values": VALUES,
            "alone": 1.0,
            "deciding": DECIDING,
            "where": WHERE,
            "experiment": EXPERIMENT,
        }
        return sizes[stage]

    def _after(self, stage: Stage, known: Known) -> float:
        """Returns the units that are expected behind a stage."""
        if stage in ("values", "alone"):
            before = 1.0 if stage == "values" else 0.0
            return before + _of(BEHIND_ALONE, known.calibrated)
        if stage == "at length":
            return self._behind_at_length(known)
        if stage == "together" and self._rounds == 1 and known.best > UNEXPLAINED:
            return max(self._end(known), _of(BEHIND_TOGETHER, known.best))
        if stage in ("together", "deciding"):
            return self._end(known) - (DECIDING if stage == "deciding" else 0.0)
        if stage == "where" and known.tasks:
            return EXPERIMENT
        return WHERE if stage == "laws" and known.best > NO_CAUSE else 0.0

    def _behind_at_length(self, known: Known) -> float:
        """Returns the units behind "at length", once the short fit of each effect is known."""
        if known.best < AT_FLOOR or known.calibrated - known.best < GAIN:
            return self._end(known)
        if known.best > UNEXPLAINED:
            return max(self._end(known), _of(BEHIND_AT_LENGTH, known.best))
        return TOGETHER * (1.0 if known.tasks < 3 else 2.0) + self._end(known)

    def _end(self, known: Known) -> float:
        """Returns the units from "deciding" on."""
        if self._may_be_joint and known.apart and known.best > SECOND:
            return DECIDING + JOINT * SECOND_SEARCH
        if known.calibrated < GAP:
            return DECIDING
        if known.best < NO_CAUSE:
            return DECIDING + WHERE
        explains = known.calibrated - known.best > GAIN
        return DECIDING + (LAWS_BESIDE_EFFECTS if explains else LAWS) + WHERE


def _of(table: Sequence[tuple[float, float]], error: float) -> float:
    """Returns the number of the first row whose largest error is not below this one."""
    return next(units for largest, units in table if error <= largest)


Watch = Callable[[Interim], None]
Begun = Callable[[Stage], None]
LOGGER = logging.getLogger("ehsid")

STAGES: MappingProxyType[Stage, str] = MappingProxyType(
    {
        "values": "fitting the values of the rig",
        "alone": "trying each effect alone, briefly",
        "at length": "fitting the best effects at length",
        "together": "trying effects together",
        "deciding": "weighing the explanations",
        "laws": "looking for laws that the catalogue lacks",
        "where": "telling where the gap lies",
        "experiment": "designing the experiment that separates the explanations",
    }
)


def look_for(watch: Watch | None, begun: Begun | None, pace: Pace, case: Case) -> Look:
    """Returns what is called at the begin of each stage.

    It sets the pace, tells `begun` the stage, and tells `watch` what is known.
    """

    def look(
        stage: Stage,
        nominal: FittedCandidate,
        calibrated: FittedCandidate,
        fitted: Sequence[FittedCandidate],
        /,
        *,
        tasks: int = 0,
    ) -> None:
        LOGGER.info("%s", STAGES[stage])
        if begun is not None:
            begun(stage)
        ahead = fitted[0]
        apart = left(case, ahead, "held out") - left(case, ahead, "fitted")
        known = Known(
            above_floor(case, calibrated), above_floor(case, ahead), apart > WORSE_HELD_OUT, tasks
        )
        pace.begin(stage, known)
        if watch is None:
            return
        runs, how_far = results.held_out_results(case, nominal, calibrated, ahead)
        gaps: dict[tuple[str, ...], float] = {}
        for candidate in fitted:
            gap = mean_gap(candidate.sums)
            if candidate.effects and np.isfinite(gap):
                gaps[candidate.effects] = min(gap, gaps.get(candidate.effects, gap))
        sets = sorted(gaps.items(), key=lambda one: one[1])
        watch(Interim(stage, runs, how_far, ahead.effects, tuple(sets)))

    return look

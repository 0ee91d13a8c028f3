# SPDX-License-Identifier: MIT
"""What stands in for the diagnosis in tests: the one place that repeats its arguments."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from ehsid.harness.base.parallel import Progress, worker_count
from ehsid.harness.diagnosis.job import Begun, Watch
from ehsid.harness.diagnosis.options import DEFAULTS, DiagnosisOptions
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.records import Record
from ehsid.harness.rigs import Rig


@dataclass(frozen=True)
class Asked:
    """The arguments of a call of the diagnosis, and how many workers it may have."""

    records: list[Record]
    rig: Rig
    validate: list[Record]
    options: DiagnosisOptions
    progress: Progress | None
    watch: Watch | None
    begun: Begun | None
    workers: int

    @property
    def fitted(self) -> list[str]:
        """Names of the records to fit."""
        return [record.name for record in self.records]

    @property
    def held_out(self) -> list[str]:
        """Names of the records to judge by."""
        return [record.name for record in self.validate]

    @property
    def roles(self) -> dict[str, str]:
        """By name of a record what it was given for, as in a result of the diagnosis."""
        return dict.fromkeys(self.fitted, "fit") | dict.fromkeys(self.held_out, "held out")


class DiagnosisStandIn:
    """Is called as the diagnosis and gives what `answer` makes of it."""

    def __call__(
        self,
        records: Sequence[Record],
        rig: Rig,
        *,
        validate: Sequence[Record] = (),
        options: DiagnosisOptions = DEFAULTS,
        progress: Progress | None = None,
        watch: Watch | None = None,
        begun: Begun | None = None,
        note: Callable[[str], None] | None = None,
    ) -> Diagnosis:
        return self.answer(
            Asked(
                list(records),
                rig,
                list(validate),
                options,
                progress,
                watch,
                begun,
                worker_count(),
            )
        )

    def answer(self, asked: Asked) -> Diagnosis:
        """Returns the diagnosis."""
        raise NotImplementedError


class FakeDiagnose(DiagnosisStandIn):
    """Keeps what it was asked last and gives what it was made with."""

    def __init__(self, diagnosis: Diagnosis) -> None:
        self.diagnosis = diagnosis
        self.calls: list[Asked] = []

    @property
    def asked(self) -> Asked:
        """The last call."""
        return self.calls[-1]

    def answer(self, asked: Asked) -> Diagnosis:
        """Begins a stage, tells that half is done, and returns the diagnosis."""
        self.calls.append(asked)
        if asked.begun is not None:
            asked.begun("alone")
        if asked.progress is not None:
            asked.progress(0.5)
        return replace(self.diagnosis, records=asked.roles)

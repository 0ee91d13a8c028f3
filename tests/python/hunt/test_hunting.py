# SPDX-License-Identifier: MIT
"""A hunt with a stand-in for the diagnosis: which experiment comes next, and when it ends."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest
from diagnosis_stand_in import Asked, DiagnosisStandIn
from made_diagnoses import bench, made_diagnosis, measured_record
from msgspec.structs import replace as replace_part

from ehsid.harness.diagnosis.limits import Limits
from ehsid.harness.diagnosis.options import DiagnosisOptions
from ehsid.harness.diagnosis.result import Diagnosis
from ehsid.harness.hunt import hunting
from ehsid.harness.hunt.hunting import MOST_REPEATS, Hunted, hunt
from ehsid.harness.hunt.machines import SimulatedMachine
from ehsid.harness.records import make_record
from ehsid.harness.rigs import Rig

RIG = bench()
DT_S = 5e-3
LIMITS = Limits((0.02, 0.28), 10.0, pressure_pa=1.8e7)
FRICTION = {"effects.coulomb_friction.force_n": 412.0}
RECORD = measured_record("run1", 1, seconds=1.0, dt_s=DT_S)


def swing(speed_v: float) -> Diagnosis:
    """An ambiguous diagnosis whose next experiment is a slow swing of 4 s."""
    count = round(4.0 / DT_S)
    command = speed_v * np.sin(2.0 * np.pi * np.arange(count) * DT_S)
    columns = {
        "time_s": DT_S * np.arange(count),
        "command_v": command,
        "position_m": 0.15 + 0.01 * np.cumsum(command) * DT_S,
    }
    made = made_diagnosis("ambiguous")
    assert made.next_experiment is not None
    coming = replace_part(
        made.next_experiment, description=f"swing at {speed_v:g} V", nats=12.0, power=0.9
    )
    return replace(made, next_experiment=coming, next_record=make_record(columns, name="next"))


class InTurn(DiagnosisStandIn):
    """Gives one diagnosis after the other, and the last one for ever."""

    def __init__(self, *diagnoses: Diagnosis) -> None:
        self.left = list(diagnoses)
        self.asked: list[Asked] = []

    def answer(self, asked: Asked) -> Diagnosis:
        self.asked.append(asked)
        return self.left.pop(0) if len(self.left) > 1 else self.left[0]


def hunted(
    monkeypatch: pytest.MonkeyPatch,
    *diagnoses: Diagnosis,
    records: Sequence[object] = (RECORD,),
    machine: object = None,
    budget: int = 3,
    limits: Limits | None = LIMITS,
) -> tuple[Hunted, InTurn]:
    stand_in = InTurn(*diagnoses)
    monkeypatch.setattr(hunting, "diagnose", stand_in)
    on = machine or SimulatedMachine(RIG.with_values(FRICTION), ("position_m",), dt_s=DT_S, seed=1)
    found = hunt(
        on,  # type: ignore[arg-type]
        RIG,
        records,  # type: ignore[arg-type]
        budget=budget,
        options=DiagnosisOptions(limits=limits),
    )
    return found, stand_in


def test_a_hunt_ends_with_one_cause(monkeypatch: pytest.MonkeyPatch) -> None:
    found, asked = hunted(monkeypatch, swing(1.0), made_diagnosis("effects"))
    assert (found.told.ending, found.told.sentence) == (
        "cause",
        "One cause is left after 1 experiment.",
    )
    first, second = found.told.steps
    assert first.experiments == ()
    assert len(first.causes) == 2
    (experiment,) = second.experiments
    assert (experiment.description, experiment.nats, experiment.power) == (
        "swing at 1 V",
        12.0,
        0.9,
    )
    assert experiment.separates == (("coulomb_friction",), ("stribeck_friction",))
    assert (experiment.record, experiment.stopped) == ("experiment1.csv", "")
    assert 0.0 < experiment.command_v <= 10.0
    # All records are fitted again, and the limits reach each design.
    assert asked.asked[1].fitted == ["run1", "experiment1"]
    assert all(one.options.limits == LIMITS for one in asked.asked)
    assert found.records[1].dt_s == pytest.approx(DT_S)


@pytest.mark.parametrize(
    ("verdict", "ending"),
    [("no_gap", "sound"), ("parameters", "sound"), ("effects", "cause")],
)
def test_without_a_question_no_experiment_is_run(
    verdict: str, ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = hunted(monkeypatch, made_diagnosis(verdict))  # type: ignore[arg-type]
    assert (found.told.ending, found.told.experiments) == (ending, ())


def test_the_budget_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    found, _ = hunted(monkeypatch, swing(1.0), swing(1.5), swing(2.0), budget=2)
    assert (found.told.ending, len(found.told.experiments)) == ("budget", 2)


def test_the_same_experiment_is_not_run_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    found, _ = hunted(monkeypatch, swing(1.0), budget=9)
    assert (found.told.ending, len(found.told.experiments)) == ("nothing_more", MOST_REPEATS)


@pytest.mark.parametrize(
    ("verdict", "ending"),
    [("outside_catalogue", "outside"), ("insufficient_data", "insufficient")],
)
def test_an_open_end_is_looked_at_once_more(
    verdict: str, ending: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    found, _ = hunted(monkeypatch, made_diagnosis(verdict))  # type: ignore[arg-type]
    assert found.told.ending == ending
    (look,) = found.told.experiments
    assert (look.separates, look.nats) == ((), None)


def test_without_records_the_first_experiment_is_a_look(monkeypatch: pytest.MonkeyPatch) -> None:
    machine = SimulatedMachine(RIG, ("position_m",), dt_s=1e-3, seed=1)
    found, asked = hunted(monkeypatch, made_diagnosis("no_gap"), records=(), machine=machine)
    assert asked.asked[0].fitted == ["experiment1"]
    assert found.told.sentence == "No effect is missing, after 1 experiment."
    assert len(found.records[0]) == 8000


class Runaway:
    """A machine that goes thirty times as fast as its rig file tells."""

    name = "runaway"

    def __init__(self) -> None:
        self.position, self.reached = 0.15, [0.15]

    def read(self) -> Mapping[str, float]:
        return {"position_m": self.position}

    def step(self, command_v: float) -> None:
        self.position += 1.0 * command_v * DT_S
        self.reached.append(self.position)
        self.last = command_v


def test_an_experiment_that_goes_too_far_is_tried_half_as_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    machine = Runaway()
    found, asked = hunted(monkeypatch, swing(8.0), machine=machine)
    assert [one.description for one in found.told.experiments] == [
        "swing at 8 V",
        "half of: swing at 8 V",
    ]
    first, half = found.told.experiments
    assert "end of its travel" in first.stopped
    assert (first.record, half.record, half.stopped) == ("", "experiment2.csv", "")
    whole, halved = (experiment.command_v for experiment, _ in found.ran)
    np.testing.assert_array_equal(halved, 0.5 * whole)
    # What the guard has ended once is not run again.
    assert found.told.ending == "nothing_more"
    assert len(asked.asked) == 2
    assert machine.last == 0.0
    assert LIMITS.position_m[0] < min(machine.reached) < max(machine.reached) < LIMITS.position_m[1]


def test_the_valve_is_closed_where_the_diagnosis_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    class Fails(DiagnosisStandIn):
        def answer(self, asked: Asked) -> Diagnosis:
            raise ValueError("no")

    monkeypatch.setattr(hunting, "diagnose", Fails())
    machine = Runaway()
    machine.last = 5.0
    with pytest.raises(ValueError, match="no"):
        hunt(machine, RIG, [RECORD])
    assert machine.last == 0.0


def test_what_cannot_be_hunted_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    axis = Rig("axis", "axis", {"axis.mass_kg": 10.0, "axis.viscous_friction_n_s_m": 30.0,
                                "axis.force_per_volt": 3.0})  # fmt: skip
    with pytest.raises(ValueError, match="axis: the rig file tells no stroke or no rated command"):
        hunt(Runaway(), axis)
    narrow = Limits((0.1499999, 0.1500001), 10.0)
    with pytest.raises(ValueError, match="runaway: no experiment could be run within the limits"):
        hunted(monkeypatch, swing(1.0), records=(), machine=Runaway(), limits=narrow)

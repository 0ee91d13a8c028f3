# SPDX-License-Identifier: MIT
"""A few blind records that show when a change makes the diagnosis worse.

Records of `ehsid.lab.reality`, short and from fixed seeds. Each must be answered as
the table says; a change of the diagnosis that loses one has to be looked at with
`ehsid gap-check`, on hundreds of fresh ones, before the table is changed.
"""

from dataclasses import dataclass

import pytest

from ehsid.harness.diagnosis import diagnose
from ehsid.harness.records import make_record
from ehsid.harness.rigs import parse_rig
from ehsid.lab.blind.making import Answer
from ehsid.lab.reality import make_case
from ehsid.lab.reality.case import Kind, Sensors
from ehsid.lab.reality.variants import Grade
from ehsid.lab.scoring.findings import Findings, NamedEffect
from ehsid.lab.scoring.judging import Judgement, judge

# Six records of 6 s at 500 Hz take half a minute on two cores.
SECONDS = 6.0
DT_S = 2e-3


@dataclass(frozen=True)
class Blind:
    """A blind record and the diagnosis that it must get."""

    seed: int
    grade: Grade
    kind: Kind
    effects: tuple[str, ...]
    sensors: Sensors
    verdict: str
    named: tuple[str, ...]


TABLE = (
    Blind(101, "plain", "one", ("valve_dead_band",), "pressures", "effects", ("valve_dead_band",)),
    Blind(
        102, "plain", "one", ("internal_leakage",), "pressures", "effects", ("internal_leakage",)
    ),
    Blind(103, "plain", "one", ("coulomb_friction",), "position", "effects", ("coulomb_friction",)),
    Blind(104, "plain", "one", ("transport_delay",), "position", "effects", ("transport_delay",)),
    Blind(105, "plain", "one", ("sensor_backlash",), "position", "effects", ("sensor_backlash",)),
    Blind(106, "plain", "none", (), "pressures", "no_gap", ()),
)


def diagnosed(blind: Blind) -> tuple[Judgement, str, tuple[str, ...]]:
    """Judgement, verdict and ids of the selected effects."""
    case = make_case(
        blind.seed,
        blind.grade,
        blind.kind,
        blind.effects or None,
        blind.sensors,
        seconds=SECONDS,
        dt_s=DT_S,
    )
    diagnosis = diagnose(
        [make_record(dict(case.train), name="train")],
        parse_rig(case.rig_toml),
        validate=[make_record(dict(case.validate), name="validate")],
    )
    selected = tuple(effect.id for effect in diagnosis.effects)
    answer = Answer(
        blind.kind,
        blind.grade,
        "ehs",
        blind.sensors,
        tuple(case.answer["excitation"]),
        case.answer["effects"],
        tuple(case.answer["subsystem"]),
    )
    effects = tuple(NamedEffect(name, 1.0) for name in selected)
    case_findings = Findings(diagnosis.verdict, effects, diagnosis.ambiguity_set)
    return judge(answer, case_findings), diagnosis.verdict, selected


@pytest.mark.thorough
@pytest.mark.parametrize("blind", TABLE, ids=lambda blind: f"{blind.seed}-{blind.kind}")
def test_blind_record(blind: Blind) -> None:
    judgement, verdict, selected = diagnosed(blind)
    assert (verdict, selected) == (blind.verdict, blind.named)
    assert judgement.outcome == "right"

# SPDX-License-Identifier: MIT
"""Rig files with a user's simulator in the workbench: dropped, by path, and with the simulator."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from user_simulators import FOLDER

from ehsid.harness.rigs import RigError, read_rig
from ehsid.workbench.rig_program import stated_program, with_program
from ehsid.workbench.session import Session, SessionError
from ehsid.workbench.simulator_files import take_program, take_rig_at, take_rig_text

RIG = FOLDER / "rig_python.toml"
TEXT = RIG.read_text(encoding="utf-8")


@pytest.fixture
def session(tmp_path: Path) -> Session:
    return Session(tmp_path / "press")


def dropped(session: Session, file: str = "bench_plant.py") -> str:
    part = session.folder / ".part"
    shutil.copyfile(FOLDER / "bench_plant.py", part)
    return take_program(session, part, file)


def test_a_dropped_rig_says_what_to_do_and_waits_for_its_simulator(session: Session) -> None:
    with pytest.raises(SessionError, match=r"drop bench_plant.py here, too, or give the path"):
        take_rig_text(session, TEXT, "mine.toml")
    assert not session.rig_file.exists()
    said = dropped(session)
    assert said.endswith("the rig file that waited for it is the rig of this machine now (bench).")
    rig = read_rig(session.rig_file)
    assert rig.simulator is not None
    assert rig.simulator.python == "simulator/bench_plant.py:Bench"
    assert "# The same bench, simulated by a Python class" in session.rig_file.read_text()
    assert [path.name for path in (session.folder / "simulator").iterdir()] == ["bench_plant.py"]


def test_a_simulator_that_comes_first_is_found(session: Session) -> None:
    assert "drop the rig file that names it" in dropped(session)
    assert take_rig_text(session, TEXT, "mine.toml").startswith("mine.toml is the rig")
    assert read_rig(session.rig_file).simulator is not None


def test_another_simulator_of_the_name_takes_its_place_and_makes_results_old(
    session: Session,
) -> None:
    dropped(session)
    take_rig_text(session, TEXT, "mine.toml")
    before = session.digest(rig=True)
    (session.folder / ".part").write_text("class Bench:\n    pass\n")
    take_program(session, session.folder / ".part", "bench_plant.py")
    assert session.digest(rig=True) != before
    names = sorted(path.name for path in (session.folder / "simulator").iterdir())
    assert names == ["bench_plant.py", "bench_plant_2.py"]


def test_a_rig_file_by_its_path_leaves_the_simulator_where_it_is(session: Session) -> None:
    take_rig_at(session, RIG)
    rig = read_rig(session.rig_file)
    assert rig.simulator is not None
    assert rig.simulator.python == f"{FOLDER / 'bench_plant.py'}:Bench"
    with pytest.raises(RigError, match="there is no such file"):
        take_rig_at(session, session.folder / "none.toml")


def test_a_simulator_that_has_gone_makes_results_old(session: Session) -> None:
    dropped(session)
    take_rig_text(session, TEXT, "mine.toml")
    before = session.digest(rig=True)
    (session.folder / "simulator" / "bench_plant.py").unlink()
    assert session.digest(rig=True) != before
    with pytest.raises(RigError, match=r"bench_plant\.py"):
        read_rig(session.rig_file)


@pytest.mark.parametrize(
    ("text", "path", "expected"),
    [
        (
            '[simulator]\nfmu="a b.fmu"#1\n',
            "x/c.fmu",
            '[simulator]\nfmu="x/c.fmu"#1\n',
        ),
        ("[simulator]\npython = 'a.py:B'\n", "/d/a.py", '[simulator]\npython = "/d/a.py:B"\n'),
        ('[simulator]\nfmu = "a\\u002efmu"\n', "b.fmu", '[simulator]\nfmu = "b.fmu"\n'),
    ],
)
def test_the_path_in_the_text_is_exchanged(text: str, path: str, expected: str) -> None:
    assert with_program(text, path) == expected


@pytest.mark.parametrize("text", ["a = [", "simulator = 3", '[simulator]\npython = "mod:Name"'])
def test_a_text_without_a_file_names_none(text: str) -> None:
    assert stated_program(text) == ("", "")

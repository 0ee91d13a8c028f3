# SPDX-License-Identifier: MIT
"""Sessions for tests whose diagnosis is made up, so that nothing has to be fitted."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path

from app_sessions import BENCH, german_log, read_session
from made_diagnoses import made_diagnosis

from ehsid.harness.show.gap_page import write_diagnosis
from ehsid.workbench.session import Session


def diagnosed_session(folder: Path, verdict: str = "ambiguous", seconds: float = 1.0) -> Session:
    """Return a session with one record, the bench as its rig, and a diagnosis that holds."""
    shutil.copytree(_made(verdict, seconds) / "session", folder)
    return Session(folder)


@cache
def _made(verdict: str, seconds: float) -> Path:
    """The folder with such a session, made once a process: to read a log and to draw take long."""
    top = Path(tempfile.mkdtemp(prefix="ehsid_session_"))
    atexit.register(shutil.rmtree, top)
    folder = top / "session"
    (folder / "logs").mkdir(parents=True)
    log = german_log(folder / "logs" / "run.csv", seconds)
    session = read_session(folder, log)
    session.rig_file.write_bytes(BENCH.read_bytes())
    for name in ("check", "gap"):
        (folder / name).mkdir()
        session.settings.made_of[name] = session.digest(rig=True)
    (folder / "check" / "rig_check.json").write_text("{}")
    write_diagnosis(folder / "gap", made_diagnosis(verdict), [], "rig.toml")
    session.save()
    return top

# SPDX-License-Identifier: MIT
"""Where polars is not installed: text is read and CSV written; Parquet says what to install."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from log_files import write_german_text, write_parquet
from sources import ROOT

import ehsid
from ehsid.harness.records import RecordError, read_record, write_record

BENCH = ROOT / "examples" / "rigs" / "bench.toml"

# In a process of its own: this one has imported polars.
PROGRAM = """
import pkgutil, sys
from importlib import import_module
sys.modules["polars"] = None
import ehsid, ehsid.harness
for module in pkgutil.walk_packages(ehsid.harness.__path__, "ehsid.harness."):
    import_module(module.name)
log, rig, out = sys.argv[1:]
print(*ehsid.read(log).columns)
ehsid.simulate(ehsid.Rig.read(rig), "steps", duration_s=0.1, dt_s=0.002).save(out)
print(len(ehsid.read(out)))
"""


@pytest.mark.slow
def test_a_text_log_and_a_simulation_need_no_polars(tmp_path: Path) -> None:
    arguments = [write_german_text(tmp_path), BENCH, tmp_path / "run.csv"]
    command = [sys.executable, "-c", PROGRAM, *map(str, arguments)]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    columns, samples = printed.splitlines()
    assert columns.split()[:2] == ["command_v", "position_m"]
    assert int(samples) == 50


def test_parquet_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_parquet(tmp_path)
    record = read_record(path)
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(RecordError, match=r"'polars', which reads .* 'ehsid\[logs\]'"):
        read_record(path)
    with pytest.raises(RecordError, match=r"'polars', which writes .* 'ehsid\[logs\]'"):
        write_record(record, tmp_path / "new.parquet")
    assert not (tmp_path / "new.parquet").exists()


def test_csv_has_the_digits_that_are_needed(tmp_path: Path) -> None:
    values = [1e-5, -1.25e-5, 1.5e-7, 0.1 + 0.2, 1e15, 1e16, -0.0, 5e-324]
    record = ehsid.read({"command_v": np.array(values), "a,b": np.arange(8.0)}).save(
        tmp_path / "r.csv"
    )
    assert record.read_text().splitlines() == [
        'command_v,"a,b"',
        "0.00001,0.0",
        "-0.0000125,1.0",
        "1.5e-7,2.0",
        "0.30000000000000004,3.0",
        "1000000000000000.0,4.0",
        "1e+16,5.0",
        "-0.0,6.0",
        "5e-324,7.0",
    ]
    assert np.array_equal(read_record(record, columns=["command_v"]).columns["command_v"], values)

# SPDX-License-Identifier: MIT
"""Places for results that cannot be used; what is there stays as it is."""

from __future__ import annotations

from bad_input.case import Case, Content, command
from bad_input.inputs import BENCH, GOOD, LONG, a_folder, a_link_to

TITLE = "Folders and files of results"
ABOUT = "Everything that was in the folder before is still there afterwards, unchanged."
FILES: dict[str, Content] = {"record.csv": LONG, "rig.toml": BENCH}
GAP = "ehsid gap record.csv --rig rig.toml"
SIMULATE = "ehsid simulate rig.toml --excitation steps --duration 0.1"
INJECT = "ehsid inject record.csv --rig rig.toml --effect gain --set factor=1.1"
MACHINE: dict[str, Content] = {"machines/m1/rig.toml": BENCH, "machines/m1/run.csv": LONG}
# The words of the library that reads JSON.
READER = r"(?<=: )Input data[^;]*(?=;)"
HIL = "ehsid hil --port socket://127.0.0.1:9"


def place(
    wrong: str,
    line: str,
    *says: str,
    files: dict[str, Content] | None = None,
    writes: tuple[str, ...] = (),
    library: str | None = None,
) -> Case:
    there = FILES | (files or {})
    return command(wrong, line, *says, files=there, writes=writes, library=library)


CASES = (
    place("a file for a folder", f"{GAP} --out record.csv", "record.csv", "is a file", "folder"),
    place("a folder below a file", f"{GAP} --out record.csv/out", "is a file", "folder"),
    place("a folder that takes no files", f"{GAP} --out /proc/out", "/proc/out", "another --out"),
    place("a name of 300 letters", f"{GAP} --out {'o' * 300}", "too long", "--out"),
    place(
        "a file of somebody else in the place of a result",
        f"{GAP} --out out",
        "out/report.html",
        "move it away",
        files={"out/report.html": "mine"},
    ),
    place(
        "a folder in the place of a result",
        f"{GAP} --out out",
        "out/report.html",
        "move it away",
        files={"out/report.html": a_folder},
    ),
    place(
        "a link in the place of a result",
        f"{GAP} --out out",
        "out/diagnosis.json",
        files={"out/diagnosis.json": a_link_to("../record.csv")},
    ),
    place(
        "a file of somebody else in the place of a result",
        "ehsid identify record.csv --out out",
        "out/identify.json",
        "move it away",
        files={"out/identify.json": "{}"},
    ),
    place(
        "a picture of somebody else",
        "ehsid estimate record.csv --out out",
        "out/estimate.png",
        "move it away",
        files={"out/estimate.png": "mine"},
    ),
    place(
        "a manifest that is damaged",
        "ehsid identify record.csv --out out",
        "not a manifest",
        "remove it",
        files={"out/.ehsid/identify.json": "{"},
        library=READER,
    ),
    place(
        "a manifest that names files elsewhere",
        "ehsid identify record.csv --out out",
        "not a path below",
        files={
            "out/.ehsid/identify.json": '{"result": "identify", "files": {"../record.csv": '
            '{"bytes": 1, "sha256": ""}}}'
        },
    ),
    place(
        "strange files where unfinished results are made",
        "ehsid identify record.csv --out out",
        "thesis.docx",
        "move it away",
        files={"out/.ehsid/identify.unfinished/thesis.docx": "mine"},
    ),
    place("the input for the result", f"{SIMULATE} --out rig.toml", "--out rig.toml", ".csv"),
    place(
        "the logged command for the result",
        "ehsid simulate rig.toml --command record.csv --out record.csv",
        "an input of the command",
        "another --out",
    ),
    place("the record for the header", "ehsid export record.csv --out record.csv", "input"),
    place("the record for the new record", f"{INJECT} --out record.csv", "an input"),
    place(
        "the rig for the answer",
        f"{INJECT.replace('rig.toml', 'x.csv.answer.json')} --out x.csv",
        "x.csv.answer.json",
        "an input",
        files={"x.csv.answer.json": BENCH},
    ),
    place("a folder for the new record", f"{INJECT} --out out", "--out out", ".csv"),
    place("a format that is not known", f"{SIMULATE} --out new.xlsx", "--out new.xlsx", ".parquet"),
    place("no such folder", f"{SIMULATE} --out nowhere/new.csv", "no folder nowhere", "make it"),
    place(
        "a record of somebody else",
        f"{SIMULATE} --out new.csv",
        "new.csv",
        "move it away",
        files={"new.csv": "mine"},
    ),
    place(
        "a picture of somebody else beside the record",
        f"{SIMULATE} --out new.csv",
        "new.png",
        "move it away",
        files={"new.png": "mine"},
    ),
    place(
        "results in the folder of the records",
        "ehsid estimate logs --out logs",
        "--out logs",
        "another folder",
        files={"logs/record.csv": LONG},
    ),
    place(
        "a folder in which no record can be used",
        "ehsid estimate logs --out out",
        "logs/record.csv",
        "record longer",
        "logs: none of 1 files could be used",
        files={"logs/record.csv": GOOD},
    ),
    place("a folder of machines that is not there", "ehsid gap-fleet nowhere --out out", "nowhere"),
    place(
        "a file for the folder of machines", "ehsid gap-fleet record.csv --out out", "record.csv"
    ),
    place(
        "a folder without machines",
        "ehsid gap-fleet machines --out out",
        "machines",
        files={"machines": a_folder},
    ),
    place(
        "results among the machines",
        "ehsid gap-fleet machines --out machines/out",
        "machines/out",
        "outside",
        files=MACHINE,
    ),
    place(
        "results in the folder of the machines",
        "ehsid gap-fleet machines --out machines",
        "machines",
        "outside",
        files=MACHINE,
    ),
    place(
        "a folder of somebody else with the name of a machine",
        "ehsid gap-fleet machines --out out",
        "out/m1/error.txt",
        "move it away",
        files=MACHINE | {"out/m1/error.txt": "mine", "out/m1/thesis.docx": "mine"},
    ),
    place(
        "a machine without a rig file",
        "ehsid gap-fleet machines --out out",
        "nothing could be diagnosed",
        writes=("out",),
        files={"machines/m1/run.csv": LONG},
    ),
    place(
        "a machine without records",
        "ehsid gap-fleet machines --out out",
        "nothing could be diagnosed",
        writes=("out",),
        files={"machines/m1/rig.toml": BENCH},
    ),
    place(
        "a machine with the name of a result",
        "ehsid gap-fleet machines --out out",
        "nothing could be diagnosed",
        writes=("out",),
        files={"machines/fleet.html/rig.toml": BENCH, "machines/fleet.html/run.csv": LONG},
    ),
    place(
        "a check whose seal is damaged",
        "ehsid gap-check --out out",
        "out/seal.json",
        "elsewhere",
        files={"out/seal.json": "{"},
        library=READER,
    ),
    place(
        "a page of somebody else in the place of a check",
        "ehsid gap-check --out out --count 1",
        "out/report.html",
        "move it away",
        files={"out/report.html": "mine"},
    ),
    place(
        "no machines for a calibration",
        "ehsid gap-calibrate --out out",
        "--features",
    ),
    place(
        "a folder that is no check for a calibration",
        "ehsid gap-calibrate checks --out out",
        "checks/seal.json",
        "a folder that ehsid gap-check",
        files={"checks": a_folder},
    ),
    place(
        "features that are none",
        "ehsid gap-calibrate --features features.jsonl --out out",
        "features.jsonl",
        "line 2",
        files={"features.jsonl": '\n{"name": 3}\n'},
        library=READER.replace("Input data", "Expected"),
    ),
    place(
        "features without a machine",
        "ehsid gap-calibrate --features features.jsonl --out out",
        "features.jsonl",
        "no finished case",
        files={"features.jsonl": ""},
    ),
    place(
        "a page of somebody else in the place of the experiment",
        "ehsid experiment --out out",
        "out/experiment.html",
        "move it away",
        files={"out/experiment.html": "mine"},
    ),
    place(
        "samples of somebody else in the place of a run",
        f"{HIL} --loop open --out out",
        "out/record.csv",
        "move it away",
        files={"out/record.csv": LONG},
    ),
    place(
        "the rig in the place of a run's report",
        f"{HIL.replace('hil', 'hil --rig out/hil.json')} --out out",
        "out/hil.json",
        files={"out/hil.json": BENCH},
    ),
)

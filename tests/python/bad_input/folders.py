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
    *,
    files: dict[str, Content] | None = None,
    writes: tuple[str, ...] = (),
    library: str | None = None,
) -> Case:
    there = FILES | (files or {})
    return command(wrong, line, files=there, writes=writes, library=library)


CASES = (
    place("a file for a folder", f"{GAP} --out record.csv"),
    place("a folder below a file", f"{GAP} --out record.csv/out"),
    place("a folder that takes no files", f"{GAP} --out /proc/out"),
    place("a name of 300 letters", f"{GAP} --out {'o' * 300}"),
    place(
        "a file of somebody else in the place of a result",
        f"{GAP} --out out",
        files={"out/report.html": "mine"},
    ),
    place(
        "a folder in the place of a result", f"{GAP} --out out", files={"out/report.html": a_folder}
    ),
    place(
        "a link in the place of a result",
        f"{GAP} --out out",
        files={"out/diagnosis.json": a_link_to("../record.csv")},
    ),
    place(
        "a file of somebody else in the place of a result",
        "ehsid identify record.csv --out out",
        files={"out/identify.json": "{}"},
    ),
    place(
        "a picture of somebody else",
        "ehsid estimate record.csv --out out",
        files={"out/estimate.png": "mine"},
    ),
    place(
        "a manifest that is damaged",
        "ehsid identify record.csv --out out",
        files={"out/.ehsid/identify.json": "{"},
        library=READER,
    ),
    place(
        "a manifest that names files elsewhere",
        "ehsid identify record.csv --out out",
        files={
            "out/.ehsid/identify.json": '{"result": "identify", "files": {"../record.csv": '
            '{"bytes": 1, "sha256": ""}}}'
        },
    ),
    place(
        "strange files where unfinished results are made",
        "ehsid identify record.csv --out out",
        files={"out/.ehsid/identify.unfinished/thesis.docx": "mine"},
    ),
    place("the input for the result", f"{SIMULATE} --out rig.toml"),
    place(
        "the logged command for the result",
        "ehsid simulate rig.toml --command record.csv --out record.csv",
    ),
    place(
        "a folder for the header", "ehsid export record.csv --out out", files={"out/a.hpp": "mine"}
    ),
    place("no folder for the header", "ehsid export record.csv --out none/x.hpp"),
    place("a file for the run of a target", f"{HIL} --out record.csv"),
    place("the record for the header", "ehsid export record.csv --out record.csv"),
    place("the record for the new record", f"{INJECT} --out record.csv"),
    place(
        "the rig for the answer",
        f"{INJECT.replace('rig.toml', 'x.csv.answer.json')} --out x.csv",
        files={"x.csv.answer.json": BENCH},
    ),
    place("a folder for the new record", f"{INJECT} --out out"),
    place("a format that is not known", f"{SIMULATE} --out new.xlsx"),
    place("no such folder", f"{SIMULATE} --out nowhere/new.csv"),
    place("a record of somebody else", f"{SIMULATE} --out new.csv", files={"new.csv": "mine"}),
    place(
        "a picture of somebody else beside the record",
        f"{SIMULATE} --out new.csv",
        files={"new.png": "mine"},
    ),
    place(
        "results in the folder of the records",
        "ehsid estimate logs --out logs",
        files={"logs/record.csv": LONG},
    ),
    place(
        "a folder in which no record can be used",
        "ehsid estimate logs --out out",
        files={"logs/record.csv": GOOD},
    ),
    place("a folder of machines that is not there", "ehsid gap-fleet nowhere --out out"),
    place("a file for the folder of machines", "ehsid gap-fleet record.csv --out out"),
    place(
        "a folder without machines",
        "ehsid gap-fleet machines --out out",
        files={"machines": a_folder},
    ),
    place(
        "results among the machines", "ehsid gap-fleet machines --out machines/out", files=MACHINE
    ),
    place(
        "results in the folder of the machines",
        "ehsid gap-fleet machines --out machines",
        files=MACHINE,
    ),
    place(
        "a machine in the place of its result",
        "ehsid gap-fleet machines --out out",
        files=MACHINE | {"out/m1": a_link_to("../machines/m1")},
    ),
    place(
        "a folder of somebody else with the name of a machine",
        "ehsid gap-fleet machines --out out",
        files=MACHINE | {"out/m1/error.txt": "mine", "out/m1/thesis.docx": "mine"},
    ),
    place(
        "a machine without a rig file",
        "ehsid gap-fleet machines --out out",
        writes=("out",),
        files={"machines/m1/run.csv": LONG},
    ),
    place(
        "a machine without records",
        "ehsid gap-fleet machines --out out",
        writes=("out",),
        files={"machines/m1/rig.toml": BENCH},
    ),
    place(
        "a machine with the name of a result",
        "ehsid gap-fleet machines --out out",
        writes=("out",),
        files={"machines/fleet.html/rig.toml": BENCH, "machines/fleet.html/run.csv": LONG},
    ),
    place(
        "a check whose seal is damaged",
        "ehsid gap-check --out out",
        files={"out/seal.json": "{"},
        library=READER,
    ),
    place(
        "a page of somebody else in the place of a check",
        "ehsid gap-check --out out --count 1",
        files={"out/report.html": "mine"},
    ),
    place("no machines for a calibration", "ehsid gap-calibrate --out out"),
    place(
        "a folder that is no check for a calibration",
        "ehsid gap-calibrate checks --out out",
        files={"checks": a_folder},
    ),
    place(
        "features that are none",
        "ehsid gap-calibrate --features features.jsonl --out out",
        files={"features.jsonl": '\n{"name": 3}\n'},
        library=READER.replace("Input data", "Expected"),
    ),
    place(
        "features without a machine",
        "ehsid gap-calibrate --features features.jsonl --out out",
        files={"features.jsonl": ""},
    ),
    place(
        "a page of somebody else in the place of the experiment",
        "ehsid experiment --out out",
        files={"out/experiment.html": "mine"},
    ),
    place(
        "samples of somebody else in the place of a run",
        f"{HIL} --loop open --out out",
        files={"out/record.csv": LONG},
    ),
    place(
        "the rig in the place of a run's report",
        f"{HIL.replace('hil', 'hil --rig out/hil.json')} --out out",
        files={"out/hil.json": BENCH},
    ),
)

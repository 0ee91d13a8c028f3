# SPDX-License-Identifier: MIT
"""Writes the JSON Schemas of the files that other programs read: python docs/schemas/make.py"""

import json
from pathlib import Path

from ehsid.harness.base.encoding import json_schema
from ehsid.harness.base.files import write_text
from ehsid.harness.commissioning import Commissioning
from ehsid.harness.diagnosis import schema
from ehsid.harness.diagnosis.edits import EditTest
from ehsid.harness.fitness import RigCheckFile
from ehsid.harness.fleet import Fleet
from ehsid.harness.hunt.hunting import Hunt
from ehsid.harness.models.estimation import Estimates
from ehsid.harness.watch.watching import Watch
from ehsid.hil.result_file import HilFile
from ehsid.lab.blind.making import Seal
from ehsid.lab.calibration.checking import Calibration
from ehsid.lab.scoring.score import ScoreFile

SCHEMAS = {
    "apply.json": json_schema(Commissioning, "apply.json of ehsid apply"),
    "calibration.json": json_schema(Calibration, "calibration.json of ehsid gap-calibrate"),
    "diagnosis.json": schema.json_schema(),
    "edit.json": json_schema(EditTest, "edit.json of ehsid gap-edit"),
    "estimates.json": json_schema(Estimates, "estimates.json of ehsid estimate on a folder"),
    "fleet.json": json_schema(Fleet, "fleet.json of ehsid gap-fleet, schema version 1"),
    "hil.json": json_schema(HilFile, "hil.json of ehsid hil, schema version 1"),
    "hunt.json": json_schema(Hunt, "hunt.json of ehsid hunt, schema version 1"),
    "rig_check.json": json_schema(RigCheckFile, "rig_check.json of ehsid rig check"),
    "score.json": json_schema(ScoreFile, "score.json of ehsid gap-check"),
    "seal.json": json_schema(Seal, "seal.json of ehsid gap-check"),
    "watch.json": json_schema(Watch, "watch.json of ehsid watch, schema version 1"),
}

if __name__ == "__main__":
    for name, schema in SCHEMAS.items():
        path = Path(__file__).parent / name
        write_text(path, json.dumps(schema, indent=2) + "\n")
        print(path)

# SPDX-License-Identifier: MIT
"""Writes the JSON Schemas of the files that other programs read: python docs/schemas/make.py"""

import json
from pathlib import Path

from ehsid.harness.files import write_text
from ehsid.harness.gap.diagnosis_file import json_schema

if __name__ == "__main__":
    path = Path(__file__).parent / "diagnosis.json"
    write_text(path, json.dumps(json_schema(), indent=2) + "\n")
    print(path)

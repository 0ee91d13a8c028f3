# SPDX-License-Identifier: MIT
"""Fuzzes the text of rig files with atheris: libFuzzer, with coverage measured in Python.

python tests/fuzz/fuzz_rig_text.py [OPTIONS OF LIBFUZZER] FOLDER...
"""

from __future__ import annotations

import sys

import atheris

with atheris.instrument_imports(include=["tomllib", "ehsid.harness.rigs"]):
    import rig_text

if __name__ == "__main__":
    atheris.Setup(sys.argv, rig_text.check)
    atheris.Fuzz()

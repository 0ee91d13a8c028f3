# SPDX-License-Identifier: MIT
"""Bad calls of the C API. tests/c/bad_calls.c makes them; a test of ctest compares its answers."""

from __future__ import annotations

import re

from bad_input.case import Outcome
from bad_input.tables import cases_of
from sources import ROOT

TITLE = "Calls of the C API"
ABOUT = (
    "`e` is an estimator of 4 parameters that has run for 200 samples. A refused call changes "
    "nothing. A refused sample keeps the estimate and starts the history of samples anew. "
    "The last column is the status, with its meaning in `ehsid/c_api.h`."
)
HEADER = (ROOT / "cpp" / "include" / "ehsid" / "c_api.h").read_text("utf-8")
MEANINGS = {
    name: " ".join(meaning.split())
    for name, meaning in re.findall(r"EHSID_(\w+) =\s*\d+,?\s*/\* (.*?) \*/", HEADER, re.DOTALL)
}


def _outcome(status: str) -> Outcome:
    name = status.upper()
    return Outcome("status of an error", f"`EHSID_{name}`: {MEANINGS[name]}")


CASES = cases_of(ROOT / "tests" / "c" / "bad_calls.txt", _outcome)

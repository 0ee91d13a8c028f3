# SPDX-License-Identifier: MIT
"""Pages of commands name every option of their command."""

from __future__ import annotations

import re

from printed_pages import DOCS, text_of

from ehsid.harness.cli import VERBS


def test_the_page_of_the_diagnosis_has_every_option() -> None:
    (verb,) = (verb for verb in VERBS if verb.name == "gap")
    options = {name for one in verb.load().params for name in one.opts if name.startswith("--")}
    table = re.findall(r"^\| `(--[\w-]+)", text_of(DOCS / "gap.md"), flags=re.MULTILINE)
    assert set(table) == options - {"--help", "--verbose", "--quiet"}

# SPDX-License-Identifier: MIT
"""The rules of consistent diagnoses, applied to a diagnosis before it is written."""

from __future__ import annotations

from ehsid.harness.gap.diagnosis_file import diagnosis_file
from ehsid.harness.gap.schema import Diagnosis
from ehsid.harness.validation.scoring import contradictions as rules


def contradictions(diagnosis: Diagnosis) -> list[str]:
    """Returns the rules that the statements of a diagnosis break."""
    return list(rules.contradictions(diagnosis_file(diagnosis, [], "rig.toml")))

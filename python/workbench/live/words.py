# SPDX-License-Identifier: MIT
"""States and counts of a run in words."""

from __future__ import annotations

import ehsid

STATUS = {
    "ok": "The estimator follows.",
    "filling": "The estimator collects its first samples.",
    "no_information": "The signals excite too little: the estimate stays as it is.",
    "disabled": "The estimator is switched off.",
    "reset": "The plant has changed: the estimator begins to learn again.",
    "invalid_input": "A measurement is not a number: this sample is left out.",
    "out_of_range": "A signal is larger than plausible: this sample is left out.",
    "numerical_limit": "The covariance is at its numerical limit: the estimate stays as it is.",
    "invalid_argument": "The estimator refuses its settings.",
}
# What each fault does to the next frame; `hold` is told with its time.
FAULTS = {
    "drop": "Lose a frame",
    "flip": "Damage a bit",
    "cut": "Cut a frame short",
    "unended": "Join two frames",
    "repeat": "Repeat a frame",
    "noise": "Insert noise",
    "hold": "Delay by 1 s",
}


def status_words(status: int) -> str:
    """Returns the status of the estimator as a sentence."""
    return STATUS[ehsid.Status(status).name]

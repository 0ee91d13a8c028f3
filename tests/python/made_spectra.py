# SPDX-License-Identifier: MIT
"""Spectra of windows of any number and length, without a record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

from ehsid.harness.diagnosis.model.comparison import Compared
from ehsid.harness.diagnosis.model.spectrum import Spectrum


@dataclass(frozen=True)
class _Windows:
    """What a spectrum reads of a record: the number of its windows and the samples in each."""

    full_windows: tuple[int, int]


def spectrum_of(*windows: tuple[int, int]) -> Spectrum:
    """The spectrum of records with so many windows of so many samples, (W, N) for each record."""
    return Spectrum([cast(Compared, cast(Any, _Windows(each))) for each in windows])

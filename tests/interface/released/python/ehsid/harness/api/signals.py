# SPDX-License-Identifier: MIT
from __future__ import annotations
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
import numpy.typing as npt
from ehsid.harness.api.record import Source, record_of
from ehsid.harness.api.wording import log_reading
from ehsid.harness.catalogue.channels import CHANNELS, TIME
from ehsid.harness.identification import IoData
from ehsid.harness.records import Origin, read_record
from ehsid.harness.text import printable
Arrays = tuple[npt.ArrayLike, npt.ArrayLike, float | None]

@dataclass(frozen=True)
class Signals:
    data: IoData
    name: str
    origin: Origin | None = None
    source: Path | None = None

    @property
    def inputs(self) -> list[Path]:
        ...

    @property
    def output_label(self) -> str:
        ...

def signals_of(source: Source | Arrays, input: str, output: str) -> Signals:
    ...

@contextmanager
def about(signals: Signals) -> Iterator[None]:
    ...

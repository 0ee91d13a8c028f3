# SPDX-License-Identifier: MIT
from __future__ import annotations
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal
from ehsid.harness import rigs
from ehsid.harness.api.tables import Shown
from ehsid.harness.api.wording import in_python
from ehsid.harness.files import result_files, write_text
from ehsid.harness.report.text_table import TextTable
from ehsid.harness.rigs import parse_rig, read_rig, rig_text
from ehsid.harness.rigs.questions import answered, rig_file_text
from ehsid.harness.rigs.checks import unknown
from ehsid.harness.rigs.new import shown
from ehsid.harness.rigs.questions import QUESTIONS

class Rig(Shown):

    def __init__(self, result: rigs.Rig, *, source: Path | None=None, text: str | None=None) -> None:
        ...

    @classmethod
    def read(cls, path: str | os.PathLike[str]) -> Rig:
        ...

    @classmethod
    def new(cls, plant: Literal['ehs', 'axis']='ehs', *, name: str='rig', double_rod: bool=False, hoses: bool=False, drop_over: Literal['edge', 'both']='edge', **answers: str) -> Rig:
        ...

    @property
    def name(self) -> str:
        ...

    @property
    def plant(self) -> str:
        ...

    @property
    def values(self) -> Mapping[str, float]:
        ...

    def with_values(self, values: Mapping[str, float]) -> Rig:
        ...

    def save(self, path: str | os.PathLike[str]) -> Path:
        ...
RigSource = str | os.PathLike[str] | Rig | rigs.Rig

def rig_of(source: RigSource) -> Rig:
    ...

# SPDX-License-Identifier: MIT
from __future__ import annotations
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any, Protocol
import numpy as np
import numpy.typing as npt
if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

class Frame(Protocol):

    @property
    def columns(self) -> Iterable[Any]:
        ...
Columns = Mapping[str, npt.ArrayLike] | Frame

def columns_of(source: Columns) -> dict[str, npt.ArrayLike]:
    ...

class Tabular(ABC):

    def to_polars(self) -> pl.DataFrame:
        ...

    def to_pandas(self) -> pd.DataFrame:
        ...

def pandas_frame(columns: Mapping[str, npt.ArrayLike]) -> pd.DataFrame:
    ...

def time_column(dt_s: float | None, index: npt.NDArray[Any]) -> dict[str, npt.NDArray[Any]]:
    ...

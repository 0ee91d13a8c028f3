# SPDX-License-Identifier: MIT
"""Makes the whole text of a firmware header, of C sources or of a function block, of a record."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import ehsid

from ..base.exchange import sha256_of
from ..models.identification import ArxOrders, IoData, identify
from .configuration import Export, configure_from_record
from .estimator_fmu import fmu_files
from .fmu import held_in_words, write_fmu
from .header import GoldenTrace, check_name, liveliest, render_c_header, render_header
from .source import Sources, render_sources
from .structured_text import function_block

# Names of the file where nothing else is asked for, by whether it is C.
FILE_NAMES = {False: "servo_configuration.hpp", True: "servo_configuration.h"}


Whole = Literal["c", "st"]


@dataclass(frozen=True)
class Header:
    """A header for a firmware."""

    text: str
    """Content of the file."""
    export: Export
    """Configuration and offline model from which it was made."""
    tested: str
    """What its self-test covers, in words."""
    converges: bool
    """Whether the estimator reports that it has converged at the end of the record."""
    beside: str = ""
    """Content of the file beside it: the header of a C source, the XML of a function block."""

    @property
    def orders(self) -> ArxOrders:
        """Structure of the model."""
        return self.export.configuration.orders

    @property
    def summary(self) -> str:
        """What the header holds, in one line."""
        return (
            f"{self.orders}, {self.export.configuration.forgetting!r}; started from "
            f"{self.export.model.n_rows} equations that count for {self.export.counts_for:.0f} "
            f"samples; {self.tested}"
        )

    def write_fmu(self, path: Path, name: str, fmi: int, dtype: str, dt_s: float | None) -> str:
        """Writes C sources with the stem STEM as an FMU, and returns what it holds, in words."""
        sources = Sources(self.beside, self.text)
        configuration = self.export.configuration
        files = fmu_files(configuration, sources, name=name, fmi=fmi, dtype=dtype, dt_s=dt_s)
        return held_in_words(write_fmu(path, files, name=name, fmi=fmi), fmi)


def chosen_orders(data: IoData, *, offset: bool = True) -> ArxOrders:
    """Returns the structure that offline identification chooses for the record."""
    return identify(data, offset=offset, remove_means=not offset).chosen.orders


def header_of_record(
    source: Path,
    data: IoData,
    orders: ArxOrders,
    *,
    forgetting: ehsid.Forgetting,
    inflation: float | None = None,
    reset: bool = True,
    name: str = "servo",
    c: bool = False,
    whole: Whole | None = None,
    stem: str = "servo_estimator",
    dtype: str = "float32",
) -> Header:
    """Identifies a model of a record and returns the text that starts an estimator from it.

    Parameters
    ----------
    source
        file of the record; the text names it without its folder.
    data
        input and output of the record.
    orders, forgetting, inflation, reset
        as in `configure_from_record`.
    name
        namespace in C++, prefix in C, name of the function block without its suffix `_estimator`.
    c
        whether to write a header in C99, for ehsid/c_api.h; it has no self-test.
    whole
        the whole estimator in place of a header: "c" for C99 sources, "st" for a function block in
        Structured Text and PLCopen XML.
    stem
        name of C sources without .c and .h.
    dtype
        float32 or float64, of the whole estimator; a header is float32.

    Raises
    ------
    ValueError
        the name or a setting cannot be used, or the record does not determine the model.
    """
    check_name(name)
    export = configure_from_record(
        data, orders, forgetting=forgetting, inflation=inflation, reset=reset
    )
    configuration, converges = export.configuration, _converges(export, data, dtype)
    provenance = _provenance(source, data, export)
    if whole == "st":
        block = function_block(
            configuration, name=name, dtype=dtype, dt_s=data.dt_s, provenance=provenance
        )
        tested = f"{block.variables[0].type}, no self-test"
        return Header(block.text, export, tested, converges, block.xml)
    if c and whole is None:
        text = render_c_header(configuration, name=name, dt_s=data.dt_s, provenance=provenance)
        return Header(text, export, "no self-test", converges)
    trace = GoldenTrace.of(configuration, *liveliest(data), dtype)
    tested = f"self-test over {trace.command.size} samples"
    if whole is None:
        text = render_header(configuration, trace, name=name, dt_s=data.dt_s, provenance=provenance)
        return Header(text, export, tested, converges)
    made = render_sources(
        configuration,
        trace,
        name=name,
        stem=stem,
        dtype=dtype,
        dt_s=data.dt_s,
        provenance=provenance,
    )
    return Header(made.source, export, f"{dtype}, {tested}", converges, made.header)


def _converges(export: Export, data: IoData, dtype: str) -> bool:
    """Whether the estimator reports that it has converged after a run over the record."""
    estimator = export.configuration.estimator(dtype)
    for segment in data.segments:
        estimator.step(float("nan"), float("nan"))  # clears the history at a gap of the record
        estimator.run(data.u[segment], data.y[segment])
    return estimator.converged


def _provenance(path: Path, data: IoData, export: Export) -> list[str]:
    """Returns lines that say where the numbers come from; the record is named without folder."""
    sampled = "" if data.dt_s is None else f" at {data.dt_s:.6g} s"
    scale = export.configuration.scaling.position_scale
    deviation = math.sqrt(export.model.noise_variance) * scale
    return [
        f"Record {path.name}, {data.n_samples} samples{sampled},",
        f"sha256 {sha256_of(path)};" if path.is_file() else "a folder;",
        f"command: {data.input_name}, position: {data.output_name}, in the units of the record.",
        f"Offline model: {export.configuration.orders}, least squares over "
        f"{export.model.n_rows} equations,",
        f"deviation of the residuals {deviation:.4g}. P_0 is its covariance times "
        f"{export.inflation:.4g}:",
        f"the model counts for {export.counts_for:.0f} samples. A reset goes back to a vague P.",
    ]

# SPDX-License-Identifier: MIT
"""Header of a `GrowthMonitor`: its tables, the names of its tests, and a self-test."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import ehsid

from ..base.exchange import sha256_of
from ..models.identification import IoData
from ..rigs import Rig
from .growth import HOURS, PRIOR, GrowthTables, growth_tables
from .header import check_name, comment, float32_literal, template


@dataclass(frozen=True)
class GrowthHeader:
    """A header for a firmware, and the tables in it."""

    text: str
    tables: GrowthTables

    @property
    def summary(self) -> str:
        """What the header holds, in one line."""
        t = self.tables
        units = ", ".join(f"{effect.name} {effect.sizes[0]:.3g}" for effect in t.effects)
        return (
            f"GrowthMonitor, {t.dt_s:.6g} s, delay {t.observer.delay}, blocks of {t.block} "
            f"samples, limit {t.limit:.1f}; units: {units}"
        )


def _self_test(tables: GrowthTables) -> tuple[list[float], dict[str, float | int]]:
    """Returns what the self-test of the header sums up, and the numbers of its signal.

    It has the operations of the header, in its order, in float32.
    """
    samples = 2 * tables.block + tables.observer.settle + 100
    step = np.float32(tables.command_edges[-1] / 3.0)
    bias = np.float32(tables.command_edges[-1] / 50.0)
    noise = np.float32(1e-5 * 2.0**-16)
    gain = np.float32(tables.observer.numbers(tables.dt_s)[0])
    k = np.arange(samples)
    command = ((k // 25 % 8).astype(np.float32) - np.float32(3.5)) * step
    moved = np.concatenate([np.zeros(1, np.float32), gain * (command[:-1] + bias)])
    position = np.add.accumulate(moved, dtype=np.float32)
    random = np.empty(samples, np.uint32)
    state = 1
    for i in range(samples):
        state = (state * 1664525 + 1013904223) % 2**32
        random[i] = state >> 16
    run = tables.monitor().run(command, position + random.astype(np.float32) * noise)
    columns = np.column_stack([run.innovation, run.statistic])
    told = np.add.accumulate(columns, axis=0, dtype=np.float32)[-1]
    signal = {"step": float(step), "noise": float(noise), "bias": float(bias)}
    return told.tolist(), {"samples": samples, **signal}


def _braces(numbers: Iterable[float]) -> str:
    return "{" + ", ".join(float32_literal(float(number)) for number in numbers) + "}"


def render_growth_header(
    tables: GrowthTables, *, name: str = "servo", provenance: Sequence[str] = ()
) -> str:
    """Returns the text of the header; raises ValueError where the name cannot be used."""
    told, signal = _self_test(tables)
    return template("growth.hpp.j2").render(
        name=check_name(name),
        version=ehsid.__version__,
        provenance=[comment(line) for line in provenance],
        tables=tables,
        servo=tables.observer.numbers(tables.dt_s).tolist(),
        cells=list(zip(tables.mean, tables.weight, tables.other, tables.signature, strict=True)),
        prior=PRIOR**2,
        told=told,
        braces=_braces,
        **signal,
    )


def growth_header_of_record(
    source: Path, data: IoData, rig: Rig, *, name: str = "servo", hours: float = HOURS
) -> GrowthHeader:
    """Makes the header from the record `source` of the quiet machine; see `growth_tables`."""
    check_name(name)
    tables = growth_tables(rig, data, hours)
    observer = tables.observer
    provenance = [
        f"Record {source.name}, {data.n_samples} samples at {tables.dt_s:.6g} s,",
        f"sha256 {sha256_of(source)};" if source.is_file() else "a folder;",
        f"command: {data.input_name}, position: {data.output_name}; rig {rig.name}.",
        f"K {observer.gain:.4g}, omega_n {observer.omega_n:.4g} rad/s, xi {observer.xi:.3g}.",
        f"One false alarm of all tests together in {hours:g} h of running.",
    ]
    return GrowthHeader(render_growth_header(tables, name=name, provenance=provenance), tables)

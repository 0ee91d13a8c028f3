# SPDX-License-Identifier: MIT
"""The table of orders has all its digits on a terminal of 80 columns."""

from __future__ import annotations

import io

import numpy as np
import pytest
from identification_truth import model16

from ehsid.harness.cli.console import Console, print_blocks
from ehsid.harness.models.identification import IoData, identify
from ehsid.harness.show.model_tables import candidate_table


@pytest.mark.parametrize("size", [1e-6, 1e-4, 1.0, 1e6])
def test_the_table_of_orders_has_all_digits_at_80_columns(size: float) -> None:
    u, y = model16(seed=4, n=800, noise=1e-3)
    result = identify(IoData.from_arrays(u, size * np.asarray(y)))
    table = candidate_table(result)
    out = io.StringIO()
    print_blocks([table], Console(file=out, width=80))
    assert "…" not in out.getvalue()
    for row in table.rows:
        assert all(cell in out.getvalue() for cell in row)
    power = next((w for w in table.caption.split() if w.startswith("1e")), "1")
    for row, candidate in zip(table.rows, result.by_order, strict=True):
        for cell, value in (
            (row[4], candidate.validation.fpe),
            (row[5], candidate.validation.loss),
            (row[7], candidate.validation.mdl),
        ):
            # Of numbers that are far from those of the chosen order there is one digit.
            digits = 1e-4 if "e" not in cell else 0.5
            assert float(cell) * float(power) == pytest.approx(value, rel=digits)

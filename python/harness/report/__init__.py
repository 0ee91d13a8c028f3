# SPDX-License-Identifier: MIT
"""Renders findings as figures, tables and pages; computes nothing."""

from ehsid.harness.report.comparison_figures import change_figure, error_figure
from ehsid.harness.report.figures import estimation_figure, identification_figure
from ehsid.harness.report.page import (
    Page,
    Picture,
    Section,
    Table,
    Words,
    render_page,
    write_page,
)
from ehsid.harness.report.record_figure import record_figure

__all__ = [
    "Page",
    "Picture",
    "Section",
    "Table",
    "Words",
    "change_figure",
    "error_figure",
    "estimation_figure",
    "identification_figure",
    "record_figure",
    "render_page",
    "write_page",
]

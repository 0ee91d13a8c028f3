# SPDX-License-Identifier: MIT
"""Renders findings as figures; computes nothing."""

from ehsid.harness.report.figures import estimation_figure, identification_figure

__all__ = ["estimation_figure", "identification_figure"]

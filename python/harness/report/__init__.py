# SPDX-License-Identifier: MIT
"""Renders findings as figures, tables and pages; does no analysis of its own.

Most pages need only one of matplotlib and bokeh: import from the module that you need.
"""

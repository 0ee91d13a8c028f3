# SPDX-License-Identifier: MIT
"""Renders findings as figures, tables and pages; computes nothing.

A page needs matplotlib or bokeh, seldom both: import from the module that is needed.
"""

# SPDX-License-Identifier: MIT
"""Logs as rigs write them: any names, units, clocks and file kinds, made into records.

A module of `kinds` returns a `Log`. The modules here find out which series is which channel
(`matching`), when its values were taken (`clock`), and bring all series to one uniform time
(`uniform`). `reading` calls them in this order.
"""

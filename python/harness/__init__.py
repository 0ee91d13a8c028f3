# SPDX-License-Identifier: MIT
"""The harness around the compiled estimator: records, offline identification, reports, commands."""

# SPDX-License-Identifier: MIT
"""The workbench in the browser: it shows and starts what the commands do, and computes nothing."""

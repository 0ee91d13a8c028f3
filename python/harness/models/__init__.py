# SPDX-License-Identifier: MIT
"""Models from records: offline identification and recursive estimation."""

# SPDX-License-Identifier: MIT
"""From fits to findings: candidates, evidence for each, where and how far, the verdict."""

# SPDX-License-Identifier: MIT
"""Sections and pictures of the report on the published experiment."""

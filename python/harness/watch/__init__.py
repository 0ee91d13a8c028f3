# SPDX-License-Identifier: MIT
"""A machine's life: what its dated logs tell over months, and when something changed."""

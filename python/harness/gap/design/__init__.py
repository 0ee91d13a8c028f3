# SPDX-License-Identifier: MIT
"""The next experiment: what would separate the causes that the records cannot."""

# SPDX-License-Identifier: MIT
"""Design of the next experiment, which separates causes that the records cannot separate."""

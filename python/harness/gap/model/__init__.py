# SPDX-License-Identifier: MIT
"""The servo as it is fitted: parameters, cost, fits, and what its equations leave over."""

# SPDX-License-Identifier: MIT
"""What the records are worth: faults of the data, noise floor, regimes that were visited."""

# SPDX-License-Identifier: MIT
"""Quality of the records: faults of the data, noise floor, and the visited regimes."""

# SPDX-License-Identifier: MIT
"""Model of the servo for the diagnosis: parameters, cost, fits, and residuals of its equations."""

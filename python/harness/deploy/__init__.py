# SPDX-License-Identifier: MIT
"""From the host to the target: exported configurations, and the hardware in the loop."""

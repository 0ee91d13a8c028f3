# SPDX-License-Identifier: MIT
"""What a simulated trace tells about a gap where the simulator itself is not at hand."""

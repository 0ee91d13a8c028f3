# SPDX-License-Identifier: MIT
"""Live: a run with the hardware in the loop as it goes on; what `ehsid hil` does, on the page."""

# SPDX-License-Identifier: MIT
"""Many machines side by side: each is diagnosed, then they are ranked."""

# SPDX-License-Identifier: MIT
"""The command `ehsid app`."""

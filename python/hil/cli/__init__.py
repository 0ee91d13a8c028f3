# SPDX-License-Identifier: MIT
"""The command `ehsid hil`."""

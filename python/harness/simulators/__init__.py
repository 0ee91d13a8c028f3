# SPDX-License-Identifier: MIT
"""A user's own simulator: what its file says of it, and how it is opened and stepped."""

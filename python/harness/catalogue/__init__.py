# SPDX-License-Identifier: MIT
"""Tables that several rooms read: effects and values of the plant, their names, and channels."""

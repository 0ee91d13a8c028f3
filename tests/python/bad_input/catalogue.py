# SPDX-License-Identifier: MIT
"""All groups of bad input, in the order of the document."""

from bad_input import arrays, c_calls, folders, frames, options, records, rigs, uses

GROUPS = (records, uses, rigs, options, folders, arrays, c_calls, frames)

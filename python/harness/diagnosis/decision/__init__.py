# SPDX-License-Identifier: MIT
"""From fits to the verdict: probabilities, the answer that loses least, its words."""

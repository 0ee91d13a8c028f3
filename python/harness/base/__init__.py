# SPDX-License-Identifier: MIT
"""What every room may use: files, errors as messages, numbers, parallel tasks."""

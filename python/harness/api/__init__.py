# SPDX-License-Identifier: MIT
"""What `import ehsid` offers to people: records, models, runs and diagnoses that show themselves.

The names of this room are names of the package `ehsid`, which imports each when it is first used.
Every result wraps what a room of the harness returns, and keeps it as `result`.
"""

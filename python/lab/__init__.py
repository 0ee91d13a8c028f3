# SPDX-License-Identifier: MIT
"""The lab: what judges ehsid. Blind checks, their score, calibration, the published experiment."""

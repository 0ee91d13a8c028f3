# SPDX-License-Identifier: MIT
"""What a user can wish for during a run: another start of the estimator, and the end of the run."""

from __future__ import annotations

from collections.abc import Callable

from ehsid.harness.firmware.configuration import EstimatorConfiguration


class Stopped(Exception):  # noqa: N818 -- the user's wish
    """Raised by a `Steer`: the run ends before this sample, with the samples so far as result."""


# Called with the number of each sample before it is sent. Returns the settings with which the
# estimator of the target begins anew at this sample; None lets it go on.
Steer = Callable[[int], EstimatorConfiguration | None]

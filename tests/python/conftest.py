# SPDX-License-Identifier: MIT
"""Settings that hold for all tests."""

from hypothesis import settings

# No test depends on the clock: on a slow or busy machine an example may take as long as it needs.
settings.register_profile("ehsid", deadline=None)
settings.load_profile("ehsid")

# SPDX-License-Identifier: MIT
"""The interface is that of the last release, or what changed is allowed: docs/deprecation.md."""

import shutil

import interface
import pytest
from rules import problems

NEEDS_DOXYGEN = ("C++", "C")


@pytest.mark.slow
@pytest.mark.parametrize("name", interface.INTERFACES)
def test_no_user_of_the_last_release_is_broken(name: str) -> None:
    if name in NEEDS_DOXYGEN and shutil.which("doxygen") is None:
        pytest.skip("doxygen is not installed; Debian and Ubuntu: apt install doxygen")
    changes = interface.changes(name)
    released, now = interface.released_version(), interface.version()
    found = problems(changes, released, now, interface.deprecated())
    if found:
        pytest.fail("\n".join(found), pytrace=False)


def test_what_is_kept_is_not_of_a_later_version() -> None:
    assert interface.released_version() <= interface.version()


@pytest.mark.parametrize("name", interface.TABLES)
def test_what_is_kept_is_not_empty(name: str) -> None:
    assert len(interface.released_table(name)) > 100

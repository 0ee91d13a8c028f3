# SPDX-License-Identifier: MIT
"""Compares the interface with that of the last release: python tests/interface/report.py [--take]

With --take the interface of the sources is kept as that of the last release.
"""

import sys

import interface
from rules import problems


def main(arguments: list[str]) -> int:
    """Returns the exit code: 1 where something is broken, 2 for unknown arguments."""
    if arguments == ["--take"]:
        interface.take()
        print(f"the interface of version {interface.version()} is kept in {interface.RELEASED}")
        return 0
    if arguments:
        print("usage: script/interface [--take]", file=sys.stderr)
        return 2
    released, now = interface.released_version(), interface.version()
    print(f"the interface of the sources, version {now}, beside that of version {released}:")
    broken = []
    for name in interface.INTERFACES:
        changes = interface.changes(name)
        for change in changes:
            if not change.breaks:
                print(f"  {change}")
        broken += problems(changes, released, now, interface.deprecated())
    for problem in broken:
        print(problem)
    print(f"{len(broken)} changes are not allowed" if broken else "every change is allowed")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

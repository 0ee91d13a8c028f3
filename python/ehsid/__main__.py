# SPDX-License-Identifier: MIT
"""Entry point of the command `ehsid`, also as `python -m ehsid`.

The command is imported inside of the function, so that Ctrl-C gives no traceback meanwhile either.
"""

import sys


def main() -> None:
    """Runs the command; Ctrl-C ends it with exit code 130."""
    try:
        from ehsid.harness.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write("ehsid: interrupted\n")
        sys.exit(130)


if __name__ == "__main__":
    main()

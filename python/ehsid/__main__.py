# SPDX-License-Identifier: MIT
"""Entry point of the command `ehsid`, also as `python -m ehsid`.

The command is imported inside of the function, so that Ctrl-C gives no traceback meanwhile either.
"""

import sys

INTERRUPTED = "ehsid: interrupted\n"


def main() -> None:
    """Runs the command; Ctrl-C ends it with exit code 130."""
    try:
        from ehsid.harness.base.surroundings import settle

        settle()
        from ehsid.harness.cli import main as run

        run()
    except KeyboardInterrupt:
        sys.stderr.write(INTERRUPTED)
        sys.exit(130)
    except OSError as error:  # from --help or --version
        from ehsid.harness.base.error_words import error_words

        sys.stderr.write(f"ehsid: {error_words(error)}\n")
        sys.exit(2)
    except SystemExit as end:
        # Between the commands and this function typer ends an interrupted program without a line.
        if isinstance(getattr(end.__context__, "__cause__", None), KeyboardInterrupt):
            sys.stderr.write(INTERRUPTED)
        raise


if __name__ == "__main__":
    main()

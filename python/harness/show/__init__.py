# SPDX-License-Identifier: MIT
"""Renders findings as figures, tables and pages; does no analysis of its own.

Most pages need only one of matplotlib and bokeh: import from the module that you need.
"""

import os
from pathlib import Path


def _import_without_style_of_folder() -> None:
    """Imports matplotlib for a command, whose folder may have a `matplotlibrc` of someone else.

    matplotlib reads it at its import, before the file that the command has named in its place. Who
    uses `import ehsid` keeps the style of the folder.
    """
    folder = Path.cwd()
    os.chdir(Path(__file__).parent)
    try:
        import matplotlib  # noqa: F401 -- it is needed later
    finally:
        os.chdir(folder)


if os.environ.get("MATPLOTLIBRC") == os.devnull and Path("matplotlibrc").exists():
    _import_without_style_of_folder()

# SPDX-License-Identifier: MIT
"""Refuses subinterpreters, where the compiled module would wait for ever for a lock."""

import importlib
from typing import Any


def check_interpreter() -> None:
    """Checks that this is the main interpreter of the process.

    Raises
    ------
    ImportError
        this is a subinterpreter.
    """
    module: Any = None
    for name in ("_interpreters", "_xxsubinterpreters"):  # from Python 3.13 on, and before
        try:
            module = importlib.import_module(name)
        except ImportError:  # a Python without subinterpreters
            continue
        break
    if module is not None and module.get_current() != module.get_main():
        raise ImportError(
            "ehsid cannot be imported in a subinterpreter: expected the main interpreter; use "
            "threads or processes"
        )

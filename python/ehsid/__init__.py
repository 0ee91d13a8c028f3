# SPDX-License-Identifier: MIT
"""Identification of electro-hydraulic servos, and diagnosis of their simulations.

Every public name of the compiled module, listed in _core.pyi, is a name of this package: the C++
estimator, as firmware runs it. Beside them stand functions and classes for people, described in
docs/python.md. They are imported when they are first used, so that `import ehsid` stays quick.

>>> record = ehsid.read("log.csv")
>>> model = ehsid.identify(record)
>>> print(model.summary())
"""

import logging as _logging
from importlib import import_module as _import_module
from typing import TYPE_CHECKING

from ehsid._interpreter import check_interpreter as _check_interpreter

_check_interpreter()
# What is logged is for who asks for it: `logging.basicConfig(level="INFO")`, or ehsid -v.
_logging.getLogger("ehsid").addHandler(_logging.NullHandler())

from ehsid._core import *  # noqa: E402, F403 -- each forgetting policy is a name of its own
from ehsid._core import __version__ as __version__  # noqa: E402

if TYPE_CHECKING:  # editors and type checkers read this, Python follows the table below
    from ehsid.harness.api.diagnose import Diagnosis as Diagnosis
    from ehsid.harness.api.diagnose import diagnose as diagnose
    from ehsid.harness.api.estimate import Estimation as Estimation
    from ehsid.harness.api.estimate import estimate as estimate
    from ehsid.harness.api.hunt import Hunt as Hunt
    from ehsid.harness.api.hunt import hunt as hunt
    from ehsid.harness.api.identify import Identification as Identification
    from ehsid.harness.api.identify import identify as identify
    from ehsid.harness.api.record import Record as Record
    from ehsid.harness.api.record import read as read
    from ehsid.harness.api.rig import Rig as Rig
    from ehsid.harness.api.simulate import Simulation as Simulation
    from ehsid.harness.api.simulate import simulate as simulate
    from ehsid.harness.api.watch import Watch as Watch
    from ehsid.harness.api.watch import watch as watch

# Name -> module of ehsid.harness.api that has it.
_LAZY = {
    "Diagnosis": "diagnose",
    "Estimation": "estimate",
    "Hunt": "hunt",
    "Identification": "identify",
    "Record": "record",
    "Rig": "rig",
    "Simulation": "simulate",
    "Watch": "watch",
    "diagnose": "diagnose",
    "estimate": "estimate",
    "hunt": "hunt",
    "identify": "identify",
    "read": "record",
    "simulate": "simulate",
    "watch": "watch",
}


if not TYPE_CHECKING:  # to a type checker a module with this function has every name

    def __getattr__(name):
        """Imports a name for people when it is first used (PEP 562)."""
        if name not in _LAZY:
            raise AttributeError(f"module 'ehsid' has no attribute {name!r}")
        value = getattr(_import_module(f"ehsid.harness.api.{_LAZY[name]}"), name)
        globals()[name] = value
        return value


_NOT_FOR_PEOPLE = {"TYPE_CHECKING", "harness", "hil", "lab", "workbench"}


def __dir__() -> list[str]:
    """Lists the names for people: what is private, or a module of Python, is not among them."""
    own = {name for name in globals() if not name.startswith("_")} - _NOT_FOR_PEOPLE
    return sorted({*own, *_LAZY, "__doc__", "__version__"})


if not TYPE_CHECKING:  # it cannot be a list of constants: each forgetting policy is a name
    __all__ = [name for name in __dir__() if not name.startswith("_")]

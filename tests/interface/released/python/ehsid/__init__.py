# SPDX-License-Identifier: MIT
import logging as _logging
from importlib import import_module as _import_module
from typing import TYPE_CHECKING
from ehsid._interpreter import check_interpreter as _check_interpreter
_check_interpreter()
_logging.getLogger('ehsid').addHandler(_logging.NullHandler())
from ehsid._core import *
from ehsid._core import __version__ as __version__
if TYPE_CHECKING:
    from ehsid.harness.api.diagnose import Diagnosis as Diagnosis
    from ehsid.harness.api.diagnose import diagnose as diagnose
    from ehsid.harness.api.estimate import Estimation as Estimation
    from ehsid.harness.api.estimate import estimate as estimate
    from ehsid.harness.api.identify import Identification as Identification
    from ehsid.harness.api.identify import identify as identify
    from ehsid.harness.api.record import read as read
    from ehsid.harness.api.record import Record as Record
    from ehsid.harness.api.rig import Rig as Rig
    from ehsid.harness.api.simulate import Simulation as Simulation
    from ehsid.harness.api.simulate import simulate as simulate
_LAZY = {'Diagnosis': 'diagnose', 'Estimation': 'estimate', 'Identification': 'identify', 'Record': 'record', 'Rig': 'rig', 'Simulation': 'simulate', 'diagnose': 'diagnose', 'estimate': 'estimate', 'identify': 'identify', 'read': 'read', 'simulate': 'simulate'}
if not TYPE_CHECKING:
    pass
if not TYPE_CHECKING:
    __all__ = [name for name in __dir__() if not name.startswith('_')]

# SPDX-License-Identifier: MIT
"""Online identification of electro-hydraulic servos: the C++ estimator, as firmware runs it.

Every public name of the compiled module, listed in _core.pyi, is a name of this package.
"""

from ehsid._interpreter import check_interpreter

check_interpreter()

from ehsid._core import *  # noqa: E402, F403 -- each forgetting policy is a name of its own
from ehsid._core import __version__ as __version__  # noqa: E402

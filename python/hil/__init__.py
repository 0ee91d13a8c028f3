# SPDX-License-Identifier: MIT
"""Hardware in the loop: controller and estimator run on a target, the plant on this host.

docs/hil_protocol.md describes the protocol between the two.

>>> with emulated(Path("firmware.elf")) as port, open_line(port) as line:
...     session = Session(line)
...     session.hello()
"""

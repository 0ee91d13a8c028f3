# SPDX-License-Identifier: MIT
"""The form of a run: target, machine, test signal and estimator."""

from __future__ import annotations

from typing import Any

import panel as pn

from .. import look
from ..workbench import Workbench
from .layout import in_columns
from .settings import MACHINES, POLICIES, SIGNALS, LiveSettings

PUBLISHED, OTHER = "published experiment", "another rig file"
TARGETS = {"serial port or address": False, "firmware in QEMU": True}
LOOPS = {"open loop": False, "position control": True}
PACES = {"in real time": True, "as fast as it goes": False}
GAINS = {"follows the estimate": True, "stays fixed": False}
ABOUT_LOOPS = (
    "<p class='soft'>In the open loop the test signal is the command. With position control it is "
    "the reference of the controller on the target.</p>"
)
# Fields in which the user types: name in the settings, label, and what an empty one shows.
TYPED = {
    "port": ("serial port or address", "such as /dev/ttyACM0 or socket://localhost:4444"),
    "baud": ("baud rate of a serial port", "115200"),
    "image": ("firmware image, an ELF file", "such as build/firmware/servo_an386.elf"),
    "rig": ("path of the rig file", "such as rig.toml"),
    "effects": ("effects of the simulated machine", "such as coulomb_friction.force_n=400"),
    "duration_s": ("duration in s", "60"),
    "dt_ms": ("sampling time in ms", "20"),
    "amplitude": ("amplitude in V", "a tenth of the rated one"),
    "bandwidth_hz": ("bandwidth of the loop in Hz", "at most 2"),
    "seed": ("seed of signal and noise", "0"),
}


class LiveForm:
    """The fields, filled with the settings of the last run.

    Attributes
    ----------
    layout
        what is shown.
    """

    def __init__(self, workbench: Workbench, settings: LiveSettings) -> None:
        self._fields: dict[str, Any] = {
            name: look.text_input(label, value=getattr(settings, name), placeholder=hint)
            for name, (label, hint) in TYPED.items()
        }
        rigs = {
            f"machine {name}": str(workbench.opened(name).rig_file)
            for name in workbench.names()
            if workbench.opened(name).rig_file.exists()
        }
        self._rigs = {PUBLISHED: "", **rigs, OTHER: OTHER}
        chosen = settings.rig if settings.rig in self._rigs.values() else OTHER
        self._rig = look.select("rig", options=self._rigs, value=chosen)
        self._fields |= {
            "emulated": look.select("target", options=TARGETS, value=settings.emulated),
            "machine": look.select(
                "board of QEMU",
                options={f"{n}, {m}": n for n, m in MACHINES.items()},
                value=settings.machine,
            ),
            "position_control": look.select("loop", options=LOOPS, value=settings.position_control),
            "signal": look.select("test signal", options=list(SIGNALS), value=settings.signal),
            "forgetting": look.select(
                "forgetting policy", options=list(POLICIES), value=settings.forgetting
            ),
            "retune": look.select("gain of the controller", options=GAINS, value=settings.retune),
            "real_time": look.select("pace", options=PACES, value=settings.real_time),
        }
        for name in ("emulated", "position_control"):
            self._fields[name].param.watch(lambda event: self._show(), "value")
        self._rig.param.watch(lambda event: self._show(), "value")
        field = self._fields
        self.layout = pn.Column(
            look.words("<h2>Target</h2>"),
            self._row("emulated", "port", "baud", "image", "machine", least="19rem"),
            look.words("<h2>Machine, which is simulated here</h2>"),
            in_columns(self._rig, field["rig"], field["effects"], least="19rem"),
            look.words(f"<h2>Run</h2>{ABOUT_LOOPS}"),
            self._row("position_control", "signal", "amplitude", "duration_s", "dt_ms", "seed"),
            self._row("forgetting", "real_time", "bandwidth_hz", "retune"),
            sizing_mode="stretch_width",
        )
        self._show()

    def _row(self, *names: str, least: str = "14rem") -> pn.Column:
        return in_columns(*(self._fields[name] for name in names), least=least)

    def _show(self) -> None:
        """Shows the fields that the choices need."""
        field, control = self._fields, self._fields["position_control"].value
        for name in ("image", "machine"):
            field[name].visible = field["emulated"].value
        for name in ("port", "baud"):
            field[name].visible = not field["emulated"].value
        field["rig"].visible = self._rig.value == OTHER
        field["bandwidth_hz"].visible = field["retune"].visible = control
        field["amplitude"].name = "amplitude in mm" if control else "amplitude in V"
        field["amplitude"].placeholder = (
            "3 % of the stroke" if control else "a tenth of the rated one"
        )

    def settings(self) -> LiveSettings:
        """Returns what is chosen.

        Raises
        ------
        ValueError
            another rig file is chosen, and not named.
        """
        values = {name: field.value for name, field in self._fields.items()}
        if self._rig.value != OTHER:
            values["rig"] = self._rig.value
        elif not values["rig"].strip():
            raise ValueError(
                "path of the rig file: nothing is given: expected a file such as rig.toml; fill it "
                "in, or choose another rig"
            )
        if not values["position_control"]:
            values["bandwidth_hz"] = ""
        return LiveSettings(**values)

# SPDX-License-Identifier: MIT
"""The form of a run, and the sliders of the simulated machine, which stay while it goes on."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import panel as pn

from ehsid.harness.catalogue.parameters import value_name
from ehsid.harness.rigs import Rig
from ehsid.harness.show.gap_words import first_upper

from .. import look
from ..look import in_columns
from ..workbench import Workbench
from .effects import effect_text, moved, sizes_of, stops
from .settings import IMAGE, LINE, MACHINES, POLICIES, SIGNALS, TARGETS, LiveSettings, rig_of

PUBLISHED, OTHER = "published experiment", "another rig file"
LOOPS = {"open loop": False, "position control": True}
PACES = {"in real time": True, "as fast as it goes": False}
GAINS = {"follows the estimate": True, "stays fixed": False}
ABOUT_LOOPS = (
    "<h2>Run</h2><p class='soft small'>In the open loop the test signal is the command. With "
    "position control it is the reference of the controller on the target.</p>"
)
ABOUT_SLIDERS = (
    "<h2>Effects of the machine</h2><p class='soft small'>Move them before a run, or while it goes "
    "on.</p>"
)
# Fields in which the user types: name in the settings, label, and what an empty one shows.
TYPED = {
    "port": ("serial port or address", "such as /dev/ttyACM0 or socket://localhost:4444"),
    "baud": ("baud rate of a serial port", "115200"),
    "image": ("firmware image, an ELF file", "such as build/firmware/servo_an386.elf"),
    "rig": ("path of the rig file", "such as rig.toml"),
    "duration_s": ("duration in s", "300"),
    "dt_ms": ("sampling time in ms", "20"),
    "amplitude": ("amplitude in V", "a tenth of the rated one"),
    "bandwidth_hz": ("bandwidth of the loop in Hz", "at most 2"),
    "seed": ("seed of signal and noise", "0"),
}


class LiveForm:
    """The fields and the sliders, filled with those of the last run.

    Attributes
    ----------
    target, sliders, run
        what is shown: target and rig, the effects of the machine, and the run that is planned.
    """

    def __init__(
        self,
        workbench: Workbench,
        settings: LiveSettings,
        values: Mapping[str, float],
        changed: Callable[[dict[str, float]], None],
    ) -> None:
        self._sizes, self._changed = dict(values), changed
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
        targets = {words: key for key, words in TARGETS.items()}
        self._fields |= {
            "target": look.select("target", options=targets, value=settings.target),
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
        field = self._fields
        for one in (field["target"], field["position_control"], self._rig):
            one.param.watch(lambda event: self._show(), "value")
        for one in (field["rig"], self._rig):
            one.param.watch(lambda event: self._slide(), "value")
        self.target = pn.Column(
            in_columns(field["target"], self._rig),
            self._row("port", "baud", "image", "machine", "rig"),
            sizing_mode="stretch_width",
        )
        self.run = pn.Column(
            look.words(ABOUT_LOOPS),
            self._row("position_control", "signal", "amplitude", "duration_s", "dt_ms", "seed",
                      "forgetting", "real_time", "bandwidth_hz", "retune"),
            sizing_mode="stretch_width",
        )  # fmt: skip
        self.sliders = pn.Column(sizing_mode="stretch_width")
        self._show()
        self._slide()

    def _row(self, *names: str) -> pn.Column:
        return in_columns(*(self._fields[name] for name in names), least="11.5rem")

    def _show(self) -> None:
        """Shows the fields that the choices need."""
        field, control = self._fields, self._fields["position_control"].value
        for name in ("image", "machine"):
            field[name].visible = field["target"].value == IMAGE
        for name in ("port", "baud"):
            field[name].visible = field["target"].value == LINE
        field["rig"].visible = self._rig.value == OTHER
        field["bandwidth_hz"].visible = field["retune"].visible = control
        field["amplitude"].name = "amplitude in mm" if control else "amplitude in V"
        field["amplitude"].placeholder = (
            "3 % of the stroke" if control else "a tenth of the rated one"
        )

    def _slide(self) -> None:
        """Makes the sliders of a rig; a file that cannot be read is told when a run starts."""
        try:
            self._of: Rig | None = rig_of(self._path())
        except (OSError, ValueError):
            self._of = None
        rig = self._of
        found = {} if rig is None else moved(rig.plant)
        sliders = [] if rig is None else [self._slider(key, rig) for key in found]
        self.sliders.objects = [look.words(ABOUT_SLIDERS), *sliders] if sliders else []

    def _slider(self, key: str, rig: Rig) -> pn.Column:
        parameter, own = moved(rig.plant)[key].parameters[0], rig.values.get(key, 0.0)
        name, size = first_upper(value_name(key)), self._sizes.get(key, own)

        def told(size: float) -> None:
            self._sizes[key] = size
            self._changed(sizes_of(self._sizes, rig))

        return look.size_slider(
            name, parameter.unit, stops(parameter, own), size, told, when="value_throttled"
        )

    def _path(self) -> str:
        typed: str = self._fields["rig"].value
        return typed if self._rig.value == OTHER else self._rig.value

    def settings(self) -> LiveSettings:
        """Returns what is chosen.

        Raises
        ------
        ValueError
            another rig file is chosen, and not named.
        """
        values = {name: field.value for name, field in self._fields.items()}
        if self._rig.value == OTHER and not self._path().strip():
            raise ValueError(
                "path of the rig file: nothing is given: expected a file such as rig.toml; fill it "
                "in, or choose another rig"
            )
        if not values["position_control"]:
            values["bandwidth_hz"] = ""
        sizes = {} if self._of is None else sizes_of(self._sizes, self._of)
        return LiveSettings(**values | {"rig": self._path(), "effects": effect_text(sizes)})

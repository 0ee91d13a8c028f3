# SPDX-License-Identifier: MIT
"""Switches and sliders for the effects of a plant, grouped by the part of the machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import panel as pn

import ehsid
from ehsid.harness.catalogue.keys import ParameterKey
from ehsid.harness.rigs import Rig
from ehsid.harness.show.gap_words import first_upper, plain_name, quantity, value_name

from . import look
from .playground import effects_of, slider_values, typical_sizes

Told = Callable[[Callable[..., None]], Callable[..., None]]


class EffectSliders:
    """The switches; sliders are made where an effect is switched on.

    Attributes
    ----------
    layout
        what the page shows.
    """

    def __init__(self, rig: Rig, changed: Callable[[], None], told: Told) -> None:
        self._rig, self._changed, self._told = rig, changed, told
        self._by_effect: dict[str, dict[str, float]] = {}
        parts: list[Any] = []
        for subsystem, effects in effects_of(rig.plant).items():
            parts.append(look.words(f"<h2>{first_upper(subsystem)}</h2>"))
            parts += [self._switch(effect) for effect in effects]
        self.layout = pn.Column(*parts, sizing_mode="stretch_width")

    @property
    def sizes(self) -> dict[str, float]:
        """Sizes of the effects that are on, by full name, SI."""
        return {key: size for sizes in self._by_effect.values() for key, size in sizes.items()}

    def _switch(self, effect: ehsid.EffectInfo) -> pn.Column:
        name = first_upper(plain_name(effect.id))
        # A group of one: its words are a label of the box, those of a single Checkbox are not.
        box = pn.widgets.CheckBoxGroup(options=[name], stylesheets=[look.CONTROLS], margin=(3, 0))
        sliders = pn.Column(sizing_mode="stretch_width", margin=(0, 0, 6, 22))

        def switched(event: Any) -> None:
            if event.new:
                sizes = self._by_effect[effect.id] = typical_sizes(effect, self._rig)
                sliders.objects = [
                    self._slider(effect.id, parameter, sizes) for parameter in effect.parameters
                ]
            else:
                del self._by_effect[effect.id]
                sliders.objects = []
            self._changed()

        box.param.watch(self._told(switched), "value")
        return pn.Column(box, sliders, sizing_mode="stretch_width", margin=0)

    def _slider(
        self, effect: str, parameter: ehsid.PlantParameter, sizes: dict[str, float]
    ) -> pn.Column:
        key = ParameterKey.of_effect(effect, parameter.name)
        stops = slider_values(parameter)
        words = value_name(key).partition(": ")[2]
        low, high = (quantity(stops[end], parameter.unit, 3) for end in (0, -1))

        def title() -> str:
            size = quantity(sizes[key], parameter.unit, 3)
            return (
                f'<p class="small">{words}: <b>{size}</b> <span class="soft">({low} to {high})'
                "</span></p>"
            )

        shown = look.words(title())
        # It moves over the numbers of the stops, which say nothing: the size stands above it.
        slider = pn.widgets.IntSlider(
            start=0,
            end=len(stops) - 1,
            value=int(np.argmin(np.abs(stops - sizes[key]))),
            show_value=False,
            stylesheets=[look.CONTROLS],
            sizing_mode="stretch_width",
            margin=(0, 12, 8, 8),
        )

        def moved(event: Any) -> None:
            sizes[key] = float(stops[event.new])
            shown.object = title()
            self._changed()

        slider.param.watch(self._told(moved), "value")
        return pn.Column(shown, slider, sizing_mode="stretch_width", margin=0)

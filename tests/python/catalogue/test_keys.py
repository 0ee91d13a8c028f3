# SPDX-License-Identifier: MIT
"""Full names of values, taken apart and put together."""

import pickle

from ehsid.harness.catalogue.parameters import effects, names_of, parameter_keys
from ehsid.harness.catalogue.spellings import ParameterKey, effect_values, sizes_of


def test_every_value_of_the_plant_is_of_one_kind() -> None:
    for key in parameter_keys():
        kinds = [key.is_rig_value, key.is_nuisance, key.is_initial, key.effect is not None]
        assert sum(kinds) == 1, key


def test_names_of_an_effect_come_apart_as_they_were_put_together() -> None:
    for effect in effects().values():
        for key, parameter in zip(names_of(effect), effect.parameters, strict=True):
            assert (key.section, key.effect, key.parameter) == (
                "effects",
                effect.id,
                parameter.name,
            )


def test_sizes_go_there_and_back() -> None:
    sizes = {"coulomb_n": 300.0, "static_n": 500.0}
    values = effect_values("stribeck_friction", sizes)
    assert values == {
        "effects.stribeck_friction.coulomb_n": 300.0,
        "effects.stribeck_friction.static_n": 500.0,
    }
    others = {"load.mass_kg": 120.0, "effects.coulomb_friction.force_n": 1.0}
    assert sizes_of("stribeck_friction", {**others, **values}) == sizes
    assert sizes_of("load_force", values) == {}


def test_a_key_is_its_text() -> None:
    key = ParameterKey.of_initial("position_m")
    assert {"initial.position_m": 1}[key] == 1
    again = pickle.loads(pickle.dumps(key))
    assert again == key
    assert again.is_initial

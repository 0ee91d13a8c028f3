# SPDX-License-Identifier: MIT
"""Asks why the simulation of a servo disagrees with its records: python diagnose.py"""

import ehsid


def press() -> ehsid.Rig:
    """What is known of the machine: its name plates."""
    return ehsid.Rig.new(
        name="press",
        bore="63 mm",
        rod="35 mm",
        stroke="300 mm",
        supply="120 bar",
        rated_flow="38 l/min",
        mass="120 kg",
    )


def record_of(machine: ehsid.Rig, command: str, seed: int, name: str) -> ehsid.Record:
    """There is no machine at hand: the simulator plays it, with 400 N of friction and noise."""
    run = ehsid.simulate(
        machine,
        command,
        duration_s=8.0,
        dt_s=0.002,
        amplitude=2.0,
        noise=True,
        seed=seed,
        values={"effects.coulomb_friction.force_n": 400.0},
    )
    return ehsid.read(run.record, name=name)


def main() -> None:
    """Diagnoses the press; its description knows nothing of the friction."""
    rig = press()
    fitted = record_of(rig, "multisine", seed=1, name="run1")
    held_out = record_of(rig, "steps", seed=2, name="run2")
    diagnosis = ehsid.diagnose(fitted, rig, validate=held_out)
    print(diagnosis.sentence)
    for effect in diagnosis.result.effects:
        for name, found in effect.parameters.items():
            print(f"{effect.id}: {name} = {found.value:.0f}, {found.low:.0f} .. {found.high:.0f}")


if __name__ == "__main__":
    main()

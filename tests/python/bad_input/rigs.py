# SPDX-License-Identifier: MIT
"""Rig files that cannot be used."""

from __future__ import annotations

from dataclasses import dataclass

from bad_input.case import Case, Content, command
from bad_input.inputs import AXIS, BENCH, LONG, a_folder, a_link_to, a_pipe

TITLE = "Rig files"
ABOUT = (
    "Every command that takes a rig file reads it in the same way: `simulate`, `gap`, `gap-fleet`, "
    "`inject`, `experiment --rig` and `hil --rig`. All problems of a file are in one message."
)
# The words of the library that reads TOML.
PARSER = r"(?<=not TOML: )[A-Z].*?(?=(; the line is|: expected \[section\]))"
LINES = {
    "simulate": "ehsid simulate rig.toml --excitation steps --duration 0.1 --out new.csv",
    "gap": "ehsid gap good.csv --rig rig.toml --out out",
    "inject": "ehsid inject good.csv --rig rig.toml --effect gain --set factor=1.1 --out new.csv",
    "experiment": "ehsid experiment --rig rig.toml --out out",
    "hil --rig": "ehsid hil --port loop:// --rig rig.toml --out out",
    "hil --actual": "ehsid hil --port loop:// --actual rig.toml --out out",
}
BESIDE: dict[str, Content] = {"good.csv": LONG}


@dataclass(frozen=True)
class BadRig:
    """A rig file that cannot be used."""

    wrong: str
    """What is wrong with it."""
    content: Content | None
    """Of the file; without content there is no file."""

    def case(self, verb: str) -> Case:
        """This rig given to one of the commands in `LINES`."""
        files = {} if self.content is None else {"rig.toml": self.content}
        return command(
            self.wrong,
            LINES[verb],
            files=files if verb == "simulate" else {**BESIDE, **files},
            library=PARSER,
        )


def changed(wrong: str, old: str, new: str) -> BadRig:
    """The rig of the examples after one replacement."""
    assert old in BENCH, old
    return BadRig(wrong, BENCH.replace(old, new, 1))


def added(wrong: str, text: str) -> BadRig:
    """The rig of the examples with more sections."""
    return BadRig(wrong, f"{BENCH}\n{text}\n")


# The rig of a user's simulator.
OWN = """
plant = "simulator"
[valve]
rated_command_v = 10.0
[simulator]
{program}
[simulator.inputs]
command_v = "u"
[simulator.outputs]
position_m = "y"
"""
BAD = (
    BadRig("no such file", None),
    BadRig("an empty file", ""),
    BadRig("a folder", a_folder),
    BadRig("a pipe", a_pipe),
    BadRig("a link to a device", a_link_to("/dev/zero")),
    BadRig("a link to itself", a_link_to("rig.toml")),
    BadRig("a record", "time_s,command_v\n0,1\n1,2\n"),
    BadRig("a picture", b"\x89PNG\r\n\x1a\n" + bytes(50)),
    BadRig("UTF-16 text", BENCH.encode("utf-16")),
    BadRig("Latin-1 text", BENCH.replace("bench", "Prüfstand", 1).encode("latin-1")),
    BadRig("zero bytes", BENCH + "\0"),
    BadRig("YAML", "plant: ehs\nload:\n  mass_kg: 120\n"),
    BadRig("JSON", '{"plant": "ehs"}'),
    changed("a decimal comma", "120.0", "120,0"),
    changed("a unit behind a number", "120.0", "120.0 kg"),
    changed("a number as text", "120.0", '"120.0"'),
    changed("a section that is not closed", "[load]", "[load"),
    changed("one key twice", "[load]", "[load]\nmass_kg = 3.0"),
    BadRig("brackets 5000 deep", "a = " + "[" * 5000),
    BadRig("a key of 5000 parts", "[uncertainty]\n" + "a." * 5000 + "b = 1\n"),
    BadRig("an integer of 5000 digits", "a = " + "1" * 5000 + "\n"),
    BadRig("10 MB", "# " + "x" * 10_000_000),
    BadRig("30000 unknown keys", BENCH + "".join(f"k{i} = 1\n" for i in range(30_000))),
    BadRig("30000 unknown effects", BENCH + "".join(f"[effects.e{i}]\n" for i in range(30_000))),
    changed("no such plant", '"ehs"', '"hydraulic"'),
    changed("a plant with a typing error", '"ehs"', '"eh s"'),
    changed("a name that is no text", 'name = "bench"', "name = 3"),
    changed("a missing value", "mass_kg", "# mass_kg"),
    changed("a key with a typing error", "bore_m", "bore_mm"),
    changed("a section with a typing error", "[load]", "[laod]"),
    changed("a negative mass", "120.0", "-120.0"),
    changed("a mass of zero", "120.0", "0.0"),
    changed("a mass of 1e300 kg", "120.0", "1e300"),
    changed("a mass that is not a number", "120.0", "nan"),
    changed("an infinite mass", "120.0", "inf"),
    changed("a mass that is true", "120.0", "true"),
    changed("a list for a value", "120.0", "[120.0]"),
    changed("a date for a value", "120.0", "2024-01-01"),
    changed("millimetres for metres", "stroke_m = 0.300", "stroke_m = 300.0"),
    changed("a rod thicker than the bore", "rod_m = 0.035", "rod_m = 0.07"),
    changed("a tank pressure above the supply", "2.0e5", "2.0e7"),
    BadRig("a number for a section", 'plant = "axis"\naxis = 3\n'),
    added("no such effect", "[effects.friction]\nforce_n = 3.0"),
    added("an effect without sizes", "[effects.coulomb_friction]"),
    added("a size that the effect does not have", "[effects.coulomb_friction]\nforce = 3.0"),
    added("a size outside its range", "[effects.coulomb_friction]\nforce_n = -3.0"),
    added("text for an effect", '[effects]\ncoulomb_friction = "much"'),
    added(
        "a static friction below the moving one",
        "[effects.stribeck_friction]\ncoulomb_n = 300.0\nstatic_n = 200.0\n"
        "stribeck_velocity_m_s = 0.01",
    ),
    added("one section twice", "[sensors]"),
    changed("an uncertainty of an unknown value", "fluid.bulk_m", "fluid.bulk_mm"),
    changed("an uncertainty of zero", '_pa" = 0.3', '_pa" = 0.0'),
    changed("an uncertainty as text", '_pa" = 0.3', '_pa" = "30 %"'),
    changed("a sensor with a typing error", "position_noise_m", "position_noise"),
    changed("a negative noise", "1.0e-5", "-1.0e-5"),
    changed(
        "twenty-five unknown keys", "[load]", "".join(f"key{i} = 1\n" for i in range(25)) + "[load]"
    ),
    added("a column that is not in the schema", '[columns]\nposition = "Stroke"'),
    added("a unit of another kind", '[columns]\nposition_m = { name = "s", unit = "bar" }'),
    added("a unit that is not one", '[columns]\nposition_m = { name = "s", unit = "m**9**9**9" }'),
    added("a number for a column", "[columns]\nposition_m = 3"),
    added("a column with an unknown key", '[columns]\nposition_m = { name = "s", units = "mm" }'),
    BadRig("values of a valve for an axis", AXIS + "\n[cylinder]\nbore_m = 0.05\n"),
    BadRig(
        "an effect of the valve for an axis", AXIS + "\n[effects.valve_dead_band]\noverlap = 0.02\n"
    ),
    BadRig("a user's simulator without its section", 'plant = "simulator"'),
    BadRig("an FMU that is not there", OWN.format(program='fmu = "m.fmu"')),
    BadRig("an FMU that is none", OWN.format(program='fmu = "rig.toml"')),
    BadRig("a Python simulator without a name", OWN.format(program='python = "mine.py"')),
    BadRig("a Python simulator that is not there", OWN.format(program='python = "mine.py:Mine"')),
    BadRig(
        "an FMU and a Python simulator",
        OWN.format(program='fmu = "m.fmu"\npython = "mine.py:Mine"'),
    ),
    BadRig(
        "a value without its uncertainty",
        OWN.format(program='python = "module:Mine"') + "[simulator.parameters.mass]\nvalue = 1.0",
    ),
)
CASES = tuple(rig.case("simulate") for rig in BAD)

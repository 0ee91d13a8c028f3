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
    says: tuple[str, ...]
    """Parts that the message must have."""

    def case(self, verb: str) -> Case:
        """This rig given to one of the commands in `LINES`."""
        files = {} if self.content is None else {"rig.toml": self.content}
        return command(
            self.wrong,
            LINES[verb],
            "rig.toml",
            *self.says,
            files=files if verb == "simulate" else {**BESIDE, **files},
            library=PARSER,
        )


def rig(wrong: str, content: Content | None, *says: str) -> BadRig:
    return BadRig(wrong, content, says)


def changed(wrong: str, old: str, new: str, *says: str) -> BadRig:
    """The rig of the examples after one replacement."""
    assert old in BENCH, old
    return rig(wrong, BENCH.replace(old, new, 1), *says)


def added(wrong: str, text: str, *says: str) -> BadRig:
    """The rig of the examples with more sections."""
    return rig(wrong, f"{BENCH}\n{text}\n", *says)


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
    rig("no such file", None, "there is no such file", "check the path"),
    rig("an empty file", "", "'plant' is missing", '"ehs" or "axis"'),
    rig("a folder", a_folder, "directory", "expected a rig file"),
    rig("a pipe", a_pipe, "device or a pipe"),
    rig("a link to a device", a_link_to("/dev/zero"), "device"),
    rig("a link to itself", a_link_to("rig.toml"), "cannot be read"),
    rig("a record", "time_s,command_v\n0,1\n1,2\n", "not TOML", "line 1"),
    rig("a picture", b"\x89PNG\r\n\x1a\n" + bytes(50), "line 1", "not UTF-8"),
    rig("UTF-16 text", BENCH.encode("utf-16"), "UTF-16", "save it as UTF-8"),
    rig("Latin-1 text", BENCH.replace("bench", "Prüfstand", 1).encode("latin-1"), "0xfc", "UTF-8"),
    rig("zero bytes", BENCH + "\0", "not TOML"),
    rig("YAML", "plant: ehs\nload:\n  mass_kg: 120\n", "not TOML", "line 1"),
    rig("JSON", '{"plant": "ehs"}', "not TOML", "line 1"),
    changed("a decimal comma", "120.0", "120,0", "not TOML", "line"),
    changed("a unit behind a number", "120.0", "120.0 kg", "not TOML", "line"),
    changed("a number as text", "120.0", '"120.0"', "'load.mass_kg'", "expected a number"),
    changed("a section that is not closed", "[load]", "[load", "not TOML", "line"),
    changed("one key twice", "[load]", "[load]\nmass_kg = 3.0", "not TOML"),
    rig("brackets 5000 deep", "a = " + "[" * 5000, "rig.toml"),
    rig("a key of 5000 parts", "[uncertainty]\n" + "a." * 5000 + "b = 1\n", "line 2", "few parts"),
    rig("an integer of 5000 digits", "a = " + "1" * 5000 + "\n", "rig.toml"),
    rig("10 MB", "# " + "x" * 10_000_000, "more than 1048576 bytes", "EHSID_MAX_RIG_BYTES"),
    rig(
        "30000 unknown keys",
        BENCH + "".join(f"k{i} = 1\n" for i in range(30_000)),
        "30033 keys",
        "at most 1000",
    ),
    rig(
        "30000 unknown effects",
        BENCH + "".join(f"[effects.e{i}]\n" for i in range(30_000)),
        "30033 keys",
        "at most 1000",
    ),
    changed("no such plant", '"ehs"', '"hydraulic"', "'plant'", '"ehs" or "axis"'),
    changed("a plant with a typing error", '"ehs"', '"eh s"', "did you mean 'ehs'?"),
    changed("a name that is no text", 'name = "bench"', "name = 3", "'name' = 3", "expected text"),
    changed("a missing value", "mass_kg", "# mass_kg", "'load.mass_kg' is missing", "kg"),
    changed("a key with a typing error", "bore_m", "bore_mm", "did you mean 'cylinder.bore_m'?"),
    changed("a section with a typing error", "[load]", "[laod]", "did you mean 'load'?"),
    changed("a negative mass", "120.0", "-120.0", "'load.mass_kg' = -120.0", "expected"),
    changed("a mass of zero", "120.0", "0.0", "'load.mass_kg' = 0.0", "expected"),
    changed("a mass of 1e300 kg", "120.0", "1e300", "'load.mass_kg' = 1e+300", "expected"),
    changed("a mass that is not a number", "120.0", "nan", "'load.mass_kg'", "finite"),
    changed("an infinite mass", "120.0", "inf", "'load.mass_kg'", "finite"),
    changed("a mass that is true", "120.0", "true", "'load.mass_kg' = true", "expected a number"),
    changed("a list for a value", "120.0", "[120.0]", "'load.mass_kg'", "expected a number"),
    changed("a date for a value", "120.0", "2024-01-01", "'load.mass_kg'", "expected a number"),
    changed(
        "millimetres for metres", "stroke_m = 0.300", "stroke_m = 300.0", "'cylinder.stroke_m'", "m"
    ),
    changed("a rod thicker than the bore", "rod_m = 0.035", "rod_m = 0.07", "must be below"),
    changed("a tank pressure above the supply", "2.0e5", "2.0e7", "must be below"),
    rig("a number for a section", 'plant = "axis"\naxis = 3\n', "'axis' = 3", "[axis]"),
    added("no such effect", "[effects.friction]\nforce_n = 3.0", "effects.friction", "no effect"),
    added("an effect without sizes", "[effects.coulomb_friction]", "is empty", "force_n"),
    added(
        "a size that the effect does not have",
        "[effects.coulomb_friction]\nforce = 3.0",
        "did you mean",
    ),
    added(
        "a size outside its range",
        "[effects.coulomb_friction]\nforce_n = -3.0",
        "force_n'",
        "expected",
    ),
    added(
        "text for an effect", '[effects]\ncoulomb_friction = "much"', "[effects.coulomb_friction]"
    ),
    added(
        "a static friction below the moving one",
        "[effects.stribeck_friction]\ncoulomb_n = 300.0\nstatic_n = 200.0\n"
        "stribeck_velocity_m_s = 0.01",
        "must not be below",
    ),
    added("one section twice", "[sensors]", "line 43", "twice"),
    changed("an uncertainty of an unknown value", "fluid.bulk_m", "fluid.bulk_mm", "did you mean"),
    changed("an uncertainty of zero", '_pa" = 0.3', '_pa" = 0.0', "1-sigma above 0"),
    changed("an uncertainty as text", '_pa" = 0.3', '_pa" = "30 %"', "1-sigma above 0"),
    changed("a sensor with a typing error", "position_noise_m", "position_noise", "did you mean"),
    changed("a negative noise", "1.0e-5", "-1.0e-5", "'sensors.position_noise_m'", ">= 0"),
    changed(
        "twenty-five unknown keys",
        "[load]",
        "".join(f"key{i} = 1\n" for i in range(25)) + "[load]",
        "25 problems",
        "and 5 more",
    ),
    added(
        "a column that is not in the schema",
        '[columns]\nposition = "Stroke"',
        "columns",
        "did you mean",
    ),
    added(
        "a unit of another kind",
        '[columns]\nposition_m = { name = "s", unit = "bar" }',
        "bar",
        "of the same kind as m",
    ),
    added(
        "a unit that is not one",
        '[columns]\nposition_m = { name = "s", unit = "m**9**9**9" }',
        "of the same kind as m",
    ),
    added("a number for a column", "[columns]\nposition_m = 3", "columns.position_m", "expected"),
    added(
        "a column with an unknown key",
        '[columns]\nposition_m = { name = "s", units = "mm" }',
        "did you mean 'unit'?",
    ),
    rig(
        "values of a valve for an axis",
        AXIS + "\n[cylinder]\nbore_m = 0.05\n",
        'a plant "axis" has no such value',
        "remove it",
    ),
    rig(
        "an effect of the valve for an axis",
        AXIS + "\n[effects.valve_dead_band]\noverlap = 0.02\n",
        'a plant "axis" has no valve',
        "remove it",
    ),
    rig("a user's simulator without its section", 'plant = "simulator"', "[simulator]", "fmu"),
    rig("an FMU that is not there", OWN.format(program='fmu = "m.fmu"'), "m.fmu", "no such file"),
    rig("an FMU that is none", OWN.format(program='fmu = "rig.toml"'), "no FMU", "export"),
    rig(
        "a Python simulator without a name",
        OWN.format(program='python = "mine.py"'),
        "FILE.py:NAME",
    ),
    rig(
        "a Python simulator that is not there",
        OWN.format(program='python = "mine.py:Mine"'),
        "mine.py",
        "no such file",
    ),
    rig(
        "an FMU and a Python simulator",
        OWN.format(program='fmu = "m.fmu"\npython = "mine.py:Mine"'),
        "both fmu and python",
    ),
    rig(
        "a value without its uncertainty",
        OWN.format(program='python = "module:Mine"') + "[simulator.parameters.mass]\nvalue = 1.0",
        "simulator.parameters.mass.sigma",
        "standard deviation",
    ),
)
CASES = tuple(rig.case("simulate") for rig in BAD)

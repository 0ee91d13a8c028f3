# SPDX-License-Identifier: MIT
"""What the inputs, outputs and values of a simulator are likely to be, from names, units and words.

A guess is made only where one name fits better than all others; else the names that may be meant
are told.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from ..catalogue.channels import CHANNELS
from ..catalogue.spellings import OTHER_SIGNALS
from ..records.names import says, words
from ..records.units import is_convertible, pint_unit
from .simulator_section import COMMAND, OUTPUTS, PORTS, UNITS

# Words of a quantity, and of where on the machine it is.
_QUANTITIES = {
    "command": "command cmd u control voltage signal opening drive spool valve input",
    "force": "force f load kraft effort fuerza forza fext",
    "position": "position pos y x s stroke travel displacement disp weg lage hub course",
    "velocity": "velocity vel v speed geschwindigkeit vitesse yd xd dy dx",
    "pressure": "pressure p press druck pression presion pressione",
    "flow": "flow q flowrate volumenstrom durchfluss debit caudal portata",
}
_PLACES = {
    "a": "a 1 cap bore head piston pa qa",
    "b": "b 2 rod annulus ring pb qb",
    "supply": "supply s pump source system sys ps qs hpu",
}
_MEANT = {
    COMMAND: ("command", None),
    "force_n": ("force", None),
    "position_m": ("position", None),
    "velocity_m_s": ("velocity", None),
    "pressure_a_pa": ("pressure", "a"),
    "pressure_b_pa": ("pressure", "b"),
    "supply_pressure_pa": ("pressure", "supply"),
    "flow_a_m3_s": ("flow", "a"),
    "flow_b_m3_s": ("flow", "b"),
    "supply_flow_m3_s": ("flow", "supply"),
}
# Words of a tool for inputs and outputs without a name, which it numbers.
_NUMBERED = frozenset(("in", "out", "inport", "outport", "port", "input", "output"))
EXACT, SPELLED, NAMED, DESCRIBED, OF_UNIT = 20, 4, 2, 1, 2
# A guess needs more than one weak sign.
LEAST_SCORE = 2


@dataclass(frozen=True)
class Named:
    """A variable of a simulator, as far as it describes itself."""

    name: str
    unit: str | None = None
    description: str = ""
    start: float | None = None


@dataclass(frozen=True)
class Guess:
    """What a contract name may stand for."""

    chosen: Named | None
    """The variable that fits best; None where none does, or several do."""
    candidates: tuple[str, ...]
    """Names that may be meant, best first."""
    why: str = "by its name"


def guess_signals(inputs: Sequence[Named], outputs: Sequence[Named]) -> dict[str, Guess]:
    """Returns a guess for each input, port and output, by contract name."""
    of_outputs = _guessed(OUTPUTS, outputs, "position_m")
    return {
        **_guessed((COMMAND, *PORTS), inputs, COMMAND),
        # Keys that do not meet those of the ports.
        **{f"outputs.{name}": guess for name, guess in of_outputs.items()},
    }


def _guessed(contracts: Iterable[str], variables: Sequence[Named], needed: str) -> dict[str, Guess]:
    names = list(contracts)
    scores = {
        contract: sorted(
            ((_score(one, contract), one) for one in variables), key=lambda pair: -pair[0]
        )
        for contract in names
    }
    chosen: dict[str, Named] = {}
    for contract in sorted(names, key=lambda one: -scores[one][0][0] if scores[one] else 0):
        left = [(score, one) for score, one in scores[contract] if one not in chosen.values()]
        left = [(score, one) for score, one in left if score >= LEAST_SCORE]
        if left and (len(left) == 1 or left[0][0] > left[1][0]):
            chosen[contract] = left[0][1]
    why = Guess.why
    left_over = [one for one in variables if one not in chosen.values()]
    if needed not in chosen and len(left_over) == 1:
        chosen[needed] = left_over[0]
        why = "the only one that is left"
    free = [one.name for one in variables if one not in chosen.values()]
    return {
        contract: Guess(
            chosen.get(contract),
            tuple(one.name for score, one in scores[contract] if score > 0 and one.name in free)
            or (tuple(free) if contract == needed else ()),
            why if contract == needed else Guess.why,
        )
        for contract in names
    }


def _score(variable: Named, contract: str) -> int:
    """Returns how much speaks for a variable; 0 for one that it cannot be."""
    if variable.name == contract:
        return EXACT
    quantity, place = _MEANT[contract]
    unit_fits = _unit_fits(variable.unit, contract)
    if unit_fits is False:
        return 0
    in_name, described = set(words(variable.name)), set(words(variable.description))
    if _NUMBERED & in_name:  # "Out2" is the second output, not that of side 2
        in_name = {word for word in in_name if not word.isdigit()}
    if contract != COMMAND and OTHER_SIGNALS & in_name:
        return 0
    of_quantity = set(_QUANTITIES[quantity].split())
    if place is not None and not _has(_PLACES[place], (in_name | described) - of_quantity):
        return 0
    found = NAMED * _has(_QUANTITIES[quantity], in_name)
    found += DESCRIBED * _has(_QUANTITIES[quantity], described)
    found += SPELLED * (contract in CHANNELS and says(variable.name, contract) is not False)
    if not found and not (unit_fits and place is not None):
        return OF_UNIT if unit_fits and quantity in ("position", "velocity", "force") else 0
    if place is not None:
        found += NAMED * _has(_PLACES[place], in_name - of_quantity)
    return found + OF_UNIT * bool(unit_fits)


def _unit_fits(unit: str | None, contract: str) -> bool | None:
    """Whether a stated unit is of the quantity of a contract name; None without a unit."""
    if unit is None or unit == "1":
        return None
    return unit_of(unit, contract) is not None


def unit_of(unit: str, contract: str) -> str | None:
    """Returns a unit as the rig file writes it, such as "mm"; None if it is of another quantity."""
    if contract in CHANNELS:
        found = pint_unit(unit, contract)
        if found is not None:
            return found
    plain = unit.replace("^", "").replace("m3", "m^3").replace(".", "*")
    return plain if is_convertible(plain, UNITS[contract]) else None


def _has(text: str, found: set[str]) -> bool:
    return bool(found & set(text.split()))


@dataclass(frozen=True)
class Uncertain:
    """A value that may be wrong: its relative 1-sigma with the reason."""

    sigma: float
    why: str


SUPPLY = Uncertain(0.03, "accuracy of a manometer")
# Words of which one is in the name or the description -> uncertainty, the first rule that fits.
_RULES: tuple[tuple[str, Uncertain], ...] = (
    ("leak leakage leckage", Uncertain(0.5, "leakage differs between machines")),
    ("friction viscous damper reibung", Uncertain(0.3, "changes with seals and temperature")),
    ("bulk modulus beta compressibility", Uncertain(0.3, "air and hoses")),
    ("damping zeta dampfung", Uncertain(0.3, "hardly ever known")),
    (
        "frequency bandwidth omega wn fn natural tau",
        Uncertain(0.2, "depends on amplitude and supply"),
    ),
    ("flow kv cv", Uncertain(0.1, "tolerance of data sheets")),
    ("mass inertia masse", Uncertain(0.1, "weighed in parts")),
    ("volume dead", Uncertain(0.2, "hoses and manifold are estimated")),
    ("supply pump", SUPPLY),
    ("stiffness spring", Uncertain(0.2, "hardly ever measured")),
)
_START = frozenset(("start", "initial", "init", "ic", "begin"))


def uncertain(variable: Named) -> Uncertain | None:
    """Returns the uncertainty of a value that is usually not known well; None for others."""
    found = {*words(variable.name), *words(variable.description)}
    for text, rule in _RULES:
        if _has(text, found):
            return rule
    return None


def is_start(variable: Named) -> bool:
    """Whether a value states the position at which a run begins."""
    found = {*words(variable.name), *words(variable.description)}
    at_zero = variable.name.casefold() in ("y0", "x0", "s0")
    return at_zero or (bool(_START & found) and _has(_QUANTITIES["position"], found))


# Value of the rig file -> words of the value of a simulator that is it, and its usual range in SI.
_KNOWN: dict[str, tuple[tuple[str, ...], float, float]] = {
    "valve.rated_command_v": (("rated max nominal", "command voltage input signal"), 0.1, 100.0),
    "cylinder.stroke_m": (("stroke hub travel",), 0.01, 20.0),
    "supply.tank_pressure_pa": (("tank return", "pressure p"), 0.0, 5e6),
    "supply.pressure_pa": (("supply pump", "pressure p nominal"), 1e6, 1e8),
}


def known_values(variables: Iterable[Named]) -> dict[str, Named]:
    """Returns the values of a simulator that the rig file needs, too, by full name."""
    found: dict[str, Named] = {}
    for variable in variables:
        if variable.start is None or is_start(variable):
            continue
        told = {*words(variable.name), *words(variable.description)}
        for name, (texts, low, high) in _KNOWN.items():
            fits = low <= variable.start <= high and all(_has(text, told) for text in texts)
            if fits and name not in found and variable.unit in (None, "1", "Pa", "m", "V"):
                found[name] = variable
                break
    return found

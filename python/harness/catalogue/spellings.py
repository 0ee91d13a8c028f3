# SPDX-License-Identifier: MIT
"""How logs of test rigs call the channels, in English, German, French, Spanish and Italian.

The words are in lower case, without accents, separated by one space; their order does not matter,
words that say only that a value was measured are left out (`FILLERS`), and so are those that say on
which axis (`PLACES`), with their numbers.

Full names of the values of a plant, such as "load.mass_kg" or "effects.valve_lag.damping".
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TypeVar

Value = TypeVar("Value")

EFFECTS = "effects"
NUISANCE = "nuisance"
INITIAL = "initial"


class ParameterKey(str):
    """Full name of a value: a section, for an effect its id, and the own name of the value.

    It is equal to its text, so that it can be a key of mappings and of files.
    """

    __slots__ = ()

    @classmethod
    def of_effect(cls, effect: str, parameter: str) -> ParameterKey:
        """Returns the full name of a parameter of an effect."""
        return cls(f"{EFFECTS}.{effect}.{parameter}")

    @classmethod
    def of_initial(cls, state: str) -> ParameterKey:
        """Returns the full name of a value of the initial state."""
        return cls(f"{INITIAL}.{state}")

    @property
    def section(self) -> str:
        """Section of the rig file, such as "load" or "effects"."""
        return self.partition(".")[0]

    @property
    def parameter(self) -> str:
        """Own name of the value, without section and effect."""
        return self.rpartition(".")[2]

    @property
    def effect(self) -> str | None:
        """Id of the effect, None for a value that belongs to no effect."""
        parts = self.split(".")
        return parts[1] if parts[0] == EFFECTS and len(parts) > 1 else None

    @property
    def is_nuisance(self) -> bool:
        """Whether it is a value that every real servo has and no data sheet gives."""
        return self.section == NUISANCE

    @property
    def is_initial(self) -> bool:
        """Whether it is a value of the initial state."""
        return self.section == INITIAL

    @property
    def is_rig_value(self) -> bool:
        """Whether it is a value of the machine, not of an effect, nuisance or initial state."""
        return self.section not in (EFFECTS, NUISANCE, INITIAL)


def effect_values(effect: str, sizes: Mapping[str, Value]) -> dict[str, Value]:
    """Returns the sizes of an effect, given by its own names, by their full names."""
    return {ParameterKey.of_effect(effect, name): value for name, value in sizes.items()}


def sizes_of(effect: str, values: Mapping[str, Value]) -> dict[str, Value]:
    """Returns the sizes of an effect by its own names, out of values by full name."""
    keys = {ParameterKey(name): value for name, value in values.items()}
    return {key.parameter: value for key, value in keys.items() if key.effect == effect}


_FILLERS = """
actual act measured meas measurement sensor signal value val raw feedback fbk fb ist istwert
messwert gemessen mesure mesuree reel medido medida misurato misurata in of the port chamber
kammer chambre camara camera de del della du la le di transducer geber aufnehmer ruckmeldung
rueckmeldung
"""
# Words that change nothing about which channel a name means.
FILLERS = frozenset(_FILLERS.split())

_PLACES = """
axis ax achse axe eje asse cyl cylinder zyl zylinder verin cilindro actuator aktor main plc sps gvl
nc io hyd hydr hydraulic
"""
# Words of controllers before the name of a signal: "Axis3_ActPos".
PLACES = frozenset(_PLACES.split())

# Words that make another signal of a quantity: its wanted value, its error, its limits.
_OTHER = """
soll sollwert sollwerte setpoints targets references commands
set setpoint sp target ref reference desired demand cmd command commanded error err
deviation abweichung fehler lag min max limit grenze consigne consigna riferimento
"""
OTHER_SIGNALS = frozenset(_OTHER.split())

# Names of a command that, with an axis before it, may as well be the wanted position.
BARE_COMMANDS = frozenset({"command", "cmd", "control", "drive", "set", "setpoint", "input"})

# Lengths on a machine that are no position of the rod.
_OTHER_LENGTHS = """
spool valve ventil schieber level gap thickness diameter durchmesser spalt dicke fullstand
fuellstand pegel distance abstand wear runout offset
"""
OTHER_LENGTHS = frozenset([*OTHER_SIGNALS, *_OTHER_LENGTHS.split()])

# Names of a column that numbers the rows.
_COUNTERS = "sample,samples,index,idx,n,no,nr,num,number,row,scan,record,zeile,nummer"
_NUMBERS = "sample number,sample no,sample nr,scan number,row number,record number"
COUNTERS = frozenset([*_COUNTERS.split(","), *_NUMBERS.split(",")])


def _sides(words: str, *others: str) -> dict[str, tuple[str, ...]]:
    """Returns the spellings of the two chamber pressures: words with a and b, and other pairs."""
    pressure = words.split()
    pairs = [
        *((f"{word} a", f"{word} b") for word in pressure),
        *(tuple(o.split("|")) for o in others),
    ]
    return {
        "pressure_a_pa": tuple(pair[0] for pair in pairs),
        "pressure_b_pa": tuple(pair[1] for pair in pairs),
    }


def _pairs(first: str, second: str) -> tuple[str, ...]:
    """Returns each of the first names, divided by commas, with each of the second words."""
    return tuple(f"{name} {word}" for name in first.split(",") for word in second.split())


_VALVES = "valve,servo valve,servovalve,ventil,servoventil"
_SPOOLS = "spool,valve spool,spool position,valve position,schieber,ventilstellung,ventilschieber"

SPELLINGS = MappingProxyType(
    {
        "time_s": (
            "time", "t", "timestamp", "time stamp", "elapsed time", "relative time", "sec",
            "seconds", "date", "datetime", "date time", "log time", "zeit", "zeitstempel",
            "datum", "datum zeit", "temps", "horodatage", "tiempo", "tempo", "fecha", "data ora",
        ),
        "command_v": (
            "command", "cmd", "u", "control", "control output", "controller output", "valve cmd",
            "valve command", "valve input", "valve voltage", "valve", "servo valve command",
            "servovalve command", "servo command", "drive", "valve drive", "input voltage",
            "command voltage", "voltage command", "motor command", "motor voltage", "u valve",
            "stellgrosse", "stellgroesse", "stellsignal", "ventil", "ventilsignal",
            "valve demand", "valve setpoint", "valve reference", "servo valve", "servovalve",
            "ventilspannung", "ventilansteuerung", "ventilbefehl", "steuerspannung",
            "ventilsollwert", "ventil sollwert", "sollwert ventil", "servoventil",
            "ansteuerung", "commande", "commande vanne", "commande servovalve", "tension vanne",
            "consigne vanne", "mando", "mando valvula", "tension valvula", "consigna valvula",
            "comando", "comando valvola", "riferimento valvola",
            "tensione valvola", "ctrl output", "ctrl out", "control out", "control signal",
            "controller out", "servo output", "servo out", "servo output level", "drive signal",
            "drive output", "valve drive signal", "valve current", "u cmd", "cmd u", "valve u",
            "stellwert", "stellspannung", "stellstrom", "ventilstrom", "reglerausgang",
            "regler ausgang", "ventilstellsignal", "u ventil", "ansteuersignal", "ventil stellwert",
            "ventil ansteuerung", "ventil stellsignal", "ventil spannung", "ventil strom",
            *_pairs(_VALVES, "out output set sp soll"),
            *_pairs(_SPOOLS, "cmd command demand set setpoint sp reference ref soll sollwert"),
        ),
        "position_m": (
            "position", "pos", "y", "x", "x p", "y p", "stroke", "travel", "displacement", "disp",
            "lvdt", "piston position", "rod position", "cylinder position", "actuator position",
            "axis position", "piston stroke", "cylinder stroke", "cylinder travel",
            "piston displacement", "weg", "kolbenweg", "zylinderweg", "hub", "kolbenhub",
            "zylinderhub", "kolbenposition", "zylinderposition", "lage", "course",
            "course verin", "deplacement", "position verin", "posicion", "posicion cilindro",
            "carrera", "desplazamiento", "posizione", "posizione cilindro", "corsa",
            "spostamento", "ram position", "ram pos", "rod pos", "piston pos", "cyl pos",
            "rod displacement", "rod travel", "rod stroke", "cylinder displacement",
            "rod extension",
            "cylinder extension", "actuator displacement", "actuator stroke", "piston travel",
            "linear position", "position lvdt", "pos lvdt", "x piston", "y piston", "x rod",
            "x cyl", "temposonics", "istlage", "achsposition", "kolbenstangenweg", "stangenweg",
            "kolbenstellung", "kolbenlage", "zylinderlage", "x zyl", "weg kolben", "weg zylinder",
        ),
        **_sides(
            "pressure p druck kammerdruck zylinderdruck pression presion pressione press",
            "pressure 1|pressure 2", "p 1|p 2", "cap pressure|rod pressure",
            "cap side pressure|rod side pressure", "cap end pressure|rod end pressure",
            "piston side pressure|rod side pressure", "bore pressure|annulus pressure",
            "pressure cap|pressure rod", "p cap|p rod", "bodendruck|stangendruck",
            "kolbenseitendruck|stangenseitendruck", "druck kolbenseite|druck stangenseite",
            "druck bodenseite|druck ringseite", "druck 1|druck 2",
        ),
        "supply_pressure_pa": (
            "supply pressure", "pressure supply", "system pressure", "pump pressure", "p s", "p p",
            "p 0", "p supply", "p sup", "p sys", "p pump", "pressure p", "pressure s", "druck p",
            "versorgungsdruck", "systemdruck", "pumpendruck", "speisedruck",
            "hpu pressure", "p hpu", "hpu press", "press hpu", "supply press", "pump press",
            "system press", "sys pressure", "sys press", "druck hpu", "aggregatdruck",
            "druck aggregat", "druck pumpe", "druck versorgung", "druck system", "p pumpe",
            "p system", "power unit pressure", "p versorgung",
            "pression alimentation", "pression pompe", "presion suministro", "presion bomba",
            "presion alimentacion", "pressione alimentazione", "pressione pompa",
        ),
        "spool": (
            "spool", "spool position", "spool pos", "spool stroke", "valve spool", "spool lvdt",
            "valve position", "valve opening", "x v", "valve spool position", "schieber",
            "schieberweg", "schieberposition", "schieberstellung", "ventilschieber",
            "ventilstellung", "tiroir", "position tiroir", "corredera", "posicion corredera",
            "cursore", "posizione cursore", "ventil position", "spool feedback position",
            *_pairs(_VALVES, "feedback fb fbk actual act ist istwert"),
        ),
        "velocity_m_s": (
            "velocity", "vel", "velo", "v", "speed", "rod velocity", "piston velocity", "rod speed",
            "piston speed", "cylinder velocity", "cylinder speed", "geschwindigkeit",
            "kolbengeschwindigkeit", "zylindergeschwindigkeit", "vitesse", "vitesse verin",
            "velocidad", "velocita",
        ),
        "force_n": (
            "force", "f", "load", "load cell", "loadcell", "load force", "rod force",
            "cylinder force", "actuator force", "kraft", "zylinderkraft", "lastkraft", "last",
            "kolbenkraft", "effort", "force verin", "fuerza", "forza",
        ),
        "temperature_c": (
            "temperature", "temp", "oil temperature", "oil temp", "fluid temperature", "t oil",
            "tank temperature", "oltemperatur", "oeltemperatur", "temperatur", "oltemp",
            "ol temp", "oel temp",
            "temperature huile", "temperatura", "temperatura aceite", "temperatura olio",
        ),
    }
)  # fmt: skip

# SPDX-License-Identifier: MIT
"""How logs of test rigs call the channels, in English, German, French, Spanish and Italian.

The words are in lower case, without accents, separated by one space; their order does not matter,
and words that say only that a value was measured are left out (`FILLERS`).
"""

from __future__ import annotations

from types import MappingProxyType

_FILLERS = """
actual act measured meas measurement sensor signal value val raw feedback fbk fb ist istwert
messwert gemessen mesure mesuree reel medido medida misurato misurata in of the port chamber
kammer chambre camara camera de del della du la le di
"""
# Words that change nothing about which channel a name means.
FILLERS = frozenset(_FILLERS.split())

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
            "tensione valvola",
        ),
        "position_m": (
            "position", "pos", "y", "x", "x p", "y p", "stroke", "travel", "displacement", "disp",
            "lvdt", "piston position", "rod position", "cylinder position", "actuator position",
            "axis position", "piston stroke", "cylinder stroke", "cylinder travel",
            "piston displacement", "weg", "kolbenweg", "zylinderweg", "hub", "kolbenhub",
            "zylinderhub", "kolbenposition", "zylinderposition", "lage", "course",
            "course verin", "deplacement", "position verin", "posicion", "posicion cilindro",
            "carrera", "desplazamiento", "posizione", "posizione cilindro", "corsa",
            "spostamento",
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
            "pression alimentation", "pression pompe", "presion suministro", "presion bomba",
            "presion alimentacion", "pressione alimentazione", "pressione pompa",
        ),
        "spool": (
            "spool", "spool position", "spool pos", "spool stroke", "valve spool", "spool lvdt",
            "valve position", "valve opening", "x v", "valve spool position", "schieber",
            "schieberweg", "schieberposition", "schieberstellung", "ventilschieber",
            "ventilstellung", "tiroir", "position tiroir", "corredera", "posicion corredera",
            "cursore", "posizione cursore",
        ),
        "velocity_m_s": (
            "velocity", "vel", "v", "speed", "rod velocity", "piston velocity", "rod speed",
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
            "temperature huile", "temperatura", "temperatura aceite", "temperatura olio",
        ),
    }
)  # fmt: skip

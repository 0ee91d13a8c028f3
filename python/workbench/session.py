# SPDX-License-Identifier: MIT
"""A session: a folder with the records of one machine, its rig, and all results.

session.toml      what the user chose; written whole after every change
logs/             files that were dropped on the page
records/          the records as `ehsid import` writes them; what the later steps read
looks/            signals as the page draws them; can be made again at any time
rig.toml          the rig
simulator/        a user's simulator that was dropped on the page, which the rig names
check/, model/, gap/  results, as the commands write them
firmware/         the header for the firmware
so_far/           what a diagnosis at work knows; removed at its end
package/          everything as one archive; can be made again at any time
"""

from __future__ import annotations

import hashlib
import re
import shutil
import threading
import unicodedata
from collections.abc import Callable
from pathlib import Path

import msgspec
import tomli_w

from ehsid.harness.base.files import write_text
from ehsid.harness.catalogue.channels import COMMAND, POSITION
from ehsid.harness.catalogue.parameters import (
    METHODS,
    POLICIES,
    RECORD_POLICY,
    SERVO_ORDERS,
    policies_of,
)

from .rig_program import stamp_of_program

SETTINGS = "session.toml"
RIG = "rig.toml"
VERSION = 1  # of the layout of the folder
MOST_RECORDS = 20
LONGEST_NAME = 60
MOST_COEFFICIENTS, MOST_DELAY = 6, 20  # that the estimator has, see ehsid.ArxEstimator
# What a name keeps when it becomes shorter or gets a number: ".csv", ".csv.gz".
ENDING = re.compile(r"\.[^.]{1,10}(\.gz)?$", re.IGNORECASE)
# Names that some systems keep for devices.
DEVICES = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?", re.IGNORECASE)


class SessionError(ValueError):
    """A session cannot be opened or changed; the message says how to mend it."""


class Entry(msgspec.Struct):
    """A record of the session."""

    id: str
    """Its name among the files of the session."""
    file: str
    """Path of the log: below the folder of the session if relative."""
    held_out: bool = False
    """Whether the diagnosis judges by it and never fits it."""
    maps: dict[str, str] = msgspec.field(default_factory=dict)
    """For a channel the column of the log, such as "Stroke [mm]"; others are guessed."""
    dt_s: float | None = None
    """Sampling time that the user states, s; None: as in the log."""

    def told(self) -> str:
        """Returns a digest of how the log is to be read."""
        return _digest(msgspec.json.encode([self.file, self.maps, self.dt_s]))


class RigAnswers(msgspec.Struct):
    """What the user knows of the machine, in the units of engineers; see `rigs.answers`."""

    plant: str = "ehs"
    answers: dict[str, str] = msgspec.field(default_factory=dict)
    double_rod: bool = False
    hoses: bool = False
    drop_over_both: bool = False


class ModelChoice(msgspec.Struct):
    """What is identified, and how the estimator runs that the firmware has."""

    record: str = ""
    """Id of the record; "" is the first one."""
    input_name: str = COMMAND
    output_name: str = POSITION
    """Columns of the record."""
    orders: str = "2-5"
    delays: str = "1-5"
    """To be tried by the identification, such as "2-5"."""
    na: int = SERVO_ORDERS[0]
    nb: int = SERVO_ORDERS[1]
    nk: int = SERVO_ORDERS[2]
    """Orders and delay of the estimator; an identification puts those in that it has found."""
    method: str = "rls"
    """Recursion, a key of `METHODS`."""
    policy: str = RECORD_POLICY
    """Forgetting policy, a key of `POLICIES`."""
    settings: dict[str, float] = msgspec.field(default_factory=dict)
    """Settings of the policy by their names in Python; those not named have their defaults."""
    reset: bool = True
    """Whether the estimator begins anew where the RMSE shows a change."""
    beside: list[int] = msgspec.field(default_factory=list)
    """Numbers of the earlier models that are drawn with the newest one."""

    def __post_init__(self) -> None:
        """Checks what someone may have edited in the file.

        Raises
        ------
        ValueError
            there is no such structure, recursion, policy or setting.
        """
        if not (1 <= min(self.na, self.nb) <= max(self.na, self.nb) <= MOST_COEFFICIENTS):
            raise ValueError(f"na, nb: expected 1 to {MOST_COEFFICIENTS}")
        if not 0 <= self.nk <= MOST_DELAY:
            raise ValueError(f"nk: expected 0 to {MOST_DELAY}")
        if self.method not in METHODS:
            raise ValueError(f"method {self.method!r}: expected one of {', '.join(METHODS)}")
        taken = policies_of(self.method)
        if self.policy not in taken:
            raise ValueError(f"policy {self.policy!r}: expected one of {', '.join(taken)}")
        known = [setting.name for setting in POLICIES[self.policy].settings]
        unknown = [name for name in self.settings if name not in known]
        if unknown:
            raise ValueError(f"setting {unknown[0]!r}: expected one of {', '.join(known)}")


class Firmware(msgspec.Struct):
    """What the firmware header is made of."""

    record: str = ""
    """Id of the record; "" until one is chosen."""
    name: str = "servo"
    """Namespace in C++, prefix in C."""
    c: bool = False
    """Whether it is C instead of C++."""
    like_model: bool = False
    """Whether columns, orders and forgetting are those of the step Model; else orders are
    identified, and the policy is f-ratio."""


class Settings(msgspec.Struct):
    """Content of session.toml."""

    version: int = VERSION
    """Of this layout."""
    records: list[Entry] = msgspec.field(default_factory=list)
    """In the order in which they were added."""
    rig: RigAnswers = msgspec.field(default_factory=RigAnswers)
    """Answers from which the rig was made."""
    model: ModelChoice = msgspec.field(default_factory=ModelChoice)
    """Choices for the step Model."""
    firmware: Firmware = msgspec.field(default_factory=Firmware)
    """What the firmware header is made of."""
    made_of: dict[str, str] = msgspec.field(default_factory=dict)
    """For each result of a step the digest of what it was made of."""


class Session:
    """A session, open; several pages may show it, and each hears of every change."""

    def __init__(self, folder: Path) -> None:
        """Opens the session in a folder, or begins one there.

        Raises
        ------
        SessionError
            the folder cannot be used, or its session.toml is damaged or of another version.
        """
        self.folder = folder.resolve()
        self._listeners: list[Callable[[], None]] = []
        self._lock = threading.RLock()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self._seen = self._stamp()
            self.settings = self._read()
        except OSError as error:
            raise SessionError(
                f"{folder}: cannot be used as the folder of a session ({error.strerror}): expected "
                "a folder that can be written to; name another one"
            ) from None

    def _read(self) -> Settings:
        path = self.folder / SETTINGS
        if not path.exists():
            return Settings()
        try:
            content = msgspec.toml.decode(path.read_bytes())
            version = content.get("version", VERSION)
            if version != VERSION:  # before its content, which may have other types
                raise SessionError(
                    f"{path}: this session has version {version!r}, and this ehsid reads version "
                    f"{VERSION}: open it with the ehsid that wrote it; nothing was changed"
                )
            settings = msgspec.convert(content, Settings)
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise SessionError(
                f"{path}: this is not the file of a session ({error}): expected a file that "
                "`ehsid app` wrote; move it away to begin anew, the results beside it stay"
            ) from None
        for entry in settings.records:
            if safe_name(entry.id) != entry.id:
                raise SessionError(
                    f"{path}: {entry.id!r} is no name of a record: expected a plain file name; "
                    "correct the file, or move it away to begin anew"
                )
            if ".." in Path(entry.file).parts:
                raise SessionError(
                    f"{path}: the log {entry.file!r} leads out of the folder of the session: "
                    "expected a path inside it, or one from the root; correct the file"
                )
        return settings

    def _stamp(self) -> tuple[int, str] | None:
        """What tells one folder and its session.toml from others; None without them."""
        try:
            return self.folder.stat().st_ino, _digest((self.folder / SETTINGS).read_bytes())
        except OSError:
            return None

    @property
    def is_current(self) -> bool:
        """Whether session.toml is as it was read or written here; else someone has exchanged it."""
        return self._seen == self._stamp()

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name

    @property
    def rig_file(self) -> Path:
        """Path of the rig file, which need not exist yet."""
        return self.folder / RIG

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Adds a function to be called after every change; returns one that removes it."""
        self._listeners.append(listener)
        return lambda: self._listeners.remove(listener)

    def changed(self) -> None:
        """Tells all pages that something has changed."""
        for listener in list(self._listeners):
            listener()

    def save(self) -> None:
        """Writes the settings, whole or not at all, and tells all pages."""
        with self._lock:
            plain = msgspec.to_builtins(self.settings)
            for record in plain["records"]:
                if record["dt_s"] is None:
                    del record["dt_s"]
            write_text(self.folder / SETTINGS, tomli_w.dumps(plain))
            self._seen = self._stamp()
        self.changed()

    def log_of(self, entry: Entry) -> Path:
        """Returns the path of the log of a record."""
        return self.folder / entry.file  # an absolute path stays as it is

    def record_of(self, entry: Entry) -> Path:
        """Returns the path of the imported record, which need not exist yet."""
        return self.folder / "records" / f"{entry.id}.parquet"

    def look_of(self, entry: Entry) -> Path:
        """Returns the folder with what the page draws of a record."""
        return self.folder / "looks" / entry.id

    def entry(self, record_id: str) -> Entry | None:
        """Returns the record of this id; None if there is none."""
        return next((one for one in self.settings.records if one.id == record_id), None)

    def add(self, path: Path) -> Entry:
        """Adds a log; a file below the folder of the session is named relative to it.

        Raises
        ------
        SessionError
            there is no such file, or there are too many.
        """
        path = path.expanduser().absolute()
        if not path.exists():
            raise SessionError(f"{path}: there is no such file or folder; check the path")
        with self._lock:
            if len(self.settings.records) >= MOST_RECORDS:
                raise SessionError(
                    f"{path.name}: there are {MOST_RECORDS} records already, the most that a "
                    "session holds; remove one first"
                )
            inside = path.is_relative_to(self.folder)
            file = str(path.relative_to(self.folder) if inside else path)
            known = next((one for one in self.settings.records if one.file == file), None)
            if known is not None:
                return known
            taken = {one.id for one in self.settings.records}
            entry = Entry(free_name(safe_name(path.name.split(".")[0]), taken), file)
            self.settings.records.append(entry)
            self.save()
            return entry

    def remove(self, entry: Entry) -> None:
        """Takes a record out of the session, with the copies that the session made of it."""
        with self._lock:
            self.settings.records.remove(entry)
            # A log that was named by its path stays, and so does what a link leads to.
            for copy in (self.log_of(entry), self.record_of(entry)):
                if self._made(copy) and not copy.is_dir():
                    copy.unlink(missing_ok=True)
            if self._made(self.look_of(entry)):
                shutil.rmtree(self.look_of(entry), ignore_errors=True)
            self.save()

    def _made(self, path: Path) -> bool:
        """Whether a path is directly in a folder that has only copies of the session itself."""
        return path.parent.resolve() in (self.folder / one for one in ("logs", "records", "looks"))

    def modelled(self) -> Entry | None:
        """Returns the record of which a model is made; None if there is no record."""
        chosen = self.entry(self.settings.model.record)
        return chosen or next(iter(self.settings.records), None)

    def made_from(self, key: str) -> str:
        """Returns a digest of what the result of a step or a job is made of."""
        entry, model = self.modelled(), self.settings.model
        if key not in ("identify", "estimate") or entry is None:
            return self.digest(rig=True)
        said: list[object] = [entry.id, entry.told(), model.input_name, model.output_name]
        if key == "identify":
            said += [model.orders, model.delays]
        else:
            said += [model.na, model.nb, model.nk, model.method, model.policy, model.settings]
            said.append(model.reset)
        return _digest(msgspec.json.encode(said))

    def digest(self, *, rig: bool) -> str:
        """Returns a digest of what results are made of: the records, and the rig if asked for."""
        content = msgspec.json.encode(self.settings.records)
        if rig and self.rig_file.exists():
            content += self.rig_file.read_bytes() + stamp_of_program(self.rig_file)
        return _digest(content)


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:16]


def safe_name(name: str) -> str:
    """Returns a name of others as a plain file name: no folders, no controls, not too long."""
    plain = unicodedata.normalize("NFC", name).replace("\\", "/").rpartition("/")[2]
    plain = "".join(c if c.isalnum() or c in "-_." else "_" for c in plain)
    plain = plain.strip("._")
    if len(plain) > LONGEST_NAME:
        stem, ending = _parted(plain)
        plain = stem[: LONGEST_NAME - len(ending)].rstrip("._") + ending
    return f"file_{plain}".rstrip("_") if not plain or DEVICES.fullmatch(plain) else plain


def free_name(name: str, taken: set[str]) -> str:
    """Returns the name, with a number behind its stem if it is taken; case does not matter."""
    folded = {one.casefold() for one in taken}
    stem, ending = _parted(name)
    number, free = 1, name
    while free.casefold() in folded:
        number += 1
        free = f"{stem}_{number}{ending}"
    return free


def _parted(name: str) -> tuple[str, str]:
    """Returns the stem of a name and its ending, "" without one."""
    ending = ENDING.search(name)
    place = len(name) if ending is None else ending.start()
    return name[:place], name[place:]

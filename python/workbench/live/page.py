# SPDX-License-Identifier: MIT
"""The page Live in one browser tab: the form, and the run that goes on or ended last.

The form of a run: target, machine, test signal and estimator.
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from functools import partial, wraps
from pathlib import Path
from typing import Any

import panel as pn

from ehsid.harness.base.error_words import error_words
from ehsid.hil.faults import TO_HOST, TO_TARGET

from .. import look
from ..jobs import State
from ..look import in_columns
from ..workbench import ERRORS, Workbench
from .numbers import drawn, ended_html, events_html, numbers_html, state_words, tidy
from .plots import COLUMNS, LivePlots
from .runs import LiveRuns
from .settings import MACHINES, POLICIES, SIGNALS, LiveSettings, command, python
from .watching import FAULTS, RING, RingReader, RunStatus, read_status

PUBLISHED, OTHER = "published experiment", "another rig file"
TARGETS = {"serial port or address": False, "firmware in QEMU": True}
LOOPS = {"open loop": False, "position control": True}
PACES = {"in real time": True, "as fast as it goes": False}
GAINS = {"follows the estimate": True, "stays fixed": False}
ABOUT_LOOPS = (
    "<p class='soft'>In the open loop the test signal is the command. With position control it is "
    "the reference of the controller on the target.</p>"
)
# Fields in which the user types: name in the settings, label, and what an empty one shows.
TYPED = {
    "port": ("serial port or address", "such as /dev/ttyACM0 or socket://localhost:4444"),
    "baud": ("baud rate of a serial port", "115200"),
    "image": ("firmware image, an ELF file", "such as build/firmware/servo_an386.elf"),
    "rig": ("path of the rig file", "such as rig.toml"),
    "effects": ("effects of the simulated machine", "such as coulomb_friction.force_n=400"),
    "duration_s": ("duration in s", "60"),
    "dt_ms": ("sampling time in ms", "20"),
    "amplitude": ("amplitude in V", "a tenth of the rated one"),
    "bandwidth_hz": ("bandwidth of the loop in Hz", "at most 2"),
    "seed": ("seed of signal and noise", "0"),
}


class LiveForm:
    """The fields, filled with the settings of the last run.

    Attributes
    ----------
    layout
        what is shown.
    """

    def __init__(self, workbench: Workbench, settings: LiveSettings) -> None:
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
        self._fields |= {
            "emulated": look.select("target", options=TARGETS, value=settings.emulated),
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
        for name in ("emulated", "position_control"):
            self._fields[name].param.watch(lambda event: self._show(), "value")
        self._rig.param.watch(lambda event: self._show(), "value")
        field = self._fields
        self.layout = pn.Column(
            look.words("<h2>Target</h2>"),
            self._row("emulated", "port", "baud", "image", "machine", least="19rem"),
            look.words("<h2>Machine, which is simulated here</h2>"),
            in_columns(self._rig, field["rig"], field["effects"], least="19rem"),
            look.words(f"<h2>Run</h2>{ABOUT_LOOPS}"),
            self._row("position_control", "signal", "amplitude", "duration_s", "dt_ms", "seed"),
            self._row("forgetting", "real_time", "bandwidth_hz", "retune"),
            sizing_mode="stretch_width",
        )
        self._show()

    def _row(self, *names: str, least: str = "14rem") -> pn.Column:
        return in_columns(*(self._fields[name] for name in names), least=least)

    def _show(self) -> None:
        """Shows the fields that the choices need."""
        field, control = self._fields, self._fields["position_control"].value
        for name in ("image", "machine"):
            field[name].visible = field["emulated"].value
        for name in ("port", "baud"):
            field[name].visible = not field["emulated"].value
        field["rig"].visible = self._rig.value == OTHER
        field["bandwidth_hz"].visible = field["retune"].visible = control
        field["amplitude"].name = "amplitude in mm" if control else "amplitude in V"
        field["amplitude"].placeholder = (
            "3 % of the stroke" if control else "a tenth of the rated one"
        )

    def settings(self) -> LiveSettings:
        """Returns what is chosen.

        Raises
        ------
        ValueError
            another rig file is chosen, and not named.
        """
        values = {name: field.value for name, field in self._fields.items()}
        if self._rig.value != OTHER:
            values["rig"] = self._rig.value
        elif not values["rig"].strip():
            raise ValueError(
                "path of the rig file: nothing is given: expected a file such as rig.toml; fill it "
                "in, or choose another rig"
            )
        if not values["position_control"]:
            values["bandwidth_hz"] = ""
        return LiveSettings(**values)


PERIOD_MS = 200
WINDOWS = {"the last 5 s": 5.0, "the last 20 s": 20.0, "the last 2 min": 120.0,
           "as long as is kept": float("inf")}  # fmt: skip
WAYS = {"on the way to the target": TO_TARGET, "on the way to the host": TO_HOST}
RECENT = 1000  # samples, over which the rate is counted
PURPOSE = (
    '<h1>Live</h1><p class="soft">A run with the hardware in the loop: the machine is simulated '
    "here, the controller and the estimator run on the target. The run goes on when this page is "
    "closed; every page shows the same run.</p>"
)


class LivePage:
    """A page; other pages may show the same run.

    Attributes
    ----------
    theme
        key of `look.THEMES`.
    template
        what Panel serves.
    """

    def __init__(self, runs: LiveRuns) -> None:
        self._runs = runs
        asked = (pn.state.session_args or {}).get("theme", [b""])
        self.theme = "dark" if asked[0] == b"dark" else "light"
        self._problem, self._status, self._numbers = (look.words("") for _ in range(3))
        self._result, self._events, self._equivalent = (look.words("") for _ in range(3))
        self._form = LiveForm(runs.workbench, runs.settings())
        self._fold = pn.Column(self._form.layout, sizing_mode="stretch_width")
        self._signals, self._estimates = (pn.Column(sizing_mode="stretch_width") for _ in "se")
        self._plots: LivePlots | None = None
        self._ring: RingReader | None = None
        self._shown: Path | None = None  # the run of the plots
        self._stamp: tuple[float, ...] = ()  # of the picture that is shown
        self._start = self._button("Start", self._begin, primary=True)
        self._stop = self._button("Stop", self._end)
        self._machine = self._button("Make a machine of this record", self._make_machine)
        self._machine.jscallback(tags="if (cb_obj.tags.length) location.assign(cb_obj.tags[0])")
        self._window = look.select("show", options=list(WINDOWS), width=300)
        self._controls = self._make_controls()
        self.template = self._make_template()
        pn.state.add_periodic_callback(self.refresh, period=PERIOD_MS)
        self.refresh()

    def _make_template(self) -> pn.Template:
        template = look.template("view", self.theme)
        template.add_variable("view", "live")
        parts = pn.Column(
            look.words(PURPOSE),
            self._problem,
            self._fold,
            pn.Row(self._start, self._stop, margin=(8, 0)),
            self._status,
            self._result,
            self._machine,
            self._numbers,
            self._beside(),
            self._estimates,
            self._events,
            self._equivalent,
            sizing_mode="stretch_width",
        )
        template.add_panel("view", parts)
        template.title = "Live - ehsid"
        return template

    def _beside(self) -> pn.FlexBox:
        """Returns the signals, and beside them what can be done; below them where it is narrow."""
        signals = pn.Column(self._window, self._signals)
        signals.styles = {"flex": "3 1 34rem", "min-width": "min(34rem, 100%)"}
        self._controls.styles = {"flex": "1 1 20rem", "min-width": "min(20rem, 100%)"}
        return pn.FlexBox(
            signals, self._controls, sizing_mode="stretch_width", gap="0 1.5rem",
            align_items="start",
        )  # fmt: skip

    def _button(
        self, name: str, handler: Callable[[], None], *, primary: bool = False
    ) -> pn.widgets.Button:
        button = look.button(name, primary=primary)
        button.on_click(self._with_errors_shown(lambda event: handler()))
        return button

    def _make_controls(self) -> pn.Column:
        runs = self._runs
        self._snapshots = look.select("snapshot", width=300)
        self._restore = self._button(
            "Go on from this snapshot", lambda: runs.request("restore", self._snapshots.value)
        )
        self._restoring = pn.FlexBox(self._snapshots, self._restore, align_items="end")
        self._way = look.select("where the fault comes", options=list(WAYS), width=300)
        faults = [
            self._button(words, partial(self._disturb, kind)) for kind, words in FAULTS.items()
        ]
        self._board = self._button("Reset the board", lambda: runs.request("reset board"))
        self._faults = pn.Column(
            look.words(
                "<h2>Faults of the line</h2><p class='soft'>Each press puts one fault into the "
                "next frame. The protocol corrects it, and the counts above show it.</p>"
            ),
            self._way,
            pn.FlexBox(*faults, self._board),
            sizing_mode="stretch_width",
        )
        return pn.Column(
            look.words("<h2 style='margin-top:0'>Estimator on the target</h2>"),
            pn.FlexBox(
                self._button("Let the estimator begin anew", lambda: runs.request("reset")),
                self._button("Store a snapshot", lambda: runs.request("snapshot")),
            ),
            self._restoring,
            self._faults,
        )

    def _disturb(self, kind: str) -> None:
        self._runs.request("fault", kind, WAYS[self._way.value])

    def _with_errors_shown(self, handler: Callable[[Any], None]) -> Callable[[Any], None]:
        """Returns a handler whose errors are shown on the page; it never shows a traceback."""

        @wraps(handler)
        def safely(event: Any) -> None:
            try:
                self._problem.object = ""
                handler(event)
            except Exception as error:
                self._tell(error)

        return safely

    def _tell(self, error: Exception) -> None:
        text = error_words(error)
        if text is None:
            self._runs.folder.mkdir(exist_ok=True)
            log = self._runs.folder / ERRORS
            with log.open("a", encoding="utf-8") as file:
                file.write(traceback.format_exc())
            text = (
                f"A fault of the program ({type(error).__name__}), which is not due to your data. "
                f"{log} has what its authors need to mend it. The run is as it was."
            )
        self._problem.object = look.error(tidy(text))

    def _begin(self) -> None:
        self._runs.start(self._form.settings())
        self.refresh()

    def _end(self) -> None:
        self._runs.stop(begun=self._ring is not None and self._ring.count > 0)

    def _make_machine(self) -> None:
        session = self._runs.make_machine("")
        self._machine.tags = [f"/?session={session.name}&theme={self.theme}"]

    def refresh(self) -> None:
        """Shows what is new; nothing is sent where nothing has changed."""
        try:
            self._refresh()
        except Exception as error:
            self._tell(error)

    def _refresh(self) -> None:
        job, folder = self._runs.job, self._runs.latest()
        status = RunStatus() if folder is None else read_status(folder)
        running = self._runs.running
        _set(self._start, visible=not running)
        _set(self._stop, visible=running)
        _set(self._fold, visible=not running)
        self._open(folder, status)
        begun = running and self._ring is not None and self._ring.count > 0
        _set(self._controls, visible=begun)
        _set(self._faults, visible=status.faults)
        _set(self._board, visible=status.board_reset)
        _set(self._restoring, visible=bool(status.snapshots))
        if self._snapshots.options != status.snapshots:
            newest = status.snapshots[-1] if status.snapshots else None
            self._snapshots.param.update(options=status.snapshots, value=newest)
        self._draw(status, running=running)
        ended = folder is not None and not running
        result = ended_html(folder, status) if ended and folder is not None else ""
        _set(self._result, object=result)
        _set(self._machine, visible="record.csv" in result)
        _set(self._events, object=events_html(status))
        message = "" if job is None or job.state is State.done else tidy(job.message)
        state = "" if job is None else state_words(job.state, status)
        _set(self._status, object=look.error(message) if message else state)
        self._show_equivalent(folder)

    def _open(self, folder: Path | None, status: RunStatus) -> None:
        """Makes the plots of a run as soon as its samples are there."""
        ring = None if folder is None else folder / RING
        if folder is None or ring is None or not ring.exists() or not status.parameters:
            self._plots = self._ring = None
            _set(self._signals, objects=[])
            _set(self._estimates, objects=[])
        elif folder != self._shown or self._plots is None:
            self._ring = RingReader(ring)
            self._plots = LivePlots(
                status.parameters, reference=status.position_control, theme=self.theme
            )
            self._signals.objects = [self._plots.signals]
            self._estimates.objects = [self._plots.estimates]
            self._shown, self._stamp = folder, ()
        _set(self._window, visible=self._plots is not None)

    def _draw(self, status: RunStatus, *, running: bool) -> None:
        """Draws the newest samples where there are new ones, or another window is wanted."""
        if self._ring is None or self._plots is None:
            _set(self._numbers, object="")
            return
        count, length_s = self._ring.count, WINDOWS[self._window.value]
        if count == 0:
            return
        _set(
            self._numbers,
            object=numbers_html(self._ring.newest(RECENT), status, running=running),
        )
        wanted = min(count, length_s / status.dt_s)
        # A new picture is worth its work as soon as a new pixel column has come.
        step = max(1, int(wanted) // COLUMNS) if running else 1
        stamp = count // step, step, length_s
        if stamp != self._stamp:
            self._stamp = stamp
            self._plots.update(drawn(self._ring.newest(max(1, int(wanted))), COLUMNS))

    def _show_equivalent(self, folder: Path | None) -> None:
        if folder is None:
            return
        settings = self._runs.settings()
        shown = look.plain(command(settings)), look.plain(python(settings))
        html = (
            "<details><summary>The command and the Python that do the same</summary>"
            f"<pre>{shown[0]}</pre><pre>{shown[1]}</pre></details>"
        )
        _set(self._equivalent, object=html)


def _set(part: Any, **values: Any) -> None:
    """Sets what has changed, so that nothing else is sent to the page."""
    changed = {name: value for name, value in values.items() if getattr(part, name) != value}
    if changed:
        part.param.update(**changed)

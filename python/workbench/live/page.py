# SPDX-License-Identifier: MIT
"""The page Live in one browser tab: a run that goes on or ended last, beside what can be done."""

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
from ..workbench import ERRORS
from .form import LiveForm
from .numbers import drawn, ended_html, events_html, numbers_html, state_words, tidy
from .plots import COLUMNS, LivePlots
from .runs import LiveRuns
from .settings import command, python
from .watching import FAULTS, RING, RingReader, RunStatus, read_status

PERIOD_MS = 200
WINDOWS = {"the last 20 s": 20.0, "the last 5 s": 5.0, "the last 2 min": 120.0,
           "as long as is kept": float("inf")}  # fmt: skip
WAYS = {"on the way to the target": TO_TARGET, "on the way to the host": TO_HOST}
RECENT = 1000  # samples, over which the rate is counted
PURPOSE = (
    '<h1>Live</h1><p class="soft">See a servo move while its model is estimated. The machine is '
    "simulated here; controller and estimator run on this computer, or on your board.</p>"
)
EMPTY = '<p class="soft">The signals and the estimates of a run are drawn here as it goes on.</p>'


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
        latest = runs.latest()
        values = {} if latest is None else read_status(latest).machine
        self._form = LiveForm(runs.workbench, runs.settings(), values, self._change_machine)
        self._drawn = pn.Column(look.words(EMPTY), sizing_mode="stretch_width")
        self._plots: LivePlots | None = None
        self._ring: RingReader | None = None
        self._shown: Path | None = None  # the run of the plots
        self._stamp: tuple[float, ...] = ()  # of the picture that is shown
        self._start = self._button("Start", self._begin, primary=True)
        self._stop = self._button("Stop", self._end)
        self._machine = self._button("Make a machine of this record", self._make_machine)
        self._machine.jscallback(tags="if (cb_obj.tags.length) location.assign(cb_obj.tags[0])")
        self._window = look.select("show", options=list(WINDOWS), width=170)
        self._controls = self._make_controls()
        self.template = self._make_template()
        pn.state.add_periodic_callback(self.refresh, period=PERIOD_MS)
        self.refresh()

    def _make_template(self) -> pn.Template:
        template = look.template("view", self.theme)
        template.add_variable("view", "live")
        left = (
            pn.FlexBox(self._start, self._stop, self._window, align_items="end"),
            self._problem,
            self._status,
            self._result,
            self._machine,
            self._numbers,
            self._form.target,
            self._form.sliders,
            self._form.run,
            self._controls,
            self._events,
            self._equivalent,
        )
        parts = pn.Column(look.words(PURPOSE), look.panes(left, [self._drawn], (2, 3)))
        parts.sizing_mode = "stretch_width"
        template.add_panel("view", parts)
        template.title = "Live - ehsid"
        return template

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

    def _change_machine(self, values: dict[str, float]) -> None:
        self._runs.request("machine", values)

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
        session = self._runs.make_machine()
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
        _set(self._form.target, visible=not running)
        _set(self._form.run, visible=not running)
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
        elif folder != self._shown or self._plots is None:
            self._ring = RingReader(ring)
            self._plots = LivePlots(
                status.parameters, reference=status.position_control, theme=self.theme
            )
            self._drawn.objects = [self._plots.layout]
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
        texts = {"command": command(settings), "Python": python(settings)}
        shown = {name: f"<pre>{look.plain(text)}</pre>" for name, text in texts.items() if text}
        names, does = " and the ".join(shown), "do" if len(shown) > 1 else "does"
        html = (
            f"<details><summary>The {names} that {does} the same</summary>"
            f"{''.join(shown.values())}</details>"
        )
        _set(self._equivalent, object=html)


def _set(part: Any, **values: Any) -> None:
    """Sets what has changed, so that nothing else is sent to the page."""
    changed = {name: value for name, value in values.items() if getattr(part, name) != value}
    if changed:
        part.param.update(**changed)

# SPDX-License-Identifier: MIT
"""The server of the workbench: on this machine only, and only for who has the token."""

from __future__ import annotations

import asyncio
import hmac
import os
import secrets
import warnings
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import panel as pn
from bokeh.server.auth_provider import AuthProvider
from bokeh.util.warnings import BokehUserWarning
from panel.io.server import get_server
from tornado.httputil import HTTPServerRequest
from tornado.ioloop import IOLoop
from tornado.iostream import StreamClosedError
from tornado.routing import Matcher, Rule
from tornado.web import HTTPError, RequestHandler, stream_request_body
from tornado.websocket import WebSocketClosedError

from ehsid.harness.base.error_words import error_words
from ehsid.harness.rigs.checks import read_text

from . import look
from .histories import NUMBERS, PAGE, Histories
from .history_view import HistoryView
from .live.page import LivePage
from .live.runs import SERVED as LIVE_SERVED
from .live.runs import LiveRuns
from .machines_view import MachinesView
from .page import Page
from .playground_view import PlaygroundView
from .session import RIG, Session, SessionError, free_name, safe_name
from .simulator_files import ENDINGS, take_program, take_rig_text
from .workbench import LIVE, Workbench

ADDRESS = "127.0.0.1"
UPLOAD_LIMIT = 2 * 1024**3  # bytes of one file
MESSAGE_LIMIT = 4 * 1024**2  # bytes of what a page sends otherwise
BODY_LIMIT = 64 * 1024  # bytes of any other request; no page sends one with a body
HTTP_PORT = 80  # which no browser names
COOKIE_S = 30 * 24 * 3600
# Of the folder of a session, the page may fetch results only.
SERVED = ("check/", "model/", "gap/", "apply/", "firmware/", "package/", RIG)
KINDS = {
    ".html": "text/html",
    ".png": "image/png",
    ".json": "application/json",
    ".zip": "application/zip",
}
PIECE = 2**20  # bytes that are sent at once
ELSEWHERE = (
    "This request names another address than that of ehsid app, or comes from a page of another "
    "one: expected {}. Use the address that ehsid app printed.\n"
)
NO_TOKEN = (
    "This page needs the address that <code>ehsid app</code> printed, with its token. Copy it from "
    "the terminal, or start <code>ehsid app</code> again."
)
# The page is made for one set of colours: with that of this browser it is loaded once.
TO_THE_PAGE = """<!doctype html><title>ehsid</title><script>
const dark = matchMedia("(prefers-color-scheme: dark)").matches;
location.replace("/?theme=" + (dark ? "dark" : "light"));
</script>"""
# A report is a page of its own: it may run its scripts, and may not fetch anything.
REPORT_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval'; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:; sandbox allow-scripts allow-popups allow-downloads"
)


class _Token(AuthProvider):  # type: ignore[misc] # bokeh's types are left out
    """Lets in who came once by the address with the token, and has its cookie since."""

    def __init__(self, cookie: str, token: str) -> None:
        self.cookie, self.token = cookie, token
        super().__init__()

    def holds(self, request: HTTPServerRequest) -> bool:
        """Whether a request has the cookie."""
        given = request.cookies.get(self.cookie)
        return given is not None and hmac.compare_digest(given.value.encode(), self.token.encode())

    @property
    def get_user(self) -> Callable[[RequestHandler], str | None]:
        return lambda handler: "user" if self.holds(handler.request) else None

    @property
    def login_url(self) -> str:
        return "/login"

    @property
    def login_handler(self) -> type[RequestHandler]:
        auth = self

        class Login(RequestHandler):
            """Takes the token from the address, and leads to the page without it."""

            def get(self) -> None:
                given = self.get_query_argument("token", "")
                if hmac.compare_digest(given.encode(), auth.token.encode()):
                    self.set_cookie(
                        auth.cookie, auth.token, httponly=True, samesite="Strict", max_age=COOKIE_S
                    )
                    # A redirect would still count as coming from elsewhere, without the cookie.
                    self.finish(TO_THE_PAGE)
                    return
                self.set_status(403)
                self.finish(f"<!doctype html><title>ehsid</title><p>{NO_TOKEN}</p>")

        return Login


class _NotOurs(Matcher):
    """Matches what is answered by `_Refusal`, on pages and websockets alike.

    Another site can let its own name lead to this address (DNS rebinding), and its pages can send
    requests here; a browser then says so in Host or Origin. Who has no token may not send a body.
    """

    def __init__(self, auth: _Token, host: str) -> None:
        self.auth, self.host = auth, host

    def match(self, request: HTTPServerRequest) -> dict[str, Any] | None:
        origins = request.headers.get_list("Origin")
        if request.host != self.host or any(one != f"http://{self.host}" for one in origins):
            return {"target_kwargs": {"why": ELSEWHERE.format(self.host)}}
        length = request.headers.get("Content-Length", "0")
        has_body = length != "0" or "Transfer-Encoding" in request.headers
        if has_body and not self.auth.holds(request):
            return {"target_kwargs": {"why": f"{NO_TOKEN}\n"}}
        return None


@stream_request_body
class _Refusal(RequestHandler):
    """Answers 403 before the body of a request is read."""

    def initialize(self, why: str) -> None:
        self.why = why

    def prepare(self) -> None:
        self.set_status(403)
        self.set_header("Content-Type", "text/plain; charset=utf-8")
        self.finish(self.why)

    def data_received(self, chunk: bytes) -> None:
        """Drops what has come already."""


class _Guarded(RequestHandler):
    """A request for the files of a session."""

    def initialize(self, auth: _Token, workbench: Workbench) -> None:
        self.auth = auth
        self.workbench = workbench

    def prepare(self) -> None:
        if not self.auth.holds(self.request):
            raise HTTPError(403)

    def session(self, name: str) -> Session:
        """Returns the session of a name that exists."""
        if name not in self.workbench.names():
            raise HTTPError(404)
        try:
            return self.workbench.opened(name)
        except SessionError:
            raise HTTPError(404) from None  # a reload of the page tells why

    async def send(self, file: Path) -> None:
        """Sends a result; a report may run its own scripts, and fetch nothing."""
        kind = KINDS.get(file.suffix, "text/plain")
        charset = "" if kind == "application/zip" else "; charset=utf-8"
        self.set_header("Content-Type", kind + charset)
        self.set_header("Content-Security-Policy", REPORT_POLICY)
        self.set_header("X-Content-Type-Options", "nosniff")
        self.set_header("Cache-Control", "no-store")
        if self.get_query_argument("download", ""):
            self.set_header("Content-Disposition", f'attachment; filename="{file.name}"')
        with file.open("rb") as source, suppress(StreamClosedError):
            self.set_header("Content-Length", str(os.fstat(source.fileno()).st_size))
            while piece := source.read(PIECE):  # an archive may be larger than the memory
                self.write(piece)
                await self.flush()


@stream_request_body
class _Upload(_Guarded):
    """Takes a file, piece by piece, into a session."""

    def prepare(self) -> None:
        super().prepare()
        # No form of another site can send this header.
        if self.request.headers.get("X-Ehsid") != "upload":
            raise HTTPError(403)
        self.request.connection.set_max_body_size(UPLOAD_LIMIT)  # type: ignore[union-attr]
        if int(self.request.headers.get("Content-Length", "0")) > UPLOAD_LIMIT:
            raise HTTPError(413)
        session = self.session(self.path_args[0])
        folder = session.folder / "logs"
        folder.mkdir(exist_ok=True)
        self._given = unquote(self.request.headers.get("X-Name", ""))
        self._part = folder / f".upload.{secrets.token_hex(4)}.part"
        self._file = self._part.open("wb")
        self._problem: OSError | None = None

    def data_received(self, chunk: bytes) -> None:
        try:
            self._file.write(chunk)
        except OSError as error:  # a full disk
            self._problem = error

    def post(self, name: str) -> None:
        session, given = self.session(name), safe_name(self._given)
        try:
            self._file.close()
            if self._problem is not None:
                raise SessionError(
                    f"{given}: cannot be kept in the session ({self._problem.strerror}): expected "
                    "room on its disk; make room there, or give the path of the file instead"
                )
            if given.lower().endswith(".toml"):
                said = take_rig_text(session, read_text(self._part), given)
            elif given.lower().endswith(ENDINGS):
                said = take_program(session, self._part, given)
            else:
                said = self._take_log(session, given)
        except (ValueError, OSError) as error:
            self.set_status(400)
            said = str(error_words(error)).replace(str(self._part), given)
        self._drop()
        self.finish(said)

    def _take_log(self, session: Session, given: str) -> str:
        """Gives the log a free name only now: another one of its name may have come meanwhile."""
        folder = self._part.parent
        target = folder / free_name(given, {path.name for path in folder.iterdir()})
        self._part.replace(target)
        try:
            entry = session.add(target)
        except SessionError:
            target.unlink()
            raise
        self.workbench.read(session, entry)
        return ""

    def on_finish(self) -> None:
        self._drop()

    def on_connection_close(self) -> None:
        self._drop()

    def _drop(self) -> None:
        """Leaves nothing of an upload that did not come to its end."""
        if hasattr(self, "_file"):
            self._file.close()
            self._part.unlink(missing_ok=True)


class _Result(_Guarded):
    """Serves a result of a session."""

    async def get(self, name: str, path: str) -> None:
        session = self.session(name)
        file = (session.folder / path).resolve()
        if not file.is_relative_to(session.folder) or not file.is_file():
            raise HTTPError(404)
        if not file.relative_to(session.folder).as_posix().startswith(SERVED):
            raise HTTPError(404)
        await self.send(file)


class _LiveResult(_Guarded):
    """Serves a result of a run on the page Live."""

    async def get(self, name: str, path: str) -> None:
        folder = self.workbench.folder / LIVE
        file = (folder / name / path).resolve()
        if not file.is_file() or not LIVE_SERVED.fullmatch(_below(file, folder)):
            raise HTTPError(404)
        await self.send(file)


class _HistoryResult(_Guarded):
    """Serves the page and the numbers of a history, wherever they are."""

    def initialize(self, auth: _Token, workbench: Workbench) -> None:
        super().initialize(auth, workbench)
        self.histories = Histories(workbench)

    async def get(self, name: str, file: str) -> None:
        if name not in self.histories.names():
            raise HTTPError(404)
        path = self.histories.result(name) / file
        if not path.is_file():
            raise HTTPError(404)
        await self.send(path)


def _below(file: Path, folder: Path) -> str:
    """Returns the path of a file below a folder; "" where it is elsewhere."""
    return file.relative_to(folder).as_posix() if file.is_relative_to(folder) else ""


def _page_of_a_session(workbench: Workbench, histories: Histories) -> pn.Template:
    """Returns the page; where its session cannot be opened, all machines with the reason."""
    try:
        return Page(workbench).template
    except SessionError as error:
        view = MachinesView(histories)
        view.problem.object = look.error(str(error))
        return view.template


def _of_the_loop(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    """Says nothing of a page that was closed while something was sent to it."""
    if not isinstance(context.get("exception"), (WebSocketClosedError, StreamClosedError)):
        loop.default_exception_handler(context)


def serve(folder: Path, port: int = 0, *, ready: Callable[[str], None]) -> None:
    """Serves the workbench until the program is interrupted.

    Parameters
    ----------
    folder
        folder with the sessions.
    port
        number of the port; 0 takes a free one.
    ready
        called with the address, token included, as soon as it can be opened.

    Raises
    ------
    OSError
        the port is taken.
    """
    # Said of a click on a button that has just been replaced; the click is taken all the same.
    warnings.filterwarnings("ignore", "reference already known", BokehUserWarning)
    pn.extension(inline=True)
    pn.config.raw_css = []
    with ExitStack() as closing:  # also where the port is taken
        workbench = Workbench(folder)
        closing.callback(workbench.close)
        histories = Histories(workbench)
        closing.callback(histories.close)
        live = LiveRuns(workbench)
        closing.callback(live.close)
        # Cookies of one machine are shared by all its ports.
        auth = _Token(f"ehsid_{secrets.token_hex(4)}", secrets.token_urlsafe(32))
        about: dict[str, Any] = {"auth": auth, "workbench": workbench}
        loop = IOLoop.current()
        server = get_server(
            {
                "/": lambda: _page_of_a_session(workbench, histories),
                "/machines": lambda: MachinesView(histories).template,
                "/history": lambda: HistoryView(histories).template,
                "/playground": lambda: PlaygroundView(workbench).template,
                "/live": lambda: LivePage(live).template,
            },
            port=port,
            address=ADDRESS,
            title="ehsid",
            show=False,
            start=False,
            loop=loop,
            auth_provider=auth,
            include_cookies=[],
            include_headers=["Host"],
            websocket_max_message_size=MESSAGE_LIMIT,
            check_unused_sessions_milliseconds=5000,
            unused_session_lifetime_milliseconds=30000,
            http_server_kwargs={"max_body_size": BODY_LIMIT},
            extra_patterns=[
                (r"/upload/([^/]+)", _Upload, about),
                (r"/result/([^/]+)/(.+)", _Result, about),
                (rf"/history-result/([^/]+)/({PAGE}|{NUMBERS})", _HistoryResult, about),
                (r"/live-result/(run_\d+)/(.+)", _LiveResult, about),
            ],
        )
        # Only the address itself may be used, not another name of this machine.
        host = ADDRESS if server.port == HTTP_PORT else f"{ADDRESS}:{server.port}"
        rule = Rule(_NotOurs(auth, host), _Refusal)
        server._tornado.default_router.rules.insert(0, rule)
        server._tornado._websocket_origins.clear()
        server._tornado._websocket_origins.add(f"{ADDRESS}:{server.port}")
        loop.asyncio_loop.set_exception_handler(_of_the_loop)  # type: ignore[attr-defined]
        closing.callback(server.stop)
        server.start()
        ready(f"http://{ADDRESS}:{server.port}/login?token={auth.token}")
        loop.start()

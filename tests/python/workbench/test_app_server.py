# SPDX-License-Identifier: MIT
"""What the server of the workbench takes and refuses, as any program here can send it."""

from __future__ import annotations

import http.client
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from app_sessions import BENCH

from ehsid.workbench.session import Session

pytestmark = pytest.mark.slow

pytest.importorskip("panel", reason="the extra app is not installed")


class Running:
    """A workbench in a process of its own, with the cookie of its token."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.said = folder, folder.with_suffix(".log")
        command = [sys.executable, "-m", "ehsid", "app", str(folder), "--no-browser"]
        with self.said.open("wb") as output:
            self.process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        end, found = time.monotonic() + 120.0, None
        while found is None:
            assert time.monotonic() < end, self.said.read_text()
            assert self.process.poll() is None, self.said.read_text()
            time.sleep(0.1)
            found = re.search(r"http://(\S+)(/login\?token=\S+)", self.said.read_text())
        self.host, login = found.groups()
        answer = self.ask("GET", login, {})
        self.cookie = {"Cookie": str(answer.getheader("Set-Cookie")).partition(";")[0]}

    def ask(
        self, method: str, path: str, headers: dict[str, str], body: bytes | None = None
    ) -> http.client.HTTPResponse:
        connection = http.client.HTTPConnection(self.host, timeout=60.0)
        connection.request(method, path, body, headers)
        answer = connection.getresponse()
        answer.body = answer.read().decode()  # type: ignore[attr-defined]
        connection.close()
        return answer

    def upload(self, name: str, content: bytes) -> tuple[int, str]:
        headers = {**self.cookie, "X-Ehsid": "upload", "X-Name": name}
        answer = self.ask("POST", "/upload/press", headers, content)
        return answer.status, answer.body  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    folder = tmp_path_factory.mktemp("served") / "machines"
    for name, part in (
        ("press", ".session.toml.0123abcd.part"),
        ("_live/run_1", ".a.01234567.part"),
    ):
        (folder / name).mkdir(parents=True)
        (folder / name / part).write_text("half")
    Session(folder / "press").save()
    (folder / "press" / "logs").mkdir()
    for name in (".upload.0123abcd.part", "mine.part"):
        (folder / "press" / "logs" / name).write_text("half")
    made = Running(folder)
    yield made
    made.process.send_signal(signal.SIGINT)
    made.process.wait(60.0)
    assert "Traceback" not in made.said.read_text()


def test_what_a_killed_workbench_has_left_half_written_is_removed(running: Running) -> None:
    assert [path.name for path in running.folder.rglob("*.part")] == ["mine.part"]


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "evil.example"},
        {"Host": "localhost:{port}"},
        {"Host": "127.0.0.1"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "https://127.0.0.1:{port}"},
    ],
)
@pytest.mark.parametrize("path", ["/", "/login", "/ws", "/result/press/rig.toml", "/static/js/x"])
def test_a_request_by_another_name_or_from_another_page_is_refused(
    running: Running, headers: dict[str, str], path: str
) -> None:
    port = running.host.partition(":")[2]
    sent = {name: value.format(port=port) for name, value in headers.items()}
    answer = running.ask("GET", path, {**running.cookie, **sent})
    assert answer.status == 403
    assert f"expected {running.host}" in answer.body  # type: ignore[attr-defined]


def test_a_session_of_another_version_stays_as_it_is(running: Running) -> None:
    file = running.folder / "later" / "session.toml"
    file.parent.mkdir()
    file.write_text("version = 99\n")
    for path in ("/", "/?session=later", "/machines"):
        assert running.ask("GET", path, running.cookie).status == 200
    headers = {**running.cookie, "X-Ehsid": "upload", "X-Name": "a.csv"}
    assert running.ask("POST", "/upload/later", headers, b"x").status == 404
    assert [path.name for path in file.parent.iterdir()] == ["session.toml"]
    assert file.read_text() == "version = 99\n"
    file.unlink()


def test_its_own_page_is_served(running: Running) -> None:
    own = {**running.cookie, "Origin": f"http://{running.host}"}
    assert running.ask("GET", "/machines", own).status == 200


@pytest.mark.parametrize("path", ["/", "/login", "/ws", "/upload/press", "/static/x", "/nothing"])
@pytest.mark.parametrize("size", ["Content-Length: 94000000", "Transfer-Encoding: chunked"])
def test_a_body_without_the_token_is_refused_before_it_is_sent(
    running: Running, path: str, size: str
) -> None:
    host, _, port = running.host.partition(":")
    with socket.create_connection((host, int(port)), timeout=60.0) as line:
        line.sendall(f"POST {path} HTTP/1.1\r\nHost: {running.host}\r\n{size}\r\n\r\n".encode())
        assert line.recv(12) == b"HTTP/1.1 403"


def test_only_an_upload_may_have_a_large_body(running: Running) -> None:
    host, _, port = running.host.partition(":")
    head = f"POST / HTTP/1.1\r\nHost: {running.host}\r\nCookie: {running.cookie['Cookie']}\r\n"
    with socket.create_connection((host, int(port)), timeout=60.0) as line:
        line.sendall(f"{head}Content-Length: 94000000\r\n\r\n".encode())
        assert line.recv(12) == b"HTTP/1.1 400"
    assert running.upload("large.csv", b"time_s,a\n" + b"0.1,2.5\n" * 100_000) == (200, "")


def test_uploads_of_one_name_at_once_are_all_kept(running: Running) -> None:
    def send(number: int) -> None:
        assert running.upload("same.csv.gz", b"%d" % number * 200_000) == (200, "")

    threads = [threading.Thread(target=send, args=(number,)) for number in range(4)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    logs = sorted(path for path in (running.folder / "press" / "logs").glob("same*"))
    assert [path.name for path in logs] == [
        "same.csv.gz", "same_2.csv.gz", "same_3.csv.gz", "same_4.csv.gz",
    ]  # fmt: skip
    assert {path.read_bytes()[:1] for path in logs} == {b"0", b"1", b"2", b"3"}
    files = {one.file for one in Session(running.folder / "press").settings.records}
    assert {f"logs/{path.name}" for path in logs} <= files


def test_a_rig_is_taken_only_if_it_can_be_read_and_the_one_before_is_kept(
    running: Running,
) -> None:
    press = running.folder / "press"
    assert (
        running.upload("a.toml", BENCH.read_bytes())[1]
        == "a.toml is the rig of this machine now (bench)."
    )
    status, said = running.upload("b.TOML", b'name = "x"\nplant = "ehs"\n')
    assert (status, said.startswith("b.TOML: ")) == (400, True)
    assert "cylinder.bore_m" in said
    assert (press / "rig.toml").read_bytes() == BENCH.read_bytes()
    status, said = running.upload("c.toml", b"\xff\xfe[")
    assert (status, said) == (400, "c.toml: the text is UTF-16: expected UTF-8; save it as UTF-8")
    for kept in ("rig.before.toml", "rig.before_2.toml"):
        assert f"kept as {kept}." in running.upload("a.toml", BENCH.read_bytes())[1]
        assert (press / kept).read_bytes() == BENCH.read_bytes()
    assert not list(press.rglob(".*.part"))

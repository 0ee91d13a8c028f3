# SPDX-License-Identifier: MIT
"""Files appear whole or not at all."""

import errno
import hashlib
import json
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from interrupts import interruptible

import ehsid
from ehsid.harness.base.exchange import FOLDER
from ehsid.harness.base.files import (
    check_result_folder,
    free_folder,
    is_incomplete,
    replacing,
    result_files,
    result_folder,
    write_text,
)


@given(text=st.text(st.characters(exclude_categories=["Cs"])), before=st.booleans())
def test_what_is_written_is_read_back_to_the_byte(
    tmp_path_factory: pytest.TempPathFactory, text: str, before: bool
) -> None:
    path = tmp_path_factory.mktemp("files") / "result.txt"
    if before:
        path.write_text("an earlier result, longer than the new one" * 9)
    write_text(path, text)
    assert path.read_bytes() == text.encode()
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_leaves_the_earlier_file_and_nothing_beside_it(
    tmp_path: Path, error: type[BaseException]
) -> None:
    path = tmp_path / "result.txt"
    path.write_text("earlier")

    def stop_half_way() -> None:
        with replacing(path) as unfinished:
            unfinished.write_text("half")
            raise error

    with pytest.raises(error):
        stop_half_way()
    assert path.read_text() == "earlier"
    assert list(tmp_path.iterdir()) == [path]


def test_the_file_is_not_there_before_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "result.txt"
    with replacing(path) as unfinished:
        unfinished.write_text("whole")
        assert not path.exists()
        assert unfinished.parent == tmp_path  # a rename within one file system
    assert path.read_text() == "whole"


def test_two_writers_do_not_disturb_each_other(tmp_path: Path) -> None:
    path = tmp_path / "result.txt"
    with replacing(path) as first:
        first.write_text("first")
        with replacing(path) as second:
            second.write_text("second")
        assert path.read_text() == "second"
    assert path.read_text() == "first"
    assert list(tmp_path.iterdir()) == [path]


def test_a_new_file_has_the_permissions_of_any_other(tmp_path: Path) -> None:
    (tmp_path / "other").touch()
    write_text(tmp_path / "result.txt", "")
    assert (tmp_path / "result.txt").stat().st_mode == (tmp_path / "other").stat().st_mode


def test_a_missing_folder_is_an_error_of_the_file_system(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        write_text(tmp_path / "none" / "result.txt", "x")
    assert list(tmp_path.iterdir()) == []


NAMES = ("a.txt", "b.txt", "pictures/*.png")


def put(out: Path, inputs: Sequence[Path] = (), **texts: str) -> None:
    """Writes a result: a file for each text, `pictures_1` for `pictures/1.png`."""
    with result_folder(out, "test", NAMES, inputs) as folder:
        for name, text in texts.items():
            path = folder / (f"{name.replace('_', '/')}.png" if "_" in name else f"{name}.txt")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)


def contents(folder: Path) -> dict[str, str]:
    """All files below a folder that exist for the user; the manifests are left out."""
    return {
        path.relative_to(folder).as_posix(): path.read_text()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and FOLDER not in path.parts
    }


def entries(folder: Path) -> list[str]:
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def test_a_result_and_its_manifest(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "down"
    put(out, a="one", pictures_1="drawn")
    assert entries(out) == [
        FOLDER,
        f"{FOLDER}/test.json",
        "a.txt",
        "pictures",
        "pictures/1.png",
    ]
    manifest = json.loads((out / FOLDER / "test.json").read_text())
    digest = hashlib.sha256(b"one").hexdigest()
    assert manifest["files"]["a.txt"] == {"bytes": 3, "sha256": digest}
    assert sorted(manifest["files"]) == ["a.txt", "pictures/1.png"]
    assert manifest["result"] == "test"
    assert manifest["ehsid_version"] == ehsid.__version__


def test_a_new_result_replaces_its_own_files_only(tmp_path: Path) -> None:
    put(tmp_path, a="one", pictures_1="drawn", pictures_2="drawn")
    (tmp_path / "thesis.txt").write_text("mine")
    (tmp_path / "pictures" / "cat.png").write_text("mine")
    (tmp_path / "pictures" / "2.png").write_text("painted over")
    (tmp_path / "pictures" / "2.png").rename(tmp_path / "kept.png")
    (tmp_path / "pictures" / "cat.png").rename(tmp_path / "pictures" / "cat.jpg")
    put(tmp_path, a="two", b="new")
    assert contents(tmp_path) == {
        "a.txt": "two",
        "b.txt": "new",
        "kept.png": "painted over",
        "pictures/cat.jpg": "mine",
        "thesis.txt": "mine",
    }


def test_results_of_two_commands_share_a_folder(tmp_path: Path) -> None:
    put(tmp_path, a="one")
    with result_folder(tmp_path, "other", ["c.txt"]) as folder:
        (folder / "c.txt").write_text("other")
    put(tmp_path, a="two")
    assert contents(tmp_path) == {"a.txt": "two", "c.txt": "other"}
    with (
        pytest.raises(ValueError, match=r"a\.txt: is there already and is not an earlier result"),
        result_folder(tmp_path, "other", ["a.txt"]),
    ):
        pytest.fail("the work must not begin")


def in_the_way(out: Path, kind: str) -> Path:
    """Puts something of the user in the place of a file of the result."""
    path = out / ("pictures" if kind == "file for a folder" else "a.txt")
    if kind == "link":
        path.symlink_to(out / "nowhere")
    elif kind == "folder":
        path.mkdir()
    elif kind == "changed result":
        put(out, a="made")
        path.write_text("mine")
    else:
        path.write_text("mine")
    return path


@pytest.mark.parametrize("kind", ["file", "link", "folder", "changed result", "file for a folder"])
def test_what_is_not_ours_is_refused_before_the_work(tmp_path: Path, kind: str) -> None:
    path = in_the_way(tmp_path, kind)
    before = entries(tmp_path)
    with (
        pytest.raises(ValueError, match="move it away or name another --out") as refused,
        result_folder(tmp_path, "test", NAMES),
    ):
        pytest.fail("the work must not begin")
    assert str(path) in str(refused.value)
    assert entries(tmp_path) == before


def test_what_comes_during_the_work_stays_and_the_result_too(tmp_path: Path) -> None:
    def work() -> None:
        with result_folder(tmp_path, "test", NAMES) as folder:
            (folder / "a.txt").write_text("made")
            (tmp_path / "a.txt").write_text("mine")

    with pytest.raises(ValueError, match=r"the new results are in .*test_not_placed_1"):
        work()
    assert contents(tmp_path) == {"a.txt": "mine", "test_not_placed_1/a.txt": "made"}


@pytest.mark.parametrize("spelling", ["plain", "dots", "symbolic link", "hard link"])
def test_an_input_is_never_replaced(tmp_path: Path, spelling: str) -> None:
    out = tmp_path / "out"
    put(out, a="earlier", b="earlier")
    given = {"plain": out / "a.txt", "dots": out / ".." / "out" / "a.txt"}.get(
        spelling, tmp_path / "given.txt"
    )
    if spelling == "symbolic link":
        given.symlink_to(out / "a.txt")
    elif spelling == "hard link":
        given.hardlink_to(out / "a.txt")
    with pytest.raises(ValueError, match=r"a\.txt: this is an input of the command"):
        put(out, [given, tmp_path / "not there"], a="new")
    # Nor is it removed because the new result has no such file.
    with pytest.raises(ValueError, match=r"a\.txt: this is an input of the command"):
        put(out, [given], b="new")
    assert contents(out) == {"a.txt": "earlier", "b.txt": "earlier"}


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_an_error_leaves_the_folder_as_it_was(tmp_path: Path, error: type[BaseException]) -> None:
    def stop_half_way(out: Path) -> None:
        with result_folder(out, "test", NAMES) as folder:
            (folder / "a.txt").write_text("half")
            raise error

    put(tmp_path / "old", a="earlier")
    before = entries(tmp_path)
    for out in (tmp_path / "old", tmp_path / "new" / "below"):
        with pytest.raises(error):
            stop_half_way(out)
    assert entries(tmp_path) == before
    assert contents(tmp_path / "old") == {"a.txt": "earlier"}


class Stop(BaseException):
    """Stands for whatever ends a program: an error of the disk, Ctrl-C, or a kill."""


def stop_at(step: int, monkeypatch: pytest.MonkeyPatch, *, killed: bool) -> None:
    """Breaks the exchange of files off before its change of this number; a kill stops all."""
    done = 0

    def counted(change: Callable[[Path, Path], object]) -> Callable[[Path, Path], object]:
        def changed(path: Path, target: Path) -> object:
            nonlocal done
            done += 1
            if done == step or (killed and done > step):
                raise Stop
            return change(path, target)

        return changed

    monkeypatch.setattr(Path, "replace", counted(Path.replace))
    monkeypatch.setattr("os.link", counted(os.link))
    if killed:
        for name in ("put_back", "end"):
            monkeypatch.setattr(f"ehsid.harness.base.exchange.Exchange.{name}", lambda _: None)


BEFORE = {"a.txt": "earlier", "pictures/1.png": "earlier", "thesis.txt": "mine"}
AFTER = {"a.txt": "new", "b.txt": "new", "thesis.txt": "mine"}
STEPS = 6  # The plan, a copy, two files, one that goes, the manifest.


@pytest.mark.parametrize("killed", [False, True])
@pytest.mark.parametrize("links", [True, False], ids=["hard links", "no hard links"])
def test_an_exchange_that_is_broken_off_anywhere_is_undone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, killed: bool, links: bool
) -> None:
    def refused(*_: object) -> None:
        raise OSError("a file system without hard links")

    for step in range(1, STEPS + 1):
        out = tmp_path / str(step)
        put(out, a="earlier", pictures_1="earlier")
        (out / "thesis.txt").write_text("mine")
        with monkeypatch.context() as patch:
            if not links:
                patch.setattr("os.link", refused)
            stop_at(step, patch, killed=killed)
            with pytest.raises(Stop):
                put(out, a="new", b="new")
        assert is_incomplete(out, "test") == (killed and step > 1)
        # At once after an error, after a kill when the next run begins.
        if killed:
            check_result_folder(out, "test", NAMES)
        assert contents(out) == BEFORE, step
        assert not is_incomplete(out, "test")
        assert entries(out / FOLDER) == ["test.json"]
        put(out, a="new", b="new")
        assert contents(out) == AFTER
        assert not (out / "pictures").exists()


def test_an_exchange_without_a_fault_takes_that_many_steps(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(tmp_path, a="earlier", pictures_1="earlier")
    stop_at(STEPS + 1, monkeypatch, killed=False)
    put(tmp_path, a="new", b="new")
    assert contents(tmp_path) == {"a.txt": "new", "b.txt": "new"}


def test_what_was_changed_after_a_kill_is_not_put_back_over(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(tmp_path, a="earlier")
    with monkeypatch.context() as patch:
        stop_at(4, patch, killed=True)
        with pytest.raises(Stop):
            put(tmp_path, a="new", b="new")
    (tmp_path / "a.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"a\.txt: .* has been changed since"):
        put(tmp_path, a="newer")
    assert contents(tmp_path) == {"a.txt": "mine"}
    (tmp_path / "a.txt").unlink()
    put(tmp_path, a="newer")
    assert contents(tmp_path) == {"a.txt": "newer"}


KILLED = """
import sys, time
from pathlib import Path
from ehsid.harness.base.files import result_folder

with result_folder(Path(sys.argv[1]), "test", ["a.txt"]) as folder:
    (folder / "a.txt").write_text("half")
    print("half way", flush=True)
    time.sleep(60.0)
"""


@pytest.mark.skipif(os.name != "posix", reason="signals to a process")
def test_a_second_run_waits_for_no_killed_one_and_disturbs_none(tmp_path: Path) -> None:
    put(tmp_path, a="earlier")
    with interruptible([sys.executable, "-c", KILLED, str(tmp_path)]) as process:
        assert process.stdout is not None
        assert process.stdout.readline().strip() == "half way"
        with pytest.raises(ValueError, match="another run of this command is writing there"):
            put(tmp_path, a="new")
        process.kill()
        process.wait()
    assert contents(tmp_path) == {"a.txt": "earlier"}
    put(tmp_path, a="new")
    assert contents(tmp_path) == {"a.txt": "new"}
    assert entries(tmp_path / FOLDER) == ["test.json"]


def test_strange_files_in_the_folder_aside_are_not_cleared_away(tmp_path: Path) -> None:
    aside = tmp_path / FOLDER / "test.unfinished"
    aside.mkdir(parents=True)
    (aside / "thesis.docx").write_text("mine")
    with pytest.raises(ValueError, match=r"thesis\.docx: not a file of ehsid; move it away"):
        put(tmp_path, a="new")
    assert (aside / "thesis.docx").read_text() == "mine"


@pytest.mark.parametrize("name", ["../mine.txt", "/etc/hosts", "pictures/../../mine.txt", "."])
def test_a_manifest_never_leads_out_of_its_folder(tmp_path: Path, name: str) -> None:
    out = tmp_path / "out"
    put(out, a="earlier")
    (tmp_path / "mine.txt").write_text("earlier")
    path = out / FOLDER / "test.json"
    path.write_text(path.read_text().replace("a.txt", name))
    with pytest.raises(ValueError, match="not a manifest of ehsid"):
        put(out, b="new")
    assert (tmp_path / "mine.txt").read_text() == "earlier"


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        '{"result": "test", "files": {"a.txt": 1}}',
        pytest.param('{"more": ' + "[" * 100_000, id="brackets"),
    ],
)
def test_a_damaged_manifest_is_a_message_with_a_remedy(tmp_path: Path, text: str) -> None:
    put(tmp_path, a="earlier")
    (tmp_path / FOLDER / "test.json").write_text(text)
    with pytest.raises(ValueError, match=r"test\.json: not a manifest of ehsid: .*; remove it"):
        put(tmp_path, a="new")
    assert contents(tmp_path) == {"a.txt": "earlier"}


def test_a_folder_that_cannot_be_made_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for out, words in (
        (tmp_path / "file", "is a file: expected a folder"),
        (tmp_path / "file" / "below", "is a file: expected a folder"),
        (tmp_path / ("x" * 300), "cannot be written to .*; name another --out"),
    ):
        with pytest.raises(ValueError, match=words):
            check_result_folder(out, "test", NAMES)
    assert entries(tmp_path) == ["file"]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EFBIG])
def test_a_full_disk_is_a_message_and_leaves_the_earlier_result(tmp_path: Path, code: int) -> None:
    put(tmp_path, a="earlier")
    with (
        pytest.raises(ValueError, match=r"cannot be written to .*; make room there") as refused,
        result_folder(tmp_path, "test", NAMES),
    ):
        raise OSError(code, os.strerror(code))
    assert os.strerror(code) in str(refused.value)
    assert contents(tmp_path) == {"a.txt": "earlier"}
    assert entries(tmp_path / FOLDER) == ["test.json"]


def test_errors_of_reading_are_not_taken_for_errors_of_writing(tmp_path: Path) -> None:
    with (
        pytest.raises(FileNotFoundError, match="record"),
        result_folder(tmp_path / "out", "test", NAMES),
    ):
        (tmp_path / "record").read_bytes()
    assert entries(tmp_path) == []


def test_single_files_do_not_know_of_each_other(tmp_path: Path) -> None:
    for name in ("one[1].txt", "two.txt", "one[1].txt"):
        with result_files(tmp_path / name, "test", [f"{name}.more"]) as folder:
            (folder / name).write_text(name)
            (folder / f"{name}.more").write_text("more")
    assert sorted(contents(tmp_path)) == [
        "one[1].txt",
        "one[1].txt.more",
        "two.txt",
        "two.txt.more",
    ]
    (tmp_path / "three.txt.more").write_text("mine")
    with (
        pytest.raises(ValueError, match=r"three\.txt\.more: is there already"),
        result_files(tmp_path / "three.txt", "test", ["three.txt.more"]),
    ):
        pytest.fail("the work must not begin")


@pytest.mark.parametrize(
    ("name", "words"),
    [(".", "this is a folder; give the name of a file"), ("none/x", "there is no folder")],
)
def test_a_single_file_needs_a_folder_and_a_name(tmp_path: Path, name: str, words: str) -> None:
    with pytest.raises(ValueError, match=words), result_files(tmp_path / name, "test"):
        pytest.fail("the work must not begin")
    assert entries(tmp_path) == []


def test_free_folders_count_up(tmp_path: Path) -> None:
    (tmp_path / "run_2").touch()
    names = [free_folder(tmp_path, "run").name for _ in range(3)]
    assert names == ["run_1", "run_3", "run_4"]

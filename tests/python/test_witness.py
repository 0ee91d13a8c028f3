# SPDX-License-Identifier: MIT
"""The witness removes what differs from run to run, and finds a line that has changed."""

import subprocess
from pathlib import Path

import pytest
import witness
from plain_text import Plain

PAGE = """<html><head><title>t</title><style>p {}</style></head><body><h2>Gap</h2>
<p hidden>scroll</p><p>It is <em>5.2 %</em>.</p><script>"axis_label":"time in s"</script>
<table><tr><th>run</th><td>1 <p>2</p></td></tr></table></body></html>"""


@pytest.mark.parametrize(
    ("written", "kept"),
    [
        ("fit 99.012345678 %, K = -1.23456789e-05", ["fit 99.01 %, K = -1.235e-05"]),
        ("3500000.0 and 597.04 and 12345", ["3500000.0 and 597.0 and 12345"]),
        ("a = 0.123456789F; 0x1.8p+3 1.2.3456789", ["a = 0.1235F; 0x1.8p+3 1.2.3456789"]),
        ("/tmp/run/out of ehsid 9.8.7", ["<work>/out of ehsid <version>"]),
        ("sha256 " + 64 * "5", ["sha256 <sha256>"]),
        ("diagnosing a: 40 %, about 3 s to go; fitting\n1 of 4, x: effects, 2 s\nkept", ["kept"]),
        ("20 s at 1 kHz\n68 s of one core in all", ["20 s at 1 kHz", "<time> of one core in all"]),
        ('{"seconds": 1.5, "n": [\n0.123456]}', ['{"seconds": "<time>", "n": [0.1235]}']),
    ],
)  # fmt: skip
def test_what_differs_between_runs_and_machines_is_removed(written: str, kept: list[str]) -> None:
    assert Plain(4, {"/tmp/run": "<work>", "9.8.7": "<version>"}).text(written) == kept


def test_of_a_page_the_words_are_kept_and_of_a_table_its_figures(tmp_path: Path) -> None:
    page, table = tmp_path / "page.html", tmp_path / "table.csv"
    page.write_text(PAGE, encoding="utf-8")
    plain = Plain(6, {})
    assert plain.file(page) == ["## Gap", "It is 5.2 %.", "run | 1 2", "in plots: time in s"]
    rows = [f"{k},{k * k}" for k in range(100)]
    table.write_text("\n".join(["a,b", *rows]), encoding="utf-8")
    before = plain.file(table)
    rows[50] = "50,2501"
    table.write_text("\n".join(["a,b", *rows]), encoding="utf-8")
    assert [a == b for a, b in zip(before, plain.file(table), strict=True)] == [*[True] * 6, False]


@pytest.mark.parametrize(
    ("now", "differs"),
    [("gap 0.12348", False), ("gap 0.1239", True), ("Gap 0.12347", True), ("", True)],
)
def test_compare_finds_a_line_that_has_changed(
    now: str, differs: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    def ehsid(folder: Path, words: list[str]) -> subprocess.CompletedProcess[str]:
        (folder / "out.txt").write_text(f"same\n{said}\n", encoding="utf-8")
        return subprocess.CompletedProcess(words, 0, "ehsid 9.8.7\n", "")

    monkeypatch.setattr(witness, "ehsid", ehsid)
    monkeypatch.setattr(witness, "COMMANDS", (witness.Command("gap", ("gap",), 4),))
    said = "gap 0.12347"
    assert witness.main(["record", str(tmp_path)]) == 0
    assert witness.main(["compare", str(tmp_path)]) == 0
    said = now
    assert witness.main(["compare", str(tmp_path)]) == differs
    assert ("-gap 0.1235" in capsys.readouterr().out.splitlines()) == differs

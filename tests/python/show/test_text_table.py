# SPDX-License-Identifier: MIT
from ehsid.harness.show.text_table import TextTable

TABLE = TextTable(
    ("value", "is"), (("mass", "120 kg"), ("a\n<b>", "1\x1b")), title="rig & more", caption="end"
)


def test_text_is_aligned() -> None:
    assert TABLE.text().splitlines() == [
        "rig & more",
        "value      is",
        "-----  ------",
        "mass   120 kg",
        "a <b>   1\\x1b",
        "end",
    ]


def test_words_stand_on_the_left() -> None:
    table = TextTable(("a", "b"), (("x", "y"), ("long", "z")), justify="left")
    assert table.text().splitlines()[2:] == ["x     y", "long  z"]
    assert "text-align:right" not in table.html()


def test_html_is_escaped() -> None:
    html = TABLE.html()
    assert "a\n&lt;b&gt;" in html
    assert "<caption>rig &amp; more</caption>" in html
    assert "\x1b" not in html
    assert html.count("<tr>") == 3
    assert html.endswith("<p>end</p>")

# SPDX-License-Identifier: MIT
"""The built documentation: complete, without broken links, and independent of the network.

script/site builds it first; script/test --all runs both as one step.
"""

import html
import json
import posixpath
import re
from functools import cache
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest
from sphinx.util.inventory import InventoryFile

import ehsid
from ehsid import _core
from ehsid.harness.cli import VERBS

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "build" / "site" / "html"
INCLUDE = ROOT / "cpp" / "include"
HEADERS = sorted(path for path in INCLUDE.rglob("*") if path.is_file())
SCHEMAS = sorted((ROOT / "docs" / "schemas").glob("*.json"))

TARGET = re.compile(r'<(\w+)\b[^>]*?\b(?:href|src)="([^"]*)"')
ANCHOR = re.compile(r'\b(?:id|name)="([^"]*)"')


@pytest.fixture(scope="module")
def inventory() -> dict[str, set[str]]:
    """Names in the index of the site, by their kind."""
    assert (SITE / "objects.inv").is_file(), "the site is not built; run script/site first"
    found = InventoryFile.loads((SITE / "objects.inv").read_bytes(), uri="")
    return {kind: set(names) for kind, names in found.data.items()}


@cache
def page(path: Path) -> str:
    return path.read_text(encoding="utf-8")


@cache
def anchors(path: Path) -> set[str]:
    return {html.unescape(name) for name in ANCHOR.findall(page(path))}


def pages() -> list[Path]:
    found = sorted(SITE.rglob("*.html"))
    assert len(found) > 60
    return [path for path in found if "_static" not in path.parts]


def test_every_function_and_type_of_c_is_there(inventory: dict[str, set[str]]) -> None:
    text = (INCLUDE / "ehsid" / "c_api.h").read_text(encoding="utf-8")
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)
    functions = set(re.findall(r"\b(ehsid_\w+)\(", text))
    assert len(functions) > 15
    assert functions <= inventory["c:function"]
    structs = set(re.findall(r"typedef struct (ehsid_\w+) \{", text))
    assert structs <= inventory["c:struct"]
    assert set(re.findall(r"typedef enum (\w+)", text)) <= inventory["c:enum"]
    assert set(re.findall(r"\b(EHSID_\w+)\s*=\s*\d", text)) <= inventory["c:enumerator"]
    macros = set(re.findall(r"#define (EHSID_[A-Z_]+)\b(?!_)", text)) - {"EHSID_C_API_H"}
    assert macros <= inventory["c:macro"]


def test_every_public_name_of_python_is_there(inventory: dict[str, set[str]]) -> None:
    public = (name for name in (*dir(_core), *ehsid._LAZY) if not name.startswith("_"))
    names = {f"ehsid.{name}" for name in public}
    described = set().union(*(of for kind, of in inventory.items() if kind.startswith("py:")))
    assert len(names) > 40
    assert not names - described


def test_every_member_of_a_public_class_is_there(inventory: dict[str, set[str]]) -> None:
    classes = [name for name in dir(ehsid) if isinstance(getattr(ehsid, name), type)]
    members = {
        f"ehsid.{name}.{member}"
        for name in classes
        for member in vars(getattr(ehsid, name))
        if not member.startswith("_") and member != "info"
    }
    described = set().union(*(of for kind, of in inventory.items() if kind.startswith("py:")))
    assert len(members) > 200
    assert not members - described


def test_every_command_and_option_is_there(inventory: dict[str, set[str]]) -> None:
    assert "ehsid.--version" in inventory["std:cmdoption"]
    labels = {f"command-{verb.name.replace(' ', '-')}" for verb in VERBS}
    assert labels <= inventory["std:label"]
    for verb in VERBS:
        called = f"ehsid-{verb.name.replace(' ', '-')}"
        options = {name for one in verb.load().params for name in one.opts if name[:2] == "--"}
        there = {f"{called}.{name}" for name in options if name != "--help"}
        assert not there - inventory["std:cmdoption"]


@pytest.mark.parametrize("header", HEADERS, ids=lambda path: path.relative_to(INCLUDE).as_posix())
def test_every_class_of_a_header_is_there(header: Path, inventory: dict[str, set[str]]) -> None:
    name = header.relative_to(INCLUDE).as_posix()
    assert "header-" + re.sub(r"[/._]", "-", name) in inventory["std:label"]
    if header.suffix == ".h":
        return
    text = header.read_text(encoding="utf-8")
    text = re.sub(r"^namespace detail \{.*?^\}  // namespace detail", "", text, flags=re.M | re.S)
    found = re.search(r"^namespace (ehsid[\w:]*) \{", text, re.MULTILINE)
    # A name behind which there is neither a specialisation nor the end of a declaration.
    declared = re.findall(r"(?m)^(class|struct|enum class) (\w+)(?= (?:final )?[:{])", text)
    for kind, what in declared:
        assert found
        assert f"{found[1]}::{what}" in inventory["cpp:enum" if kind[0] == "e" else "cpp:class"]


@pytest.mark.parametrize("schema", SCHEMAS, ids=lambda path: path.stem)
def test_every_object_of_a_result_is_there(schema: Path, inventory: dict[str, set[str]]) -> None:
    objects = json.loads(schema.read_text(encoding="utf-8"))["$defs"]
    label = schema.name.replace(".", "-").replace("_", "-")
    assert {f"{label}-{name.lower()}" for name in objects} <= inventory["std:label"]


def test_every_link_inside_the_site_leads_somewhere() -> None:
    broken = []
    seen = set()
    for path in pages():
        for _, given in TARGET.findall(page(path)):
            target = urlsplit(html.unescape(given))
            if target.scheme or target.netloc or (path, given) in seen:
                continue
            seen.add((path, given))
            to = path.parent / unquote(target.path) if target.path else path
            to = Path(posixpath.normpath(to.as_posix()))
            fragment = unquote(target.fragment)
            if not to.exists() or (
                to.suffix == ".html" and fragment and fragment not in anchors(to)
            ):
                broken.append(f"{path.relative_to(SITE)}: {given}")
    assert len(seen) > 1000
    assert not broken


@pytest.mark.parametrize("section", ["how_to", "explanation", "reference", "evidence"])
def test_an_index_is_one_list_with_a_few_words_on_each_page(section: str) -> None:
    text = page(SITE / section / "index.html")
    article = text[text.index('<article class="bd-article"') : text.index("</article>")]
    assert 'class="toctree-l1"' not in article
    entries = re.findall(r"<li><p>(.*?)</p>", article, re.DOTALL)
    assert len(entries) > 5
    assert not [one for one in entries if not re.match(r"<a .*?</a>: \S.*\.$", one, re.DOTALL)]


def test_links_to_other_sites_are_well_formed() -> None:
    outside = {
        html.unescape(given)
        for path in pages()
        for tag, given in TARGET.findall(page(path))
        if tag == "a" and "://" in given
    }
    assert outside
    assert not [
        one for one in outside if not re.fullmatch(r"https?://[\w.-]+\.\w+([/?#]\S*)?", one)
    ]


def test_nothing_is_loaded_from_elsewhere() -> None:
    loaded = {
        given
        for path in pages()
        for tag, given in TARGET.findall(page(path))
        if tag in ("script", "link", "img", "source", "iframe") and "//" in given
    }
    assert not loaded
    styles = [path.read_text(encoding="utf-8") for path in SITE.rglob("*.css")]
    assert styles
    assert not [style for style in styles if re.search(r"url\(['\"]?(https?:)?//", style)]

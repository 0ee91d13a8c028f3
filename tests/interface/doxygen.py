# SPDX-License-Identifier: MIT
"""What doxygen reads in our headers, as XML."""

import re
import subprocess
import tempfile
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator
from functools import cache
from pathlib import Path

SETTINGS = """
INPUT = "{headers}"
FILE_PATTERNS = *.hpp *.h
RECURSIVE = YES
EXCLUDE = "{headers}/plant"
STRIP_FROM_PATH = "{headers}"
OUTPUT_DIRECTORY = "{out}"
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
EXTRACT_ALL = YES
QUIET = YES
WARNINGS = NO
MACRO_EXPANSION = YES
EXPAND_ONLY_PREDEF = YES
PREDEFINED = EHSID_ALWAYS_INLINE= EHSID_ONCE= EHSID_RARE=
"""


@cache
def compounds(headers: Path) -> list[ElementTree.Element]:
    """Classes, namespaces and files of the headers in a folder, without the simulator."""
    with tempfile.TemporaryDirectory() as out:
        settings = SETTINGS.format(headers=headers.resolve(), out=out)
        subprocess.run(["doxygen", "-"], input=settings, text=True, capture_output=True, check=True)
        found = []
        for path in sorted((Path(out) / "xml").glob("*.xml")):
            if path.name != "index.xml":
                found += ElementTree.parse(path).getroot().findall("compounddef")
    return found


def members(compound: ElementTree.Element) -> Iterator[ElementTree.Element]:
    """The members that a user may name."""
    for member in compound.iter("memberdef"):
        if member.get("prot") == "public" and member.get("kind") != "friend":
            yield member


def file_of(element: ElementTree.Element) -> str:
    """The header, relative to the folder that was read."""
    location = element.find("location")
    return "" if location is None else location.get("file", "")


def text_of(element: ElementTree.Element, tag: str) -> str:
    """The text of a part, without the spaces that differ between versions of doxygen."""
    part = element.find(tag)
    words = " ".join("".join(part.itertext()).split()) if part is not None else ""
    return re.sub(r"\s*([^\w\s])\s*", r"\1", words)

# SPDX-License-Identifier: MIT
"""Runs a block in Structured Text as C.

Of the language only this is read, which is all that the exported blocks use; anything else ends
with an error:

- one FUNCTION_BLOCK with VAR, VAR_INPUT, VAR_OUTPUT and VAR CONSTANT; one variable a line, of type
  REAL, LREAL, DINT, INT or BOOL, or an array of one from 0 on, with its initial values;
- assignments, IF ELSIF ELSE, FOR TO BY, RETURN;
- AND OR NOT, + - * /, comparisons, ABS, SQRT, DINT_TO_REAL, DINT_TO_LREAL, literals such as
  REAL#7.0; their order of evaluation is that of C, operator by operator.
"""

from __future__ import annotations

import ctypes
import re
import subprocess
from pathlib import Path
from typing import Any

import numpy as np

TYPES: dict[str, tuple[str, Any]] = {
    "REAL": ("float", ctypes.c_float),
    "LREAL": ("double", ctypes.c_double),
    "DINT": ("int32_t", ctypes.c_int32),
    "INT": ("int16_t", ctypes.c_int16),
    "BOOL": ("uint8_t", ctypes.c_uint8),
}
WORDS = {"AND": "&&", "OR": "||", "NOT": "!", "=": "==", "<>": "!=", ":=": "=", "TRUE": "1"}
WORDS |= {"FALSE": "0", "IF": "if (", "ELSIF": "} else if (", "THEN": ") {", "ELSE": "} else {"}
WORDS |= {"RETURN": "return", "DINT_TO_REAL": "(float)", "DINT_TO_LREAL": "(double)"}
WORDS |= {each: each for each in ("+", "-", "*", "/", "<", ">", "<=", ">=", "(", ")", "[", "]")}
TOKEN = re.compile(r"\s*(:=|<>|<=|>=|[-+*/<>=()\[\];]|L?REAL#[0-9.E-]+|[0-9][0-9.E]*|\w+)")
DECLARED = re.compile(r"  (\w+) : (?:ARRAY\[0\.\.(\d+)\] OF )?(\w+)(?: := \[?([^\];]*)\]?)?;")
LOOP = re.compile(r"FOR (\w+) := ([^;]*?) TO ([^;]*?)(?: BY (-?\d+))? DO")


class Block:
    """A function block, compiled: its variables are attributes, its arrays numpy arrays."""

    def __init__(self, text: str, folder: Path) -> None:
        plain = re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL)
        head, body = plain.rsplit("END_VAR", 1)
        body = body.removesuffix("END_FUNCTION_BLOCK\n")
        # A name may differ from another by more than the case of its letters only.
        self.kinds: dict[str, tuple[str, int]] = {}
        starts = []
        for name, last, kind, values in DECLARED.findall(head):
            assert name.lower() not in {each.lower() for each in self.kinds}, name
            self.kinds[name] = kind, int(last) + 1 if last else 0
            for i, value in enumerate(values.split(", ") if values else []):
                place = f"[{i}]" if last else ""
                literal = WORDS.get(value, value + ("f" if kind == "REAL" else ""))
                starts.append(f"b->{name}{place} = {literal};\n")
        self._real = "float" if any(kind == "REAL" for kind, _ in self.kinds.values()) else "double"
        members = "".join(
            f"{TYPES[kind][0]} {name}{f'[{length}]' if length else ''};\n"
            for name, (kind, length) in self.kinds.items()
        )
        code = (
            "#include <math.h>\n#include <stdint.h>\n#include <string.h>\n"
            f"typedef struct {{\n{members}}} block_t;\n"
            f"void start(block_t *b) {{\nmemset(b, 0, sizeof *b);\n{''.join(starts)}}}\n"
            f"void cycle(block_t *b) {{\n{self._statements(body)}}}\n"
        )
        (folder / "block.c").write_text(code)
        command = (
            "cc -std=c99 -Wall -Werror -O1 -ffp-contract=off -fPIC -shared -o block.so block.c"
        )
        subprocess.run([*command.split(), "-lm"], cwd=folder, check=True)
        self._library = ctypes.CDLL(str(folder / "block.so"))
        fields = [
            (name, TYPES[kind][1] * length if length else TYPES[kind][1])
            for name, (kind, length) in self.kinds.items()
        ]
        self._state: Any = type("State", (ctypes.Structure,), {"_fields_": fields})()
        self._library.start(ctypes.byref(self._state))

    def cycle(self, **inputs: float) -> None:
        """One cycle of the task with these inputs."""
        for name, value in inputs.items():
            setattr(self._state, name, value)
        self._library.cycle(ctypes.byref(self._state))

    def __getitem__(self, name: str) -> Any:
        value = getattr(self._state, name)
        return np.array(value) if self.kinds[name][1] else value

    def _statements(self, body: str) -> str:
        body = LOOP.sub(self._loop, body)
        body = re.sub(r"END_(FOR|IF);", "}", body)
        lines = []
        for part in re.split(r"(<C<.*?>C>)", body):
            if part.startswith("<C<"):
                lines.append(part[3:-3])
                continue
            lines.append(self._expression(part))
        return "".join(lines)

    def _loop(self, found: re.Match[str]) -> str:
        name, first, last, by = found.groups()
        test, move = (">=", "--") if by == "-1" else ("<=", "++")
        assert by in (None, "-1"), by
        counter, begin, end = (self._expression(each) for each in (name, first, last))
        return f"<C<for ({counter} = {begin}; {counter} {test} {end}; {counter}{move}) {{>C>"

    def _expression(self, text: str) -> str:
        out, at = [], 0
        text = text.replace("}", "\0").rstrip()
        for piece in re.split("(\0)", text):
            if piece == "\0":
                out.append("}\n")
                continue
            at = 0
            while at < len(piece.rstrip()):
                found = TOKEN.match(piece, at)
                assert found, f"not read: {piece[at : at + 60]!r}"
                out.append(self._token(found[1]))
                at = found.end()
        return " ".join(out)

    def _token(self, token: str) -> str:
        if token in self.kinds:
            return f"b->{token}"
        if token in ("ABS", "SQRT"):
            name = {"ABS": "fabs", "SQRT": "sqrt"}[token]
            return name + ("f" if self._real == "float" else "")
        if "REAL#" in token:
            kind, number = token.split("#")
            return number + ("f" if kind == "REAL" else "")
        if token[0].isdigit() or token == ";":
            assert "." not in token, f"a literal without a type: {token}"
            return token + ("\n" if token == ";" else "")
        return WORDS[token]

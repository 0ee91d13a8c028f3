# SPDX-License-Identifier: MIT
"""Makes comments that Doxygen reads out of the plain comments of a header.

In the headers a comment behind a declaration describes it, a comment of C above a declaration
describes that one, and the comment at the head of a file describes the file. They are plain
comments there, which are easier to read.
"""

from __future__ import annotations

import re

TYPE = re.compile(r"(template <.*> )?(typedef )?(class|struct|enum|union)\b")
BEHIND = re.compile(r"(?P<code> *\S.*?)  ?(?://|/\*) (?!NOLINT|namespace)(?P<words>.*)")
ABOVE_IN_C = re.compile(
    r" */\* (?!SPDX|clang-format|NOLINT|policies:|settings:|end of |Tables of functions)"
)

# Lines of a comment that are indented: Doxygen would join them.
EQUATIONS = re.compile(r"^( *)(///  +\S.*\n(?:\1///  +\S.*\n)*)", re.MULTILINE)
# Code in a comment stands in backquotes.
IN_COMMENT = re.compile(r"^.*(?:///<?|/\*\*<?|^ \*) (?! ).*$", re.MULTILINE)
CODE = re.compile(r"`([^`<&]+)`")
# Of `typedef struct name {...} name;` Doxygen would make two things with one name.
TYPEDEF_IN_C = re.compile(r"^typedef (struct|enum) (\w+) \{(.*?)\n\} \2;", re.MULTILINE | re.DOTALL)


def for_doxygen(text: str, group: str) -> str:
    """Returns the text of a header with comments that Doxygen takes for documentation.

    All that it declares is in a group of Doxygen, whose content Breathe can show without the
    namespaces around it.
    """
    in_c = text.startswith("/*")
    lines = text.splitlines()
    opened: dict[int, str] = {}  # by indentation: the last line that opened a block
    column = 0  # of the comment that the next line may go on with; 0: none
    for at, line in enumerate(lines):
        indentation = len(line) - len(line.lstrip())
        declares = indentation == 0 or TYPE.match(opened.get(indentation - 2, "").lstrip())
        found = BEHIND.fullmatch(line)
        if found and declares and found["code"].rstrip()[-1] not in "{(\\":
            column = found.end("code")
            code, words = found["code"], found["words"]
            lines[at] = f"{code} /**< {words}" if in_c else f"{code}  ///< {words}"
        elif column and not in_c and re.fullmatch(rf" {{{column},}} ?// .*", line):
            lines[at] = line.replace("// ", "///< ", 1)
        else:
            column = 0
            if in_c and ABOVE_IN_C.match(line):
                lines[at] = line.replace("/* ", "/** ", 1)
        if line.endswith("{"):
            opened[indentation] = line
    made = "\n".join(lines) + "\n"
    made = EQUATIONS.sub(r"\1/// \\verbatim\n\1\2\1/// \\endverbatim\n", made)
    made = IN_COMMENT.sub(lambda line: CODE.sub(r"<tt>\1</tt>", line[0]), made)
    opening, closing = f"/** \\addtogroup {group} */\n/** @{{ */\n", "/** @} */\n"
    if in_c:
        made = TYPEDEF_IN_C.sub(r"\1 \2 {\3\n};", made)
        head = made.index("*/") + 3
        return made[:head] + opening + made[head:] + closing
    made = re.sub(r"(?m)^namespace ehsid.* \{\n", lambda line: line[0] + opening, made)
    return re.sub(r"(?m)^\}  // namespace ehsid", lambda line: closing + line[0], made)


def declares(text: str) -> bool:
    """Returns whether a header declares anything, beside what it includes."""
    return text.startswith("/*") or "\nnamespace ehsid" in text


def head_comment(text: str) -> str:
    """Returns the words of the comment at the head of a header."""
    if text.startswith("/*"):
        words = text[: text.index("*/")].splitlines()[1:]
        return "\n".join(line.removeprefix(" *").removeprefix(" ") for line in words)
    lines = []
    for line in text.splitlines()[1:]:
        if not line.startswith("//"):
            break
        lines.append(line.removeprefix("//").removeprefix(" "))
    return "\n".join(lines)

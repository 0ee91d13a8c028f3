# SPDX-License-Identifier: MIT
"""Records that no command can read. The message is the same whatever the command."""

from __future__ import annotations

import gzip
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse
from bad_input.case import Case, Content, command
from bad_input.inputs import (
    BENCH,
    GOOD,
    LONG,
    a_folder,
    a_link_to,
    a_pipe,
    made,
    mat,
    npz,
    parquet,
    signals,
)

TITLE = "Records"
ABOUT = (
    "Every command that reads records reads them in the same way and gives the same message. The "
    "test gives each of these files to all of them: `identify`, `estimate`, `export`, `experiment "
    "--record`, `gap`, `gap --validate`, `inject`, `simulate --command` and `gap-fleet`."
)
FIELDS = {name: values[:6] for name, values in signals(6, 0.1).items()}
SEMICOLONS = GOOD.replace(",", ";")
OBJECTS = np.array([{}] * 6, dtype=object)
HDF5 = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(384) + b"\x89HDF\r\n\x1a\n"
# The words of the library that reads the format.
READER = r"(?<=file \().*?(?=\)\. Expected)"


def damaged(content: bytes) -> bytes:
    """The content with other bytes in its middle."""
    middle = len(content) // 2
    return content[:middle] + bytes(20) + content[middle + 20 :]


# What each command needs beside the record, and its line; RECORD stands for the file.
LINES = {
    "identify": "ehsid identify RECORD --out out",
    "estimate": "ehsid estimate RECORD --out out",
    "export": "ehsid export RECORD --out servo.hpp",
    "experiment": "ehsid experiment --record RECORD --out out",
    "gap": "ehsid gap RECORD --rig rig.toml --out out",
    "gap --validate": "ehsid gap good.csv --validate RECORD --rig rig.toml --out out",
    "inject": "ehsid inject RECORD --rig rig.toml --effect gain --set factor=1.1 --out new.csv",
    "simulate": "ehsid simulate rig.toml --command RECORD --out new.csv",
}
ENDINGS = (".csv", ".csv.gz", ".parquet", ".mat", ".npz")
BESIDE: dict[str, Content] = {"rig.toml": BENCH, "good.csv": LONG}


@dataclass(frozen=True)
class BadRecord:
    """A record that cannot be read."""

    wrong: str
    """What is wrong with it."""
    name: str
    content: Content | None
    """Of its file; without content there is no file."""
    library: str | None
    """As in `Case`."""
    environment: Mapping[str, str]
    """Environment variables of the command."""

    def case(self, verb: str) -> Case:
        """This record given to one of the commands in `LINES`."""
        files = {} if self.content is None else {self.name: self.content}
        return command(
            self.wrong,
            LINES[verb].replace("RECORD", self.name),
            files=files if verb == "identify" else {**BESIDE, **files},
            environment=self.environment,
            library=self.library,
        )


def with_content(
    wrong: str,
    name: str,
    content: Content | None,
    library: str | None = None,
    **environment: str,
) -> BadRecord:
    return BadRecord(wrong, name, content, library, environment)


def bad_csv(wrong: str, text: str | bytes, **environment: str) -> BadRecord:
    return with_content(wrong, "record.csv", text, **environment)


def changed(wrong: str, old: str, new: str) -> BadRecord:
    """The good record after one replacement."""
    assert old in GOOD
    return bad_csv(wrong, GOOD.replace(old, new))


def times(*written: str) -> str:
    return "time_s,command_v,position_m\n" + "".join(f"{t},1,0.5\n" for t in written)


BAD = (
    bad_csv("an empty file", ""),
    bad_csv("only spaces and line ends", " \n\n \n"),
    bad_csv("a header only", "time_s,command_v,position_m\n"),
    bad_csv("a header and one row", GOOD[: GOOD.index("0.1")]),
    bad_csv("no header", GOOD.partition("\n")[2]),
    bad_csv("text in a cell between semicolons", SEMICOLONS.replace("0.3;3", "0.3;abc")),
    bad_csv("a cell too many between semicolons", SEMICOLONS.replace("0.3;3", "0.3;3;3")),
    bad_csv("a text without a table", "Hello\nthis is\nno log\n"),
    bad_csv("a blank row in the middle", GOOD.replace("0.3,", "\n0.3,")),
    bad_csv(
        "a decimal comma between commas",
        "time_s,command_v,position_m\n" + "".join(f"0,{k},1,0,0,{k}\n" for k in range(6)),
    ),
    changed("text in a cell", "0.3,3,", "0.3,abc,"),
    changed("a quoted decimal comma", "0.3,3,", '0.3,"3,5",'),
    changed("an underscore in a number", "0.3,3,", "0.3,1_000,"),
    changed("a thousands separator", "0.3,3,", "0.3,1'000,"),
    changed("Arabic digits", "0.3,3,", "0.3,٣,"),
    changed("full-width digits", "0.3,3,", "0.3,３,"),
    changed("a minus sign of typography", "0.3,3,", "0.3,−3,"),
    changed("a unit behind the number", "0.3,3,", "0.3,3 V,"),
    changed("a hexadecimal number", "0.3,3,", "0.3,0x10,"),
    changed("a formula", "0.3,3,", "0.3,=A1+1,"),
    changed("an escape sequence in a cell", "0.3,3,", "0.3,\x1b[2J,"),
    changed("an empty cell", "0.3,3,", "0.3,,"),
    changed("NaN in a cell", "0.3,3,", "0.3,NaN,"),
    changed("infinity in a cell", "0.3,3,", "0.3,-inf,"),
    changed("a number beyond float64", "0.3,3,", "0.3,1e999,"),
    changed("a cell too many", "0.3,3,", "0.3,3,3,"),
    changed("a cell too few", "0.3,3,", "0.3,"),
    changed("a quotation mark that is not closed", "0.3,3", '0.3,"3'),
    changed("two columns of one name", "command_v", "position_m"),
    changed("a column without a name", "command_v", ""),
    changed("a name with a typing error", "command_v", "comand_v"),
    changed("no such column", "position_m", "q"),
    bad_csv("one time twice", times("0", "0.1", "0.1", "0.2")),
    bad_csv("time that runs backwards", times("0", "0.2", "0.1", "0.3")),
    bad_csv("dates for times", times("0", "0.1", "12:00:00")),
    bad_csv("the same time everywhere", times("1", "1", "1")),
    bad_csv("a file cut within its last number", LONG[:-4]),
    bad_csv("UTF-16 text without its mark", GOOD.encode("utf-16-le")),
    bad_csv("a zero byte", GOOD.replace("0.3,3", "0.3,\0").encode()),
    bad_csv("random bytes", np.random.default_rng(1).bytes(500)),
    bad_csv("a picture (PNG)", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(60)),
    bad_csv("gzip that its name does not show", gzip.compress(GOOD.encode())),
    bad_csv(
        "a line longer than the limit",
        "time_s,command_v,position_m\n" + "1" * 5000,
        EHSID_MAX_LINE="1000",
    ),
    bad_csv("more samples than the limit", GOOD, EHSID_MAX_SAMPLES="5"),
    bad_csv(
        "more columns than the limit",
        ",".join(f"c{i}" for i in range(2100)) + "\n" + "1," * 2099 + "1\n",
    ),
    with_content("an empty gzip file", "record.csv.gz", b""),
    with_content("plain text named .gz", "record.csv.gz", GOOD),
    with_content("gzip cut short", "record.csv.gz", gzip.compress(LONG.encode())[:-20]),
    with_content(
        "gzip with a damaged middle",
        "record.csv.gz",
        damaged(gzip.compress(LONG.encode())),
        library=r"(?<=damaged \().*?(?=\)\.)",
    ),
    with_content(
        "gzip of 64 MB of zeros (a bomb)",
        "record.csv.gz",
        gzip.compress(bytes(2**26)),
        EHSID_MAX_BYTES="1000000",
    ),
    with_content("an empty NPZ file", "record.npz", b""),
    with_content("text named .npz", "record.npz", GOOD),
    with_content("NPZ cut short", "record.npz", npz(**FIELDS)[:-50], library=READER),
    with_content(
        "a single array, not an archive",
        "record.npz",
        made(lambda file: np.save(file, np.arange(6.0))),
    ),
    with_content(
        "NPZ with Python objects",
        "record.npz",
        npz(**FIELDS | {"command_v": OBJECTS}),
        library=r"(?<=read \().*?(?=\)\.)",
    ),
    with_content("NPZ with text", "record.npz", npz(**FIELDS | {"command_v": np.array(["1"] * 6)})),
    with_content(
        "NPZ with complex numbers", "record.npz", npz(**FIELDS | {"command_v": np.ones(6) * 1j})
    ),
    with_content(
        "columns of unequal lengths", "record.npz", npz(**FIELDS | {"position_m": np.arange(5.0)})
    ),
    with_content(
        "a matrix for a column", "record.npz", npz(**FIELDS | {"position_m": np.ones((6, 2))})
    ),
    with_content("a number for a column", "record.npz", npz(**FIELDS | {"position_m": 1.0})),
    with_content(
        "NPZ of 64 MB of zeros (a bomb)",
        "record.npz",
        made(lambda file: np.savez_compressed(file, **FIELDS, x=np.zeros(2**23))),
        EHSID_MAX_BYTES="1000000",
    ),
    with_content("text named .mat", "record.mat", GOOD, library=READER),
    with_content("MAT cut short", "record.mat", mat(**FIELDS)[:-50], library=READER),
    with_content("MAT of version 7.3, damaged", "record.mat", HDF5, library=READER),
    with_content("text named .xlsx", "record.xlsx", GOOD, library=READER),
    with_content("text named .h5", "record.h5", GOOD, library=READER),
    with_content("text named .mf4", "record.mf4", GOOD, library=READER),
    with_content("text named .tdms", "record.tdms", GOOD, library=READER),
    with_content("text named .mcap", "record.mcap", GOOD, library=READER),
    with_content("text named .bag", "record.bag", GOOD, library=READER),
    with_content("bytes named .txt", "record.txt", bytes(range(256)) * 9),
    with_content(
        "a sparse matrix",
        "record.mat",
        mat(**FIELDS | {"command_v": scipy.sparse.csc_matrix(np.eye(6))}),
    ),
    with_content("a cell array", "record.mat", mat(**FIELDS | {"command_v": OBJECTS})),
    with_content("text named .parquet", "record.parquet", GOOD, library=READER),
    with_content("Parquet cut short", "record.parquet", parquet(**FIELDS)[:-50], library=READER),
    with_content(
        "Parquet with text", "record.parquet", parquet(**FIELDS | {"command_v": ["1"] * 6})
    ),
    with_content(
        "Parquet with missing cells",
        "record.parquet",
        parquet(**FIELDS | {"command_v": [1.0, None, 2.0, None, 1.0, 1.0]}),
    ),
    with_content(
        "Parquet of 2e6 equal rows (a bomb)",
        "record.parquet",
        parquet(**{name: np.zeros(2_000_000) for name in FIELDS}),
        EHSID_MAX_SAMPLES="1000000",
    ),
    with_content("no such file", "record.csv", None),
    with_content("a folder", "record.csv", a_folder),
    with_content("a pipe", "record.csv", a_pipe),
    with_content("a link to a device", "record.csv", a_link_to("/dev/zero")),
    with_content("a link to nowhere", "record.csv", a_link_to("nowhere")),
    with_content("a link to itself", "record.csv", a_link_to("record.csv")),
    with_content("an extension that is not known", "record.docx", GOOD),
    with_content("no extension", "record", GOOD),
    with_content("a name of 300 letters", "r" * 300 + ".csv", None),
)

CASES = (
    *(record.case("identify") for record in BAD),
    command(
        "a limit that is no number",
        "ehsid identify record.csv",
        files={"record.csv": GOOD},
        environment={"EHSID_MAX_BYTES": "1e9"},
    ),
)

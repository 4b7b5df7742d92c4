"""The bytes of a text log, unpacked and in an ASCII-compatible encoding, in blocks of whole lines."""

from __future__ import annotations

import codecs
import gzip
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, cast

from vdyn_cli.io.files import folder_error, remedy_for_missing_file
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.input_file import open_regular, unreadable

BLOCK = 1 << 20  # bytes; a few blocks are small compared with the channels, and larger ones are not faster
_LONGEST_LINE = 64 << 20
_MOST_RATIO = 250  # unpacked bytes per byte of a gzip file: logs of numbers reach some 20, blank lines 1000
_MOST_UNPACKED = 64 << 20  # bytes that are unpacked at any ratio; they take a second

# ASCII-compatible encodings, in which numbers and delimiters can be read without decoding the file.
_KEEPS_ASCII = {"utf-8", "ascii", "iso8859-1", "cp1252", "iso8859-15", "cp1250", "cp850", "mac-roman"}

# Encodings in which nearly any text can be read, and words of logs that show that it is theirs.
_WORDS_OF = {
    "gb18030": "时间|車速|车速|速度|转速|转矩|扭矩",
    "shift_jis": "時間|時刻|車速|速度|回転|トルク",
    "big5": "時間|車速|速度|轉速|扭矩",
    "euc_kr": "시간|속도|차속|토크",
    "cp1251": "[Вв]ремя|[Сс]корость",
}
_FORMATS = {
    b"PK\x03\x04": "a zip archive or an Excel workbook (.xlsx)",
    b"\xd0\xcf\x11\xe0": "an old Excel workbook (.xls)",
    b"MDF  ": "an MDF/MF4 measurement",
    b"UnFinMF ": "an unfinished MF4 measurement",
    b"\x89HDF": "an HDF5 or MATLAB 7.3 file",
    b"MATLAB 5.0": "a MATLAB file",
    b"PAR1": "a Parquet file",
    b"BZh": "a bzip2 archive",
    b"\xfd7zXZ": "an xz archive",
    b"\x28\xb5\x2f\xfd": "a zstd archive",
    b"%PDF": "a PDF",
    b"\x89PNG": "a picture",
    b"LOGG": "a trace of bus frames by Vector (.blf)",
    b"<hCNF": "an AiM log (.xrk)",
    b"MLVLG": "a log of MegaLogViewer (.mlg)",
    b"@\0\0\0\0\0\0\0": "a MoTeC log (.ld)",
    b"#ROSBAG": "a ROS bag",
    b"\x89MCAP": "a ROS bag (.mcap)",
    b"SQLite format 3": "an SQLite database, such as a ROS 2 bag",
    b"|CF,": "an imc FAMOS file",
}
# Text formats that contain the raw bytes of bus messages, which need the description of the bus; and text without a
# table.
_DECODE = "decode it with the DBC or ARXML file of the bus first, and save its signals as MF4 or CSV"
_CONVERT = "convert it to CSV, as 'gpsbabel -t -i {} -f LOG -o unicsv -F LOG.csv' does"
_FIT = "convert the FIT file with 'FitCSVTool --data record'; its file that ends in _data.csv is a table"
_TEXTS = (
    (rb"date [^\n]{8,60}\r?\n\s*base (hex|dec)\s+timestamps", "a trace of bus frames by Vector (.asc)", _DECODE),
    (rb";\$FILEVERSION=", "a trace of bus frames by PEAK (.trc)", _DECODE),
    (rb"\s*\(\d+\.\d+\)\s+\w+\s+[0-9A-Fa-f]+#", "a trace of bus frames by candump", _DECODE),
    (rb"\*\*\*BUSMASTER", "a trace of bus frames by BUSMASTER", _DECODE),
    (
        rb"(?i)(time stamp,id,extended,|[^\n]*\b(can|arb|arbitration)[ _]?id\b[^\n]*\b(data|payload|d0|d1|byte ?0)\b"
        rb"|[^\n]*\bid\b[^\n]*\bdlc\b[^\n]*\bdata|time,addr,bus,data)",
        "a trace of bus frames, with the bytes of their identifiers and data",
        _DECODE,
    ),
    (
        rb"Type,Local Number,Message,Field 1,Value 1,Units 1",
        "a list of FIT messages of several kinds, not a table",
        _FIT,
    ),
    (rb"(?s).{8}\.FIT", "a FIT file of a cycling computer or a watch, not a text log", _FIT),
    (
        rb"%DataLog%",
        "a Haltech log, whose channels are listed above the samples, not a table",
        "replace the lines above the first sample by one line of their names, such as 'Time,RPM,Vehicle Speed'; the "
        "samples are raw: a speed has 'unit: 0.1 km/h'",
    ),
    (
        rb"(#[^\r\n]*[\r\n]+)*[$!][A-Z]{2}[A-Z0-9]{2,5},[^\r\n]*\*[0-9A-F]{2}\s",
        "a receiver's NMEA sentences, not a table",
        _CONVERT.format("nmea"),
    ),
    (
        rb"(?i)\s*(<!doctype html|<html)",
        "a web page, not a log",
        "download the log again; the page may ask for a login",
    ),
    (rb"\s*<(\?xml|gpx|kml)", "XML, such as a GPX track, not a table", _CONVERT.format("gpx")),
    (rb"version https://git-lfs", "a pointer of Git LFS, not the log itself", "fetch the log with 'git lfs pull'"),
)
_REMEDIES = {
    "a zip archive or an Excel workbook (.xlsx)": "unpack it and name the logs in it, or save the workbook as CSV",
    "a trace of bus frames by Vector (.blf)": _DECODE,
    "an AiM log (.xrk)": "export its channels as CSV in Race Studio",
    "a log of MegaLogViewer (.mlg)": "export it as .msl or CSV",
    "a MoTeC log (.ld)": "export its channels as CSV in i2",
    "an imc FAMOS file": "export the channels as MDF, MATLAB or CSV",
}


@dataclass(frozen=True)
class CsvSource:
    """Blocks of whole lines in an ASCII-compatible encoding, and its name; the first block may be empty."""

    encoding: str
    blocks: Iterator[bytes]


def is_other_format(path: Path) -> bool:
    """Whether the file's first bytes are those of a known binary format."""
    try:
        with open_regular(path) as stream:
            head = stream.read(max(map(len, _FORMATS)))
    except (OSError, ValueError):
        return False
    return head.startswith(tuple(_FORMATS))


@contextmanager
def open_source(path: Path, encoding: str | None = None, block: int = BLOCK) -> Iterator[CsvSource]:
    """Open a text log, plain or gzip, in any encoding; a byte order mark is removed.

    Raises
    ------
    InputError : the file is missing, a folder, unreadable, damaged, empty, or not text; some only when it is read.
    """
    known = _lookup(path, encoding)
    with _open(path) as stream:
        chunks = _chunks(path, stream, block)
        first = next(chunks, b"")
        if not first.strip(b"\r\n\t \0\x1a\xef\xbb\xbf\xff\xfe"):
            raise InputError(Finding(str(path), "the file is empty", remedy="export the log again"))
        found, skip = _sniff(path, first, known)
        text = _joined(first[skip:], chunks)
        if found not in _KEEPS_ASCII:
            text, found = _transcoded(text, found), "utf-8"
        yield CsvSource(found, _whole_lines(path, text))


def _lookup(path: Path, encoding: str | None) -> str | None:
    if encoding is None:
        return None
    try:
        codecs.getincrementaldecoder(encoding)(errors="replace").decode(b"\xff;1\n" + encoding.encode(encoding), True)
        return codecs.lookup(encoding).name
    except (LookupError, ValueError, AssertionError):  # unknown, or not an encoding of text, such as base64
        remedy = "use utf-8, utf-16, latin-1 or cp1252, or remove the key"
        raise InputError(Finding(str(path), "unknown encoding", repr(encoding), remedy)) from None


@contextmanager
def _open(path: Path) -> Iterator[BinaryIO]:
    try:
        raw = open_regular(path)
    except FileNotFoundError:
        raise InputError(
            Finding(str(path), "no such file", remedy=remedy_for_missing_file(path, "check its name"))
        ) from None
    except IsADirectoryError:
        raise folder_error(path) from None
    except OSError as error:
        raise unreadable(path, error) from None
    with raw:
        packed = raw.read(2) == b"\x1f\x8b"
        raw.seek(0)
        yield cast(BinaryIO, gzip.GzipFile(fileobj=raw)) if packed else raw


def _chunks(path: Path, stream: BinaryIO, size: int) -> Iterator[bytes]:
    done, most = 0, max(_MOST_UNPACKED, _MOST_RATIO * _size(path))
    while True:
        try:
            chunk = stream.read(size)
        except (EOFError, zlib.error, gzip.BadGzipFile):
            what = f"the gzip file is damaged or incomplete after {done} unpacked bytes"
            raise InputError(Finding(str(path), what, remedy="copy or export the file again")) from None
        except OSError as error:
            raise unreadable(path, error) from None
        if not chunk:
            return
        done += len(chunk)
        if done > most:
            what = f"the gzip file unpacks to more than {_MOST_RATIO} times its size: it is not a log"
            raise InputError(Finding(str(path), what, remedy="unpack it and look at its content"))
        yield chunk


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except (OSError, ValueError):
        return 0


def _sniff(path: Path, first: bytes, known: str | None) -> tuple[str, int]:
    """The encoding, and the length of the byte order mark."""
    for mark, name in (
        (codecs.BOM_UTF8, "utf-8"),
        (codecs.BOM_UTF32_LE, "utf-32-le"),
        (codecs.BOM_UTF32_BE, "utf-32-be"),
        (codecs.BOM_UTF16_LE, "utf-16-le"),
        (codecs.BOM_UTF16_BE, "utf-16-be"),
    ):
        if first.startswith(mark):
            return name, len(mark)
    if known is not None:
        return ("utf-16-le" if known == "utf-16" else known), 0
    head = first[: 1 << 16]
    for magic, what in _FORMATS.items():
        if head.startswith(magic):
            remedy = _REMEDIES.get(what, "export the channels as CSV")
            raise InputError(Finding(str(path), f"is {what}, not a text log", remedy=remedy))
    for begin, what, remedy in _TEXTS:
        if re.match(begin, head):
            raise InputError(Finding(str(path), f"is {what}", remedy=remedy))
    nuls = head.count(0)
    if nuls > 0.2 * len(head):
        half = len(head) // 2
        if head[1::2].count(0) > 0.8 * half and head[::2].count(0) < 0.05 * half:
            return "utf-16-le", 0
        if head[::2].count(0) > 0.8 * half and head[1::2].count(0) < 0.05 * half:
            return "utf-16-be", 0
    head = head.rstrip(b"\0")  # a logger that lost power leaves the space that it had reserved
    odd = len(head) - len(head.translate(None, bytes(range(9)) + bytes(range(14, 26)) + bytes(range(27, 32)) + b"\x7f"))
    if odd > 0.01 * len(head):
        raise InputError(Finding(str(path), "is not a text file", remedy="export the channels as CSV"))
    for name in ("utf-8", *_WORDS_OF, "cp1252"):
        try:
            text = codecs.getincrementaldecoder(name)().decode(head)
        except UnicodeDecodeError:
            continue
        if name not in _WORDS_OF or re.search(_WORDS_OF[name], text):
            return name, 0
    return "iso8859-1", 0


def _joined(first: bytes, rest: Iterator[bytes]) -> Iterator[bytes]:
    yield first
    yield from rest


def _transcoded(chunks: Iterator[bytes], encoding: str) -> Iterator[bytes]:
    decoder = codecs.getincrementaldecoder(encoding)(errors="replace")
    for chunk in chunks:
        yield decoder.decode(chunk).encode("utf-8", errors="replace")
    yield decoder.decode(b"", final=True).encode("utf-8", errors="replace")


def _whole_lines(path: Path, chunks: Iterator[bytes]) -> Iterator[bytes]:
    """Blocks cut at line ends; only the last may end without one."""
    rest = b""
    for chunk in chunks:
        rest += chunk
        cut = rest.rfind(b"\n") + 1
        if not cut and len(rest) > BLOCK // 2:  # a file with CR alone as line end
            cut = rest.rfind(b"\r", 0, len(rest) - 1) + 1
        if cut:
            yield rest[:cut]
            rest = rest[cut:]
        elif len(rest) > _LONGEST_LINE:
            raise InputError(Finding(str(path), "has no line ends: not a text log", remedy="export it as CSV"))
    if rest:
        yield rest

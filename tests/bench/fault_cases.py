"""The cases of ``tests.bench.faults``: what each changes, and what the program must answer."""

from __future__ import annotations

import gzip
import json
import os
import re
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tests.bench.fault_files import PLAIN, edited, edited_known, replaced, swapped_units, with_quotes

ROOT = Path(__file__).resolve().parent.parent.parent
ROOT_PAGES = Path(tempfile.gettempdir()) / f"vdyn-faults-{os.getpid()}"  # a pipeline that nothing has disturbed
Prepare = Callable[[Path], None]


@dataclass(frozen=True)
class Case:
    """One fault.

    Parameters
    ----------
    group : the class of faults. name : what is wrong.
    prepare : changes the folder, which holds ``configs`` and ``sample_logs``.
    command : arguments of ``vdyn``, in ``configs``; or a line for the shell, in which VDYN stands for the program.
    code, says : expected exit code, and an expression in what is printed.
    after : raises AssertionError where the folder is not as it should be afterwards.
    """

    group: str
    name: str
    prepare: Prepare
    command: Sequence[str] | str
    code: int
    says: str = ""
    environment: Mapping[str, str] = field(default_factory=dict)
    after: Callable[[Path], None] = lambda folder: None


def nothing(folder: Path) -> None:
    """The samples as they are."""


def text_edit(name: str, old: str, new: str) -> Prepare:
    """Replace a text that a file must hold."""
    return lambda folder: edited(folder / name, old, new)


def step(name: str, *more: str) -> list[str]:
    return [name, f"{name}.yaml", "-o", "../out", "--no-diagnose", *more]


def _quantities() -> Iterator[Case]:
    group = "units and quantities"
    wrong = {
        "9**(9**9) kg": "not a unit",
        "1 9**(9**9)": "not a unit",
        "1 ((kg**9)**9)**9": "not a unit",
        "1 9⁹⁹⁹⁹⁹⁹": "not a unit",
        "1.5 ton": "ambiguous",
        "1500 +- 1e999 kg": "not a finite number",
        ".inf": "not a finite number",
        ".nan": "not a finite number",
        "1e999": "not a finite number",
        "9" * 4000: "not a finite number",
        "'" + "9" * 500_000 + " kg'": "not a number with a unit",
        "'1 kg" + " " * 500_000 + "'": "not a number with a unit",
        "1500 m": "not a unit of mass",
    }
    for text, says in wrong.items():
        change = text_edit("configs/vehicle.yaml", "mass: 1588 +- 2 kg", f"mass: {text}")
        yield Case(group, f"mass: {text[:30]}", change, step("cg"), 2, says)
    for key in ("from_time", "to_time"):
        for value in (".inf", ".nan", "1e300"):
            change = text_edit("configs/cg.yaml", "launch_1.csv, direction", f"launch_1.csv, {key}: {value}, direction")
            code = 0 if (key, value) == ("to_time", "1e300") else 2
            yield Case(group, f"{key}: {value}", change, step("cg", "-q"), code)
    yield Case(group, "start: 1e300 s", text_edit("configs/coastdown.yaml", "start: 0 s", "start: 1e300 s"),
               step("coastdown", "-q"), 2)  # fmt: skip


def _known() -> Iterator[Case]:
    group = "parameter files of users"
    wrong: dict[str, tuple[dict[str, Any], str]] = {
        "drag area in ft^2 is converted": ({"drag_area": (6.0, "ft^2")}, ""),
        "mass in lb is converted": ({"mass": (3501, "lb")}, ""),
        "drag area in m": ({"drag_area": (6.0, "m")}, "not a unit of area"),
        "drag area -5": ({"drag_area": (-5, "m^2")}, "lies outside"),
        "inertia -5": ({"wheel_inertia": (-5, "kg m^2")}, "lies outside"),
        "radius 0": ({"wheel_radius": (0.0, "m")}, "lies outside"),
        "NaN": ({"wheel_radius": (float("nan"), "m")}, "not finite"),
        "1e999": ({"wheel_radius": (1e999, "m")}, "not finite"),
        "text": ({"wheel_radius": ("0.3", "m")}, "has no number as value"),
        "null": ({"wheel_radius": (None, "m")}, "has no number as value"),
        "correlation abc": ({"correlation": "abc"}, "not a mapping"),
        "extensions abc": ({"extensions": "abc"}, "not a mapping"),
        "newline in a name": ({"a\nb": (1.0, "")}, "has an invalid name"),
    }
    for name, (changes, says) in wrong.items():
        change = edited_known(changes)
        known, export = ("--known", "../known.json"), ["export", "../known.json", "--to", "mat", "-o", "../out"]
        yield Case(group, f"--known: {name}", change, step("tire", *known), 2 if says else 0, says)
        yield Case(group, f"export: {name}", change, export, 2 if says else 0, says)
    for name, text in (("deep nesting", "[" * 200_000), ("no JSON", "mass: 1"), ("empty", ""), ("no UTF-8", "\udcff")):
        change = replaced("known.json", text.encode("utf-8", "surrogateescape"))
        yield Case(group, f"--known: {name}", change, step("tire", "--known", "../known.json"), 2, "is not JSON")


def _copies() -> Iterator[Case]:
    group = "one log counted twice"

    def copied(name: str, make: Callable[[Path, Path], object], line: str) -> Case:
        def change(folder: Path) -> None:
            make(folder / "sample_logs" / "launch_1.csv", folder / "sample_logs" / "again")
            edited(folder / "configs" / "cg.yaml", "../sample_logs/launch_2.csv", line)

        return Case(group, name, change, step("cg"), 2, "same samples|listed twice|samples in common")

    yield copied("another spelling", lambda a, b: None, "../sample_logs/./launch_1.csv")
    yield copied("a byte copy", shutil.copy, "../sample_logs/again")
    yield copied("a link", lambda a, b: b.symlink_to(a), "../sample_logs/again")
    yield copied("packed", lambda a, b: b.write_bytes(gzip.compress(a.read_bytes())), "../sample_logs/again")
    yield copied("blank lines added", lambda a, b: b.write_bytes(a.read_bytes() + b"\n\n"), "../sample_logs/again")
    yield copied("its second half", _second_half, "../sample_logs/again")


def _second_half(source: Path, target: Path) -> None:
    head, *rows = source.read_bytes().splitlines(keepends=True)
    target.write_bytes(head + b"".join(rows[len(rows) // 2 :]))


def _geometry() -> Iterator[Case]:
    group = "contradicting sizes"
    yield Case(group, "box twice as wide", text_edit("configs/area.yaml", "1.745 +-", "3.490 +-"), step("area"), 2,
               "pixels are square")  # fmt: skip
    yield Case(group, "box 5 % too wide", text_edit("configs/area.yaml", "1.745 +-", "1.832 +-"), step("area"), 0,
               "scales across and down differ")  # fmt: skip
    drawn = text_edit("configs/shaft.yaml", "outer_diameter: 36.00", "outer_diameter: 38.40")
    yield Case(group, "drawing 12 % too stiff", drawn, ["shaft", "shaft.yaml", "-o", "../out"], 0,
               "error of the drawing of this size looks the same")  # fmt: skip


def _endless() -> Iterator[Case]:
    group = "inputs without end"
    for name, make in (
        ("pipe", lambda path: os.mkfifo(path)),
        ("device", lambda path: path.symlink_to("/dev/zero")),
        ("folder", lambda path: path.mkdir()),
        ("loop", lambda path: path.symlink_to(path)),
        ("gzip of blank lines", lambda path: path.write_bytes(gzip.compress(b"a,b\n1,2\n" + b"\n" * (200 << 20)))),
        ("a line of 100 MB", lambda path: path.write_bytes(b"9" * (100 << 20))),
    ):
        for file, command in (("sample_logs/launch_1.csv", step("cg")), ("configs/cg.yaml", step("cg"))):
            if "gzip" in name and file.startswith("configs"):
                continue

            def change(folder: Path, file: str = file, make: Callable[[Path], object] = make) -> None:
                (folder / file).unlink()
                make(folder / file)

            yield Case(group, f"{Path(file).name} is a {name}", change, command, 2)
    picture = replaced("sample_logs/silhouette.png", None)
    yield Case(group, "picture is a pipe", lambda f: (picture(f), os.mkfifo(f / "sample_logs/silhouette.png"))[0],
               step("area"), 2)  # fmt: skip


def _cells() -> Iterator[Case]:
    group = "cells and headers"
    million = b"9" * 1_000_000
    for name, row, code in (
        ("a million digits", b"9999," + million + b"\n", None),
        ("a million digits and a letter as time", million + b"x,1\n9999,1\n", 2),
        ("a million blanks", b"9999," + b" " * 1_000_000 + b"\n", None),
        ("a million commas", b"9999" + b"," * 1_000_000 + b"\n", None),
    ):
        change = _appended(row)
        yield Case(group, name, change, [*step("cg"), "-q"], 2 if code == 2 else -1)
    yield Case(group, "stray quote in the header", with_quotes(1), step("cg"), 2, "stray|remove")
    yield Case(group, "two stray quotes", with_quotes(2), step("cg"), 2, "stray|remove")
    units = swapped_units("9**(9**9)")
    yield Case(group, "tower in the units row", units, step("cg", "-q"), -1)


def _appended(row: bytes) -> Prepare:
    def change(folder: Path) -> None:
        path = folder / "sample_logs" / "launch_1.csv"
        path.write_bytes(path.read_bytes() + row)

    return change


def _clocks() -> Iterator[Case]:
    group = "clock in another unit"
    for name in ("cg", "coastdown", "inertia", "tire", "shaft"):
        for unit in ("min", "ms", "us", "h"):

            def change(folder: Path, name: str = name, unit: str = unit) -> None:
                path = folder / "configs" / f"{name}.yaml"
                text = path.read_text(encoding="utf-8")
                path.write_text(re.sub(r"(time: *\{.*unit: *)s\b", rf"\g<1>{unit}", text, count=1), encoding="utf-8")

            yield Case(group, f"{name}: {unit}", change, [name, f"{name}.yaml", "-o", "../out", "-q"], 2, "time")


def _surroundings() -> Iterator[Case]:
    group = "streams, names, settings of others"
    area = "VDYN area area.yaml -o"
    yield Case(group, "stdout full", nothing, f"{area} - > /dev/full", 2, "stdout: cannot be written")
    yield Case(group, "stdout closed", nothing, f"{area} - >&-", 2, "stdout")
    yield Case(group, "stdout full, listing", nothing, "VDYN list > /dev/full", 2, "stdout")
    yield Case(group, "reader of stdout has ended", nothing, "VDYN explain policy | true", 0)
    yield Case(group, "stderr closed", nothing, f"{area} ../out 2>&-", 0)
    yield Case(group, "stderr full", nothing, f"{area} ../out 2>/dev/full", 0)
    yield Case(group, "stdout in ASCII", nothing, f"PYTHONIOENCODING=ascii {area} - > /dev/null", 0)
    yield Case(group, "no home, no temporary folder", nothing, f"{area} ../out", 0, "",
               {"HOME": "/nowhere", "TMPDIR": "/nowhere", "XDG_CACHE_HOME": "/nowhere"})  # fmt: skip
    for name, content in (("damaged", b"nonsense: [\n\xff"), ("of large letters", b"font.size: 99\n")):
        change = replaced("configs/matplotlibrc", content)
        yield Case(group, f"a matplotlibrc {name}", change, ["area", "area.yaml", "-o", "../out"], 0, after=_same_page)
    for name, text in (("NUL", "a\\0b.png"), ("lone surrogate", "a\\ud800b.png"), ("5000 letters", "x" * 5000)):
        change = text_edit("configs/area.yaml", "image: ../sample_logs/silhouette.png", f'image: "{text}"')
        yield Case(group, f"path with {name}", change, step("area"), 2)
    for name, text in (("escape sequence", "a\\e[31mb"), ("lone surrogate", "a\\ud800b"), ("newline", "a\\nb")):
        change = text_edit("configs/area.yaml", "title: Frontal area from a silhouette", f'title: "{text}"')
        yield Case(group, f"title with {name}", change, step("area"), 0, after=_no_escape)
    latin = "caf\udce9.yaml"
    yield Case(group, "description's name in Latin-1",
               lambda f: shutil.copy(f / "configs/area.yaml", f / "configs" / latin) and None,
               ["area", latin, "-o", "../out"], 0)  # fmt: skip
    yield Case(group, "header with escape sequences", with_quotes(0), step("cg"), 2, after=_no_escape)
    yield Case(group, "output folder is a file", replaced("out", b"x"), step("area"), 2, "is a file, not a folder")


def _same_page(folder: Path) -> None:
    plain = (ROOT_PAGES / "area.html").read_bytes()
    assert (folder / "out" / "area.html").read_bytes() == plain, "another page"


def _no_escape(folder: Path) -> None:
    assert b"\x1b" not in (folder / "stderr").read_bytes(), "escape sequence on the terminal"


def _injection() -> Iterator[Case]:
    group = "text that becomes lines"

    def change(folder: Path) -> None:
        edited_known(PLAIN)(folder)
        path = folder / "known.json"
        document = json.loads(path.read_text(encoding="utf-8"))
        document["title"] = "a car\n[MODEL]\nPCX1 = 9"
        for entry in document["parameters"].values():
            entry["source"] = "given\nPCX1 = 9 $ */"
        path.unlink()
        (folder / "k\nPCX1 = 9.json").write_text(json.dumps(document), encoding="utf-8")

    def after(folder: Path) -> None:
        for path in (folder / "out").glob("*.*"):
            assert not re.search(rb"^PCX1 = 9", path.read_bytes(), flags=re.M), f"injected into {path.suffix}"

    for form in ("tir", "c", "abc"):
        arguments = ["export", "../k\nPCX1 = 9.json", "--to", form, "-o", "../out"]
        yield Case(group, f"source, title and file name into {form}", change, arguments, -1, after=after)


def _results() -> Iterator[Case]:
    group = "results in the folder edited or mixed"
    edits = {
        "area.json": ('"value": 2.1', '"value": 3.1'),
        "area.html": ("</body>", "<script>alert(1)</script></body>"),
        ".sections/area.html": ("</section>", "<script>alert(1)</script></section>"),
    }
    for name, (old, new) in edits.items():
        yield Case(group, f"{name}: a value or a script", _after_pipeline(text_edit(f"out/{name}", old, new)),
                   ["pipeline", "small.yaml", "-o", "../out"], 0, "done", after=_as_first)  # fmt: skip
    for name, content in (
        ("null", b"null"),
        ("nested", b"[" * 100_000),
        ("cut", b'{"format": "vdyn/par'),
        ("no", None),
    ):
        yield Case(group, f"area.json: {name}", _after_pipeline(replaced("out/area.json", content)),
                   ["pipeline", "small.yaml", "-o", "../out"], 0, "done", after=_as_first)  # fmt: skip
    yield Case(group, "left temporary files", _after_pipeline(replaced("out/.area.html.x.vdyn-tmp", b"half")),
               ["pipeline", "small.yaml", "-o", "../out"], 0, "reused", after=_as_first)  # fmt: skip
    both = "VDYN pipeline small.yaml -o ../out & VDYN pipeline small.yaml -o ../out; a=$?; wait $!; b=$?; exit $((a+b))"
    yield Case(group, "two pipelines in one folder", small, both, 2, "another run of vdyn", after=_as_first)
    yield Case(group, "150 jobs for two steps", small, "VDYN pipeline small.yaml -o ../out --jobs 150", 0,
               after=_as_first)  # fmt: skip
    threads = {"OPENBLAS_NUM_THREADS": "4", "OMP_NUM_THREADS": "4"}
    yield Case(group, "other threads in the environment", small, "VDYN pipeline small.yaml -o ../out", 0, "", threads,
               _as_first)  # fmt: skip


def small(folder: Path) -> None:
    text = "pipeline: a day\nvehicle: vehicle.yaml\nsteps: [area.yaml, cg.yaml]\n"
    (folder / "configs" / "small.yaml").write_text(text, encoding="utf-8")


def _after_pipeline(change: Prepare) -> Prepare:
    def prepare(folder: Path) -> None:
        small(folder)
        shutil.copytree(ROOT_PAGES, folder / "out")
        change(folder)

    return prepare


def _as_first(folder: Path) -> None:
    made = {str(p.relative_to(folder / "out")): p.read_bytes() for p in (folder / "out").rglob("*") if p.is_file()}
    first = {str(p.relative_to(ROOT_PAGES)): p.read_bytes() for p in ROOT_PAGES.rglob("*") if p.is_file()}
    other = sorted(name for name in made.keys() | first.keys() if made.get(name) != first.get(name))
    assert not other, f"differs: {', '.join(other)}"


def _killed() -> Iterator[Case]:
    group = "processes ended"
    for number in (signal.SIGTERM, signal.SIGKILL, signal.SIGINT):
        for jobs in (1, 2):
            for delay in (0.5, 1.5, 3.0, 5.0):
                line = (
                    f"{sys.executable} -m tests.bench.fault_files {int(number)} {delay} pipeline small.yaml -o ../out "
                    f"--jobs {jobs}; VDYN pipeline small.yaml -o ../out"
                )
                yield Case(group, f"{number.name} after {delay} s, --jobs {jobs}, and again", small, line, 0,
                           after=_as_first)  # fmt: skip


CLASSES = (
    _quantities,
    _known,
    _copies,
    _geometry,
    _endless,
    _cells,
    _clocks,
    _surroundings,
    _injection,
    _results,
    _killed,
)

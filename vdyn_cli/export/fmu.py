"""The full vehicle as an FMU for co-simulation (FMI 2.0): description, source and, where a compiler exists, binary."""

from __future__ import annotations

import hashlib
import platform
import shutil
import struct
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from vdyn_cli.export import ExportedFiles, ExportOptions
from vdyn_cli.export.exported_vehicle import LONGEST_STEP, ExportedVehicle, exported_vehicle
from vdyn_cli.export.fmu_description import ScalarVariable, description
from vdyn_cli.export.fmu_source import source
from vdyn_cli.export.parameter_file import ParameterFile
from vdyn_cli.export.quantity_texts import OWN, comment

START = OWN["start_speed"]
EPOCH = (1980, 1, 1, 0, 0, 0)  # earliest time in a zip, for all files: the same parameters give the same bytes
# Platform names of FMI 2.0 by system and machine; file ending and compiler flags of a library there.
PLATFORMS: Mapping[tuple[str, str], tuple[str, str, tuple[str, ...]]] = {
    ("linux", "x86_64"): ("linux64", "so", ("-shared", "-fPIC")),
    ("darwin", "x86_64"): ("darwin64", "dylib", ("-dynamiclib",)),
    ("darwin", "arm64"): ("darwin64", "dylib", ("-dynamiclib", "-arch", "arm64", "-arch", "x86_64")),
    ("win32", "AMD64"): ("win64", "dll", ("-shared",)),
}


def made(parameter_file: ParameterFile, options: ExportOptions) -> ExportedFiles:
    """``<name>.fmu``.

    Inputs, parameters (including the start speed) and outputs have SI units, meaning and start values. A communication
    step is divided into steps of at most 1 ms; within it, inputs follow the derivatives that the importer sets, zero by
    default. The target needs no Python, and no library except libm.

    Raises
    ------
    InputError : parameters are missing and have no default.
    """
    car = exported_vehicle(parameter_file, options.driven, options.differential)
    name, title = options.name, f"{parameter_file.title} ({parameter_file.name})"
    program = car.program(name, title)
    variables = _variables(car)
    wrapper = source(program, [v.name for v in variables], LONGEST_STEP)
    sources = {f"{name}.h": program.header, f"{name}.c": program.source, f"{name}_fmi2.c": wrapper}
    guid = _guid(sources)
    sources[f"{name}_fmi2.c"] = wrapper.replace("@GUID@", guid)
    compiled = [file for file in sources if file.endswith(".c")]
    files = {f"sources/{file}": text.encode() for file, text in sources.items()}
    files["modelDescription.xml"] = description(name, title, guid, variables, compiled, LONGEST_STEP)
    binary, note = _binary(name, sources)
    return ExportedFiles({f"{name}.fmu": _zip({**files, **binary})}, (*car.notes, note))


def _variables(car: ExportedVehicle) -> tuple[ScalarVariable, ...]:
    """The variables of the FMU, in the order of their value references."""
    q = car.quantities
    return (
        ScalarVariable(START.name, START.unit, comment(START), "parameter", 0.0),
        *(ScalarVariable(n, q[n].unit, comment(q[n]), "parameter", car.values[n]) for n in car.graph.constants),
        *(ScalarVariable(n, q[n].unit, comment(q[n]), "input", 0.0) for n in car.graph.inputs),
        *(ScalarVariable(n, q[n].unit, comment(q[n]), "output") for n in car.graph.outputs),
    )


def _guid(sources: Mapping[str, str]) -> str:
    digest = hashlib.sha256("".join(f"{n}\n{t}" for n, t in sources.items()).encode()).hexdigest()
    return f"{{{digest[:8]}-{digest[8:12]}-{digest[12:16]}-{digest[16:20]}-{digest[20:32]}}}"


def _binary(name: str, sources: Mapping[str, str]) -> tuple[dict[str, bytes], str]:
    """The library for this platform, empty if it cannot be compiled, and a note for the console."""
    compiler = next((path for path in map(shutil.which, ("cc", "gcc", "clang")) if path), None)
    place = PLATFORMS.get((sys.platform, platform.machine())) if struct.calcsize("P") == 8 else None
    if compiler is None or place is None:
        why = "no C compiler found" if compiler is None else "FMI 2.0 has no name for this platform"
        return {}, f"source code only ({why}): the importing program compiles it, or 'fmpy compile {name}.fmu'"
    folder, ending, flags = place
    with tempfile.TemporaryDirectory() as scratch:
        for file, text in sources.items():
            (Path(scratch) / file).write_text(text, encoding="utf-8")
        target = f"{name}.{ending}"
        inputs = [file for file in sources if file.endswith(".c")]
        command = [compiler, "-std=c99", "-O2", *flags, *inputs, "-o", target, "-lm"]
        done = subprocess.run(command, cwd=scratch, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            why = (done.stderr.strip().splitlines() or ["no message"])[0]
            return {}, f"source code only: {compiler} failed ({why})"
        return {f"binaries/{folder}/{target}": (Path(scratch) / target).read_bytes()}, f"compiled for {folder}"


def _zip(files: Mapping[str, bytes]) -> bytes:
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file, data in sorted(files.items(), key=lambda item: (item[0] != "modelDescription.xml", item[0])):
            entry = zipfile.ZipInfo(file, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    return packed.getvalue()

"""Write every sample log: ``python -m tests.plant.write sample_logs``; the same bytes each time."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from pathlib import Path

import tests.plant
from tests.plant import sample
from tests.plant.sample import Samples

HEAD = """# Sample logs

**Everything in this folder is synthetic.** No car was driven: the logs come from an independent simulation
(`tests/plant`), which shares no equations with the program, with gusts, sensor noise, rounding, clock jitter, latency
and load-cell zeros like those of a real test day. They show which logs the program reads, and whether its estimates
agree with the true values below.

Made by `python -m tests.plant.write sample_logs` from the top of the repository; the same bytes each time.

Conventions: x forward, z up; pitch is nose-up positive; loads are between tire and road, positive in compression;
driving torque and uphill grade are positive; each column's header states its unit. Air: {temperature:.0f}
degC, {pressure:.1f} kPa, {density} kg/m^3.
"""


def every_sample() -> list[Samples]:
    """The samples of each module of this package that offers ``samples()``, in the order of their names."""
    names = sorted(module.name for module in pkgutil.iter_modules(tests.plant.__path__))
    modules = [importlib.import_module(f"tests.plant.{name}") for name in names if name != "write"]
    return [module.samples() for module in modules if hasattr(module, "samples")]


def readme(samples: list[Samples]) -> str:
    parts = [HEAD.format(temperature=sample.TEMPERATURE, pressure=sample.PRESSURE / 1e3, density=sample.AIR_DENSITY)]
    for part in samples:
        rows = "\n".join(f"| {name} | {value:.6g} |" for name, value in part.truth.items())
        files = ", ".join(f"`{name}`" for name in part.files)
        parts.append(f"## {part.title}\n\n{files}\n\n{part.about}\n\n| truth (SI) | value |\n|---|---|\n{rows}\n")
    return "\n".join(parts)


def main(folder: Path) -> None:
    samples = every_sample()
    files = {name: content for part in samples for name, content in part.files.items()}
    files["README.md"] = readme(samples).encode()
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / name).write_bytes(content)
    print(f"{len(files)} files, {sum(map(len, files.values())) / 1e6:.1f} MB in {folder}")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: python -m tests.plant.write FOLDER")
    main(Path(sys.argv[1]))

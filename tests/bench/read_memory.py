"""How much memory and time reading a large log takes: ``python -m tests.bench.read_memory [rows] [mapped ...]``.

Writes a file of 40 columns into a temporary folder, reads it in a fresh process for each number of mapped columns, and
prints the peak of resident memory above that of the idle process, as a multiple of the mapped columns.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

COLUMNS = 40
LIMIT = 3.0


def write(path: Path, rows: int) -> None:
    """A log at 1 kHz: a clock, and 39 noisy channels whose values repeat every 10 000 rows."""
    rng = np.random.default_rng(1)
    tails = [",".join(f"{x:.4g}" for x in row) for row in rng.normal(size=(10_000, COLUMNS - 1))]
    with path.open("w") as file:
        file.write(",".join(["time [s]", *(f"channel {i} [m/s]" for i in range(1, COLUMNS))]) + "\n")
        for first in range(0, rows, len(tails)):
            part = tails[: min(len(tails), rows - first)]
            file.writelines(f"{(first + i) / 1000:.3f},{tail}\n" for i, tail in enumerate(part))


def read(path: Path, mapped: int) -> dict[str, float]:
    """Peak memory and time of one reading, in this process."""
    import pandas  # noqa: F401  (its own memory is not the log's)

    from vdyn_cli.io.formats.log_formats import read_log
    from vdyn_cli.io.reader import Column
    from vdyn_cli.quantities.quantity import to_si

    to_si(1.0, "m/s", "m/s")
    columns = {"time": Column("time [s]", "s", "s")}
    columns |= {f"c{i}": Column(f"channel {i} [m/s]", "km/h", "m/s") for i in range(1, mapped)}
    idle, start = _peak(), time.perf_counter()
    log = read_log(path, columns)
    seconds = time.perf_counter() - start
    size = log.time.nbytes * mapped
    return {"rows": log.time.size, "mapped_mb": size / 1e6, "ratio": (_peak() - idle) / size, "seconds": seconds}


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["--read"]:
        print(json.dumps(read(Path(arguments[1]), int(arguments[2]))))
        return 0
    rows = int(arguments[0]) if arguments else 2_000_000
    worst = 0.0
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "large.csv"
        write(path, rows)
        print(f"{rows} rows of {COLUMNS} columns, {path.stat().st_size / 1e9:.2f} GB")
        for mapped in [int(a) for a in arguments[1:]] or [2, 4, 8, 20]:
            command = [sys.executable, "-m", "tests.bench.read_memory", "--read", str(path), str(mapped)]
            result = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
            worst = max(worst, result["ratio"])
            print(f"{mapped:3d} mapped: {result['mapped_mb']:7.1f} MB kept, peak {result['ratio']:.2f} x that, "
                  f"{result['seconds']:.1f} s")  # fmt: skip
    print(f"worst {worst:.2f} x, allowed {LIMIT} x: {'good' if worst <= LIMIT else 'TOO MUCH'}")
    return 0 if worst <= LIMIT else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

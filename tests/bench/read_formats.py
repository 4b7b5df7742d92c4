"""Memory and time of reading large MDF 4, Parquet and CSV logs.

``python -m tests.bench.read_formats [MB] [-o FILE.md]`` writes a measurement of 200 channels at mixed
rates (1 kHz, 100 Hz, 10 Hz), plain and compressed, a Parquet table of
40 columns, and a CSV of 10 columns. Their channels are read in fresh processes: by ``read_log``, with all its checks,
and by the library alone (``MDF.select``, ``read_table``, ``pandas.read_csv(engine="pyarrow")``). Memory is the peak
above that of the process before reading, as a multiple of the log that is returned; times are processor time, all
threads together, and in brackets the time that passes; the best of three. One file exists at a time.
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

RATES = {1000: 20, 100: 80, 10: 100}  # Hz: channels
MAPPED = {1000: 8, 100: 4, 10: 2}
SLOW = {100: 8, 10: 8}  # a log at 100 Hz, and slower channels
MOST_MEMORY, MOST_TIME = 2.0, 1.5
LARGE = 20.0  # MB; beside a smaller log, what the libraries keep for themselves counts
REPEATS = 3


def write_mdf(path: Path, megabytes: float, compressed: bool) -> None:
    """A measurement of about a size, before compression."""
    from asammdf import MDF, Signal

    rng = np.random.default_rng(1)
    seconds = megabytes * 1e6 / sum(rate * (8 + 8 * n) for rate, n in RATES.items())
    file = MDF(version="4.10")
    for k, (rate, count) in enumerate(RATES.items()):
        clock = np.arange(int(rate * seconds)) / rate + 0.0003 * k
        signals = [
            Signal(np.round(rng.normal(size=clock.size), 4), clock, unit="m/s", name=f"c{rate}_{i}")
            for i in range(count)
        ]
        file.append(signals, acq_name=f"{rate} Hz")
    file.save(path, overwrite=True, compression=2 if compressed else 0)
    file.close()


def write_parquet(path: Path, megabytes: float) -> None:
    """A table of 40 columns at 1 kHz."""
    import pyarrow as pa
    from pyarrow import parquet

    rng = np.random.default_rng(1)
    rows = int(megabytes * 1e6 / 8 / 40)
    columns = {"time": np.arange(rows) / 1000.0}
    columns |= {f"c1000_{i}": np.round(rng.normal(size=rows), 4) for i in range(39)}
    parquet.write_table(pa.table(columns), path)


def write_csv(path: Path, megabytes: float) -> None:
    """A table of 10 columns at 1 kHz; 10 million rows for 800 MB of numbers."""
    rng = np.random.default_rng(1)
    rows = int(megabytes * 1e6 / 8 / 10)
    tails = [",".join(f"{x:.4f}" for x in row) for row in rng.normal(size=(10_000, 9))]
    with path.open("w") as file:
        file.write(",".join(["time", *(f"c1000_{i}" for i in range(9))]) + "\n")
        for first in range(0, rows, len(tails)):
            part = tails[: min(len(tails), rows - first)]
            file.writelines(f"{(first + i) / 1000:.3f},{tail}\n" for i, tail in enumerate(part))


WRITE = {
    "plain.mf4": lambda path, size: write_mdf(path, size, False),
    "packed.mf4": lambda path, size: write_mdf(path, size, True),
    "table.parquet": write_parquet,
    "table.csv": lambda path, size: write_csv(path, 0.8 * size),
}


def read(path: Path, mapped: dict[int, int], by: str) -> dict[str, float]:
    """Time and peak memory of one reading, in this process."""
    names = [f"c{rate}_{i}" for rate, count in mapped.items() for i in range(count)]
    if path.suffix == ".mf4":
        import asammdf
    elif path.suffix == ".csv":
        import pandas as pd
        import pyarrow.csv  # noqa: F401  (what the engine imports is not its time of reading)
    else:
        from pyarrow import parquet
    from vdyn_cli.io.formats.log_formats import read_log
    from vdyn_cli.io.reader import Column
    from vdyn_cli.quantities.quantity import to_si

    to_si(1.0, "m/s", "m/s")
    mapping = {"time": Column("time", "s", "s")} | {n: Column(n, "m/s", "m/s") for n in names}
    idle, start, begin = _peak(), time.process_time(), time.perf_counter()
    size = 0
    if by == "vdyn":
        log = read_log(path, mapping)
        size = log.time.nbytes * (1 + len(log.channels))
    elif path.suffix == ".mf4":
        signals = asammdf.MDF(path).select(names)
        size = sum(s.samples.nbytes for s in signals)
    elif path.suffix == ".csv":
        size = pd.read_csv(path, usecols=["time", *names], engine="pyarrow").to_numpy().nbytes
    else:
        size = parquet.read_table(path, columns=["time", *names]).to_pandas().to_numpy().nbytes
    passed = time.perf_counter() - begin
    used = time.process_time() - start
    return {"seconds": used, "passed": passed, "megabytes": size / 1e6, "peak": (_peak() - idle) / 1e6}


def _peak() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024.0


def measured(path: Path, mapped: dict[int, int], by: str) -> dict[str, float]:
    """The best of several readings, each in a process of its own."""
    command = [sys.executable, "-m", "tests.bench.read_formats", "--read", str(path), json.dumps(mapped), by]
    runs = [
        json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()[-1])
        for _ in range(REPEATS)  # a library may print, too
    ]
    return {key: min(run[key] for run in runs) for key in runs[0]}


def main(arguments: list[str]) -> int:
    if arguments[:1] == ["--write"]:  # in a process of its own: a child begins with the peak memory of its parent
        path = Path(arguments[1])
        WRITE[path.name](path, float(arguments[2]))
        return 0
    if arguments[:1] == ["--read"]:
        mapped = {int(rate): count for rate, count in json.loads(arguments[2]).items()}
        print(json.dumps(read(Path(arguments[1]), mapped, arguments[3])))
        return 0
    output = Path(arguments[arguments.index("-o") + 1]) if "-o" in arguments else None
    megabytes = float(arguments[0]) if arguments and arguments[0] != "-o" else 100.0
    lines = [
        f"# Reading large logs ({megabytes:g} MB before compression)",
        "",
        "Written by `python -m tests.bench.read_formats`. The library alone returns what the file holds; vdyn checks",
        "every channel and puts those of other rates on one clock. Limits: memory at most "
        f"{MOST_MEMORY:g} x the log (MDF above {LARGE:g} MB),",
        f"processor time at most {MOST_TIME:g} x the library's.",
        "",
        "| file | channels read | log, MB | peak, x log | vdyn, CPU s | library, CPU s | ratio |",
        "|---|---|---|---|---|---|---|",
    ]
    good = True
    with tempfile.TemporaryDirectory() as folder:
        cases = [
            ("MDF 4", "plain.mf4", MAPPED),
            ("MDF 4", "plain.mf4", SLOW),
            ("MDF 4, compressed", "packed.mf4", MAPPED),
        ]
        cases += [("Parquet", "table.parquet", {1000: 10}), ("CSV", "table.csv", {1000: 9})]
        for kind, name, mapped in cases:
            if not (Path(folder) / name).exists():
                for old in Path(folder).iterdir():
                    old.unlink()
                command = [sys.executable, "-m", "tests.bench.read_formats", "--write", f"{folder}/{name}"]
                subprocess.run([*command, str(megabytes)], check=True)
            ours, theirs = (measured(Path(folder) / name, mapped, by) for by in ("vdyn", "library"))
            memory, ratio = ours["peak"] / ours["megabytes"], ours["seconds"] / theirs["seconds"]
            large = ours["megabytes"] > LARGE
            good &= (memory <= MOST_MEMORY or not large or not kind.startswith("MDF")) and ratio <= MOST_TIME
            what = ", ".join(f"{n} at {rate} Hz" for rate, n in mapped.items())
            lines.append(
                f"| {kind} | {what} | {ours['megabytes']:.1f} | {memory:.2f} | {ours['seconds']:.2f} "
                f"({ours['passed']:.2f}) | {theirs['seconds']:.2f} ({theirs['passed']:.2f}) | {ratio:.2f} |"
            )
            print(lines[-1], file=sys.stderr)
    text = "\n".join(lines) + "\n"
    if output:
        output.write_text(text, encoding="utf-8")
    print(text)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

"""The road load for a dynamometer: A, B, C in pounds and miles per hour, F0, F1, F2 in newton and km/h."""

from __future__ import annotations

import csv
from io import StringIO

from vdyn_cli.export import ExportedFiles, ExportOptions
from vdyn_cli.export.parameter_file import ParameterFile, refuse_missing
from vdyn_cli.quantities.quantity import from_si

COLUMNS = ("coefficient", "value", "unit", "low95", "high95", "std", "source")
NAMES = ("road_load_f0", "road_load_f1", "road_load_f2")
# Coefficient, parameter, and the unit in which operators enter it.
ROWS = (
    ("A", "road_load_f0", "lbf"),
    ("B", "road_load_f1", "lbf/mph"),
    ("C", "road_load_f2", "lbf/mph^2"),
    ("F0", "road_load_f0", "N"),
    ("F1", "road_load_f1", "N/(km/h)"),
    ("F2", "road_load_f2", "N/(km/h)^2"),
    ("mass", "mass", "kg"),
    ("mass", "mass", "lb"),
)


def made(parameter_file: ParameterFile, options: ExportOptions) -> ExportedFiles:
    """``<name>_road_load.csv``: a row for each coefficient, with its 95 % interval, and the test mass.

    F = A + B v + C v^2 (v in mph, F in lbf) = F0 + F1 v + F2 v^2 (v in km/h, F in N), each interval for its
    coefficient alone; at reference conditions if the coast-down was corrected to them.

    Raises
    ------
    InputError : a coefficient is missing.
    """
    refuse_missing(parameter_file, NAMES, "a dynamometer")
    text = StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(COLUMNS)
    for coefficient, name, unit in ROWS:
        estimate = parameter_file.parameters.get(name)
        if estimate is None:
            continue
        numbers = (estimate.value, *estimate.interval95, estimate.std)
        value, low, high, std = (f"{from_si(x, unit, estimate.unit):.6g}" for x in numbers)
        table.writerow((coefficient, value, unit, low, high, std, estimate.source))
    return ExportedFiles({f"{options.name}_road_load.csv": text.getvalue().encode()})

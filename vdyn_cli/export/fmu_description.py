"""modelDescription.xml of FMI 2.0: the FMU's variables with units, causality and start values."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal
from xml.etree import ElementTree as Xml

# Exponents of the base units.
UNITS: Mapping[str, Mapping[str, int]] = {
    **{base: {base: 1} for base in ("kg", "m", "s", "K", "rad")},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
}


@dataclass(frozen=True)
class ScalarVariable:
    """One variable of the FMU; its value reference is its index in the list. Outputs have no start value."""

    name: str
    unit: str
    meaning: str
    causality: Literal["parameter", "input", "output"]
    start: float | None = None


def description(
    name: str, title: str, guid: str, variables: Sequence[ScalarVariable], sources: Iterable[str], step: float
) -> bytes:
    """The XML text of an FMU for co-simulation.

    Parameters
    ----------
    sources : names of the C files. step : s, default communication step.
    """
    root = Xml.Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=name,
        guid=guid,
        description=title,
        generationTool="vdyn",
        variableNamingConvention="flat",
    )
    unit = Xml.SubElement(
        root,
        "CoSimulation",
        modelIdentifier=name,
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="true",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
    )
    files = Xml.SubElement(unit, "SourceFiles")
    for file in sources:
        Xml.SubElement(files, "File", name=file)
    _units(root, {v.unit for v in variables if v.unit})
    Xml.SubElement(root, "DefaultExperiment", startTime="0.0", stepSize=repr(step))
    listed = Xml.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(variables):
        _variable(listed, reference, variable)
    structure = Xml.SubElement(root, "ModelStructure")
    for part in ("Outputs", "InitialUnknowns"):
        parent = Xml.SubElement(structure, part)
        for place, variable in enumerate(variables, 1):
            if variable.causality == "output":
                Xml.SubElement(parent, "Unknown", index=str(place))
    Xml.indent(root)
    text: bytes = Xml.tostring(root, encoding="UTF-8", xml_declaration=True)
    return text + b"\n"


def exponents(unit: str) -> dict[str, int]:
    """Exponents of the base units in a unit in the vocabulary's spelling, such as ``N s^2/m^2``.

    Raises
    ------
    ValueError : the unit contains one that is not in UNITS.
    """
    over, *under = unit.split("/")
    total: dict[str, int] = {}
    for part, sign in ((over, 1), *((u, -1) for u in under)):
        for factor in part.split():
            if factor == "1":
                continue
            match = re.fullmatch(r"([A-Za-z]+)(?:\^(\d+))?", factor)
            if match is None or match[1] not in UNITS:
                raise ValueError(f"FMI 2.0 base units are missing for the unit {unit!r}")
            for base, power in UNITS[match[1]].items():
                total[base] = total.get(base, 0) + sign * power * int(match[2] or 1)
    return {base: power for base, power in total.items() if power}


def _units(root: Xml.Element, units: Iterable[str]) -> None:
    listed = Xml.SubElement(root, "UnitDefinitions")
    for unit in sorted(units):
        entry = Xml.SubElement(listed, "Unit", name=unit)
        Xml.SubElement(entry, "BaseUnit", {base: str(power) for base, power in exponents(unit).items()})


def _variable(parent: Xml.Element, reference: int, variable: ScalarVariable) -> None:
    attributes = {"name": variable.name, "valueReference": str(reference), "description": variable.meaning}
    attributes["causality"] = variable.causality
    attributes["variability"] = "fixed" if variable.causality == "parameter" else "continuous"
    if variable.causality != "input":
        attributes["initial"] = "exact" if variable.causality == "parameter" else "calculated"
    number = {"unit": variable.unit} if variable.unit else {}
    if variable.start is not None:
        number["start"] = repr(variable.start)
    Xml.SubElement(Xml.SubElement(parent, "ScalarVariable", attributes), "Real", number)

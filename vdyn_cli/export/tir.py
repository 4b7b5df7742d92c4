"""The tire as a property file: the magic formula's coefficients with the names of Pacejka's 2002 version."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from vdyn_cli.export import ExportedFiles, ExportOptions
from vdyn_cli.export.parameter_file import ParameterFile, completed
from vdyn_cli.quantities.constants import GRAVITY, USUAL_WHEELS

NEEDED = (
    *("tire_B", "tire_C", "tire_D", "tire_E", "wheel_radius", "tire_vertical_stiffness", "mass"),
    *("tire_load_sensitivity", "tire_relaxation_length", "tire_vertical_damping", "rolling_resistance"),
)
SHIFTS = ("tire_Sh", "tire_Sv")  # 0 if not given
WIDTH, ASPECT = 0.195, 0.65  # m and 1, of a common passenger car tire
DEFLECTION_SHARE = 1 / 3  # unloaded minus effective rolling radius, as a share of the tire's deflection


@dataclass(frozen=True)
class _Line:
    key: str
    value: float | int | str
    why: str = ""

    def __str__(self) -> str:
        value = f"'{self.value}'" if isinstance(self.value, str) else f"{self.value!r}"
        return f"{self.key:<24} = {value:<24}" + (f" $ {self.why}" if self.why else "")


def made(parameter_file: ParameterFile, options: ExportOptions) -> ExportedFiles:
    """``<name>.tir``, for pure longitudinal slip (USE_MODE 1).

    With dfz = Fz / Fz0 - 1 and Fz0 a quarter of the weight::

        Cx = PCX1                      Fx = Dx sin(Cx atan(Bx k - Ex (Bx k - atan(Bx k))))
        Dx = (PDX1 + PDX2 dfz) Fz      PDX1 = D,      PDX2 = -D Fz0 (load sensitivity)
        Ex = PEX1                      PEX1 = E
        Kx = (PKX1 + PKX2 dfz) Fz      PKX1 = B C D,  PKX2 = B C PDX2,  Bx = Kx / (Cx Dx) = B
        SHx = PHX1 = Sh,  SVx = PVX1 Fz = Sv Fz
        sigma = R0 Fz / Fz0 PTX1 exp(PTX3 dfz)        PTX1 = sigma / R0, PTX3 = -1: constant to first order

    Assumes that the effective radius is a third of the tire's deflection below the unloaded one. The file says which
    values are measured and which are assumed. Source: Pacejka, Tire and Vehicle Dynamics, 3rd ed., 2012, section 4.3.2.

    Raises
    ------
    InputError : the tire's curve, radius, stiffness or the mass is missing.
    """
    values, assumed = completed(parameter_file, NEEDED, "a tire file")
    why = {name: _why(parameter_file, name, assumed) for name in NEEDED}
    shifts = {name: parameter_file.parameters.value(name, 0.0) for name in SHIFTS}
    values |= {**shifts, "wheels": parameter_file.parameters.value("wheels", USUAL_WHEELS)}
    why |= {n: _why(parameter_file, n, assumed) if n in parameter_file.parameters else "not fitted" for n in SHIFTS}
    sections = _sections(values, why, options)
    lines = [
        f"$ Tire of: {parameter_file.title} ({parameter_file.name})",
        "$ Only longitudinal slip was measured: USE_MODE = 1. Lateral coefficients are omitted.",
        "$ SI units; the slip is (omega R / V - 1); a driving force is positive.",
    ]
    for title, body in sections.items():
        lines += [f"$---------------------------------------------------------------- {title.lower()}", f"[{title}]"]
        lines += [str(line).rstrip() for line in body]
    return ExportedFiles(
        {f"{options.name}.tir": ("\n".join(lines) + "\n").encode()}, (*_notes(assumed), *_braking(parameter_file))
    )


def _notes(assumed: Mapping[str, str]) -> tuple[str, ...]:
    return tuple(f"assumed {name}: {why}" for name, why in assumed.items())


def _braking(parameter_file: ParameterFile) -> tuple[str, ...]:
    """A note on the braking coefficients, which the file has no keys for."""
    if "tire_D_brake" not in parameter_file.parameters:
        return ()
    value = parameter_file.parameters["tire_D_brake"].value
    return (f"left out tire_B_brake and tire_D_brake ({value:.4g}): a .tir file has one peak for driving and braking",)


def _why(parameter_file: ParameterFile, name: str, assumed: Mapping[str, str]) -> str:
    if name in assumed:
        return f"assumed: {assumed[name]}"
    estimate = parameter_file.parameters[name]
    spread = f" +- {estimate.std:.2g}" if estimate.std else ""
    return f"{name} {estimate.value:.5g}{spread} {estimate.unit}".rstrip() + f", {_source(estimate.source)}"


def _source(source: str) -> str:
    return "stated" if source == "given" else f"measured ({source})"


def _sections(v: Mapping[str, float], why: Mapping[str, str], options: ExportOptions) -> dict[str, tuple[_Line, ...]]:
    load = v["mass"] * GRAVITY / v["wheels"]
    stiffness = v["tire_vertical_stiffness"] / 2  # of one tire; the parameter is that of an axle
    unloaded = v["wheel_radius"] + DEFLECTION_SHARE * load / stiffness
    b, c, d, e = (v[f"tire_{letter}"] for letter in "BCDE")
    fall = 0.0 - d * load * v["tire_load_sensitivity"]
    usual = "assumed: typical tire; the formula does not use it"
    return {
        "MDI_HEADER": (
            _Line("FILE_TYPE", "tir"),
            _Line("FILE_VERSION", 3.0),
            _Line("FILE_FORMAT", "ASCII"),
        ),
        "UNITS": tuple(
            _Line(key, unit)
            for key, unit in (
                *(("LENGTH", "meter"), ("FORCE", "newton"), ("ANGLE", "radians")),
                *(("MASS", "kg"), ("TIME", "second")),
            )
        ),
        "MODEL": (
            _Line("PROPERTY_FILE_FORMAT", "PAC2002"),
            _Line("USE_MODE", 1, "longitudinal slip only"),
            _Line("VXLOW", 1.0, "m/s, below which the simulation program smooths the slip"),
            _Line("LONGVL", 16.7, "m/s, reference speed"),
            _Line("TYRESIDE", "LEFT"),
        ),
        "DIMENSION": (
            _Line("UNLOADED_RADIUS", unloaded, f"{why['wheel_radius']}, plus one third of the deflection (assumed)"),
            _Line("WIDTH", WIDTH, usual),
            _Line("ASPECT_RATIO", ASPECT, usual),
            _Line("RIM_RADIUS", unloaded - WIDTH * ASPECT, usual),
            _Line("RIM_WIDTH", 0.77 * WIDTH, usual),
        ),
        "VERTICAL": (
            _Line("VERTICAL_STIFFNESS", stiffness, f"half an axle's: {why['tire_vertical_stiffness']}"),
            _Line(
                "VERTICAL_DAMPING", v["tire_vertical_damping"] / 2, f"half an axle's: {why['tire_vertical_damping']}"
            ),
            _Line("FNOMIN", load, f"a quarter of the weight: {why['mass']}"),
        ),
        "LONG_SLIP_RANGE": (_Line("KPUMIN", -1.0), _Line("KPUMAX", 1.0)),
        "VERTICAL_FORCE_RANGE": (_Line("FZMIN", 0.0), _Line("FZMAX", 3 * load)),
        "SCALING_COEFFICIENTS": tuple(
            _Line(key, 1.0) for key in ("LFZO", "LCX", "LMUX", "LEX", "LKX", "LHX", "LVX", "LSGKP", "LMY")
        ),
        "LONGITUDINAL_COEFFICIENTS": (
            _Line("PCX1", c, why["tire_C"]),
            _Line("PDX1", d, why["tire_D"]),
            _Line("PDX2", fall, f"load sensitivity: {why['tire_load_sensitivity']}"),
            _Line("PDX3", 0.0, "camber was not measured"),
            _Line("PEX1", e, why["tire_E"]),
            *(_Line(f"PEX{k}", 0.0) for k in (2, 3, 4)),
            _Line("PKX1", b * c * d, f"B C D, with {why['tire_B']}"),
            _Line("PKX2", b * c * fall, "makes B independent of load"),
            _Line("PKX3", 0.0),
            _Line("PHX1", v["tire_Sh"], why["tire_Sh"]),
            _Line("PHX2", 0.0),
            _Line("PVX1", v["tire_Sv"], why["tire_Sv"]),
            _Line("PVX2", 0.0),
            _Line("PTX1", v["tire_relaxation_length"] / unloaded, why["tire_relaxation_length"]),
            _Line("PTX2", 0.0),
            _Line("PTX3", -1.0, "relaxation length constant over load, to first order"),
        ),
        "ROLLING_COEFFICIENTS": (
            _Line("QSY1", v["rolling_resistance"], why["rolling_resistance"]),
            *(_Line(f"QSY{k}", 0.0) for k in (2, 3, 4)),
        ),
    }

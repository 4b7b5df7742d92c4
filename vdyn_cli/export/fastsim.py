"""The body of a vehicle for FASTSim 3: the part of its vehicle file without the powertrain."""

from __future__ import annotations

from vdyn_cli.export import Driven, ExportedFiles, ExportOptions
from vdyn_cli.export.parameter_file import ParameterFile, refuse_missing
from vdyn_cli.export.receiver_keys import ReceiverKey, left_out, refuse_outside, source_of
from vdyn_cli.quantities.constants import USUAL_WHEELS

NEEDED = (
    *("mass", "wheelbase", "cg_height", "drag_area", "rolling_resistance", "wheel_inertia", "wheel_radius"),
    "cg_to_rear",
)
# m^2 and 1, of a passenger car and of FASTSim's vehicles. FASTSim uses only the product of area and drag coefficient.
USUAL_AREA, USUAL_FRICTION = 2.2, 0.7
DRIVE_TYPES: dict[Driven, str] = {"front": "FWD", "rear": "RWD", "both": "AWD"}


def made(parameter_file: ParameterFile, options: ExportOptions) -> ExportedFiles:
    """``<name>_fastsim.yaml``: the keys ``name``, ``mass_kilograms`` and ``chassis`` of a vehicle of FASTSim 3.1.

    P = (rho/2 Cd A v^2 + crr M g cos + M g sin + (M + n J / r^2) a) v, with n wheels; traction limited by
    wheel_fric_coef times the driven axle's share of the weight.

    Assumes the area of a common car if ``frontal_area`` is missing (Cd A remains exact), and a friction of 0.7 if the
    tire was not measured. Limits are those of FASTSim's checks: no negative number, shares up to 1.
    Source of names, units and limits: ``fastsim-core/src/vehicle/chassis.rs`` of github.com/NREL/fastsim, 3.1.0.

    Raises
    ------
    InputError : a parameter is missing, or FASTSim does not accept it.
    """
    found = parameter_file.parameters
    absent = ("cg_to_rear",) if "cg_to_front" in found else ()
    refuse_missing(parameter_file, [n for n in NEEDED if n not in absent], "FASTSim")
    chassis, notes = _chassis(parameter_file, options)
    mass = ReceiverKey("mass_kilograms", found["mass"].value, source_of(parameter_file, "mass", "kg"), 0.0)
    refuse_outside(parameter_file, [mass, *chassis], "FASTSim")
    lines = [
        f"# Body of: {parameter_file.title} ({parameter_file.name}), for FASTSim 3.1",
        "# Replace the same keys in a FASTSim vehicle file with your powertrain (pt_type).",
        f"name: {options.name}",
        mass.line,
        "chassis:",
        *(f"  {key.line}" for key in chassis),
        "  mass_kilograms: ~",
        "  glider_mass_kilograms: ~",
        "  cargo_mass_kilograms: ~",
    ]
    file = f"{options.name}_fastsim.yaml"
    first = f"{file}: replace the same keys in a FASTSim 3.1 vehicle file with your powertrain"
    return ExportedFiles(
        {file: ("\n".join(lines) + "\n").encode()}, (first, *notes, *left_out(parameter_file, "FASTSim"))
    )


def _chassis(parameter_file: ParameterFile, options: ExportOptions) -> tuple[list[ReceiverKey], tuple[str, ...]]:
    """The keys of the chassis, and notes on assumed values and on those left out."""
    found, notes = parameter_file.parameters, list[str]()

    def source(name: str) -> str:
        return source_of(parameter_file, name, found[name].unit)

    area, area_why = found.value("frontal_area", USUAL_AREA), "usual area; FASTSim uses Cd A only"
    if "frontal_area" in found:
        area_why = source("frontal_area")
    else:
        notes.append(
            f"frontal_area_square_meters is assumed to be {USUAL_AREA}: frontal_area is not given; Cd A is the estimate"
        )
    friction, friction_why = found.value("tire_D", USUAL_FRICTION), "usual; the tire was not measured"
    if "tire_D" in found:
        friction_why = source("tire_D")
    else:
        notes.append(f"wheel_fric_coef is assumed to be {USUAL_FRICTION}: tire_D is not given")
    wheels = found.value("wheels", USUAL_WHEELS)
    if "rotating_mass" in found:
        turning = wheels * found["wheel_inertia"].value / found["wheel_radius"].value ** 2
        rest = found["rotating_mass"].value - turning
        notes.append(f"{rest:.0f} kg of rotating_mass (driveline) are left out: FASTSim has no key for them")
    share, share_why = _share(parameter_file, options.driven)
    keys = [
        ReceiverKey("drag_coef", found["drag_area"].value / area, f"{source('drag_area')}, over the area", 0.0),
        ReceiverKey("frontal_area_square_meters", area, area_why, 0.0),
        ReceiverKey("wheel_rr_coef", found["rolling_resistance"].value, source("rolling_resistance"), 0.0),
        ReceiverKey("wheel_inertia_kilogram_square_meters", found["wheel_inertia"].value, source("wheel_inertia"), 0.0),
        ReceiverKey("num_wheels", round(wheels), source("wheels") if "wheels" in found else "of a car"),
        ReceiverKey("wheel_radius_meters", found["wheel_radius"].value, source("wheel_radius"), 0.0),
        ReceiverKey("tire_code", "~", "the radius is given"),
        ReceiverKey("cg_height_meters", found["cg_height"].value, source("cg_height"), 0.0),
        ReceiverKey("wheel_fric_coef", friction, friction_why, 0.0),
        ReceiverKey("drive_type", DRIVE_TYPES[options.driven], "--driven"),
        ReceiverKey("drive_axle_weight_frac", share, share_why, 0.0, 1.0),
        ReceiverKey("wheel_base_meters", found["wheelbase"].value, source("wheelbase"), 0.0),
    ]
    return keys, tuple(notes)


def _share(parameter_file: ParameterFile, driven: Driven) -> tuple[float, str]:
    """The driven axle's share of the weight at rest, and its source."""
    found = parameter_file.parameters
    if driven == "both":
        return 1.0, "both axles are driven"
    name = "cg_to_rear" if "cg_to_rear" in found else "cg_to_front"
    share = found[name].value / found["wheelbase"].value
    front = share if name == "cg_to_rear" else 1.0 - share
    return front if driven == "front" else 1.0 - front, source_of(parameter_file, name, "m")

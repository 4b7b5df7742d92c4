"""The road load for type-approval programs: the keys of wltp 1.1 and of CO2MPAS 4.1 to 4.3."""

from __future__ import annotations

from vdyn_cli.export import ExportedFiles, ExportOptions
from vdyn_cli.export.parameter_file import ParameterFile, refuse_missing
from vdyn_cli.export.receiver_keys import ReceiverKey, left_out, refuse_outside, source_of
from vdyn_cli.quantities.quantity import from_si

LOADS = (("f0", "road_load_f0", "N"), ("f1", "road_load_f1", "N/(km/h)"), ("f2", "road_load_f2", "N/(km/h)^2"))
NEEDED = ("mass", *(name for _, name, _ in LOADS))
POSITIVE = ("f0", "f2")  # CO2MPAS 4.1 refuses negative values of these, 4.3 only of f2; f1 may have either sign


def made(parameter_file: ParameterFile, options: ExportOptions) -> ExportedFiles:
    """``<name>_wltp.yaml`` for wltp and ``<name>_co2mpas.yaml`` for CO2MPAS, the vehicle's part of their inputs.

    F = f0 + f1 v + f2 v^2, v in km/h, F in N, at reference conditions if the coast-down was corrected to them;
    mass in kg as tested, ``r_dynamic`` the effective rolling radius in m.

    Assumes CO2MPAS' limits for both: f0, f2, mass and radius not negative.
    Source of names, units and limits: ``wltp/datamodel.py`` of github.com/JRCSTU/wltp and
    ``co2mpas/core/load/schema.py`` of github.com/JRCSTU/CO2MPAS-TA, 2020, and of the package co2mpas 4.3.7.

    Raises
    ------
    InputError : a coefficient, mass or radius is missing, or CO2MPAS does not accept it.
    """
    refuse_missing(parameter_file, (*NEEDED, "wheel_radius"), "a WLTP program")
    found = parameter_file.parameters
    loads = []
    for key, name, unit in LOADS:
        value, lower = from_si(found[name].value, unit, found[name].unit), 0.0 if key in POSITIVE else -1e9
        loads.append(ReceiverKey(key, value, source_of(parameter_file, name, unit), lower))
    mass = source_of(parameter_file, "mass", "kg")
    radius = source_of(parameter_file, "wheel_radius", "m")
    wltp = [ReceiverKey("test_mass", found["mass"].value, mass, 0.0), *loads]
    co2mpas = [ReceiverKey("vehicle_mass", found["mass"].value, mass, 0.0), *loads]
    co2mpas.append(ReceiverKey("r_dynamic", found["wheel_radius"].value, radius, 0.0))
    refuse_outside(parameter_file, co2mpas, "CO2MPAS")
    head = f"# Road load of: {parameter_file.title} ({parameter_file.name})"
    older = ", ".join(f"{k.value:.7g}" for k in loads)
    files = {}
    for receiver, keys in (("wltp", wltp), ("co2mpas", co2mpas)):
        files[f"{options.name}_{receiver}.yaml"] = "\n".join([head, *(k.line for k in keys)]).encode() + b"\n"
    files[f"{options.name}_wltp.yaml"] += f"# wltp 0.1 reads them as resistance_coeffs: [{older}]\n".encode()
    notes = (
        f"{options.name}_wltp.yaml: keys of wltp 1.1; add the engine's (p_rated, n_rated, n_idle, gear_ratios, wot)",
        f"{options.name}_co2mpas.yaml: names of the input sheet of CO2MPAS 4.1 to 4.3",
    )
    return ExportedFiles(files, (*notes, *left_out(parameter_file, "f0 + f1 v + f2 v^2")))

"""The full vehicle as C99: ``<name>.h``, ``<name>.c``, and ``<name>_main.c`` with a tip-in and a stop as example."""

from __future__ import annotations

from vdyn_cli.engine.c_source import plain
from vdyn_cli.export import ExportedFiles, ExportOptions
from vdyn_cli.export.exported_vehicle import ExportedVehicle, exported_vehicle
from vdyn_cli.export.parameter_file import ParameterFile
from vdyn_cli.quantities.constants import GRAVITY

COMPILE = "cc -std=c99 -O2 {0}.c {0}_main.c -lm -o {0}"

MAIN = """/* {title}: rest, tip-in, back-out, brakes, rest again. Compile: {command} */
#include <stdio.h>

#include "{name}.h"

int main(void)
{{
    const double dt = 0.001; /* s, the longest step that resolves half-shafts and wheel hop */
    const double torque = {torque!r}; /* N m at the driveline's input, for 0.2 g */
    const double brakes = {brakes!r}; /* N m, sum over the wheels, for 0.4 g */
    {name}_parameters p = {name}_defaults; /* change any parameter: p.mass = 1600.0; */
    {name}_state x;
    {name}_input now = {{0}}, next = {{0}};
    {name}_output y;
    int k;
    {name}_init(&x, &now, &p, 0.0);
    printf("time_s,drive_torque_Nm,speed_mps,{shaft}_Nm,jerk_mps3\\n");
    for (k = 0; k <= 10000; k++) {{
        next.drive_torque = (k >= 1000 && k < 4000) ? torque : 0.0;
        next.brake_torque = (k >= 5000) ? brakes : 0.0;
        next.elapsed = (k + 1) * dt;
        {name}_step(&x, &now, &next, dt, &p, &y); /* y: the outputs before the step */
        if (k % 100 == 0) {{
            printf("%.3f,%.1f,%.6f,%.3f,%.3f\\n", k * dt, now.drive_torque, y.speed, y.{shaft}, y.jerk);
        }}
        now = next;
    }}
    return 0;
}}
"""


def made(parameter_file: ParameterFile, options: ExportOptions) -> ExportedFiles:
    """The three files.

    Raises
    ------
    InputError : parameters are missing and have no default.
    """
    car = exported_vehicle(parameter_file, options.driven, options.differential)
    title = f"{parameter_file.title} ({parameter_file.name})"
    program = car.program(options.name, title)
    name = options.name
    files = {
        f"{name}.h": program.header.encode(),
        f"{name}.c": program.source.encode(),
        f"{name}_main.c": _main(car, name, title).encode(),
    }
    return ExportedFiles(files, (*car.notes, f"compile with: {COMPILE.format(name)}"))


def _main(car: ExportedVehicle, name: str, title: str) -> str:
    v = car.values
    weight = v["mass"] * GRAVITY * v["wheel_radius"]
    torque = round(0.2 * weight / v["gear_ratio"], 0)
    brakes = round(0.4 * weight, 0)
    command = COMPILE.format(name)
    return MAIN.format(
        title=plain(title), command=command, name=name, torque=torque, brakes=brakes, shaft="shaft_torque_left"
    )

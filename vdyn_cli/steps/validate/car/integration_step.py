"""The longest integration step with which a car's drives are accurately simulated."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.validate.car.simulation import Car

COARSE = 1e-3  # share of a channel's range by which half the step may change it
SHORTEST_STEP = 0.0005  # s, the shortest step that is tried for that reason


def with_accurate_step(car: Car) -> Car:
    """The car with its step halved until half a step changes no channel by ``COARSE`` of its range.

    Raises
    ------
    ResultError : the simulation is not finite in the shortest of them.
    """
    half, setup = replace(car, step=car.step / 2), car.at_prior
    last = half.step < SHORTEST_STEP

    def error(segment: int) -> float:
        """Largest change of a compared channel by half the step, as a share of its range."""
        start = setup.vector.start(segment)[setup.vector.simulated]
        errors = setup.simulator.step_error(car.inputs.drives[segment], start)
        return max(errors[n] for n in car.sensors.channels)

    try:
        worst = max(setup.each(error))
    except ResultError:
        if last:
            raise
        return with_accurate_step(half)
    return car if last or worst < COARSE else with_accurate_step(half)

"""Start speeds with which the simulated sensor reads the measured speed, and the error of simulations that start so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from vdyn_cli.steps.validate.car.simulation import SimulationSetup

SAME_READING = 0.02  # m/s, difference of two readings of a start speed that is negligible
LEAST_SLOPE = 1e-3  # derivative of a reading to the speed, below which the reading does not determine the speed


def with_read_starts(setup: SimulationSetup) -> SimulationSetup:
    """The setup whose simulated speed sensor reads the measured speed at the first sample of each segment.

    One Newton step per segment, V0 = V + (measured - reading) / (d reading / dV): exact for a sensor's gain.
    Unchanged if all readings agree already, for example without effects in the model.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    speeds, agree, place = [], True, len(setup.vector.shared)
    for k, o in enumerate(setup.first):
        measured, std = setup.vector.start_speed(k)
        off, slope = measured - o.values["speed"][0], o.sensitivities["speed"][0, place]
        agree &= bool(abs(off) < max(std, SAME_READING))
        speeds.append(setup.vector.first_speed(k) + (off / slope if slope > LEAST_SLOPE else 0.0))
    return setup if agree else setup.moved_to(replace(setup.point, start_speeds=tuple(speeds)))


def rms_speed_error(setup: SimulationSetup) -> float:
    """Rms error of the speed, m/s, at the start values; each segment starts where its sensor reads the measured speed.

    A nonzero start speed is scaled by measured over read speed, which is exact for a sensor's gain. For the full
    vehicle, which is expensive to simulate, only the first segment is used.

    Raises
    ------
    ResultError : a simulation is not finite.
    """
    place = len(setup.vector.shared)

    def squares(k: int) -> tuple[float, int]:
        theta, measured = setup.vector.start(k), setup.segments[k].outputs["speed"]
        speed = setup.simulate(k, theta, slopes=False).values["speed"]
        if theta[place] > 0.0 < speed[0] and abs(theta[place] - speed[0]) > SAME_READING:
            theta[place] *= theta[place] / speed[0]
            speed = setup.simulate(k, theta, slopes=False).values["speed"]
        error = (speed - measured)[np.isfinite(measured)]
        return float(error @ error), error.size

    if setup.model.name == "vehicle":
        found: tuple[tuple[float, int], ...] = (squares(0),)
    else:
        found = setup.each(squares)
    return float(np.sqrt(sum(s for s, _ in found) / sum(n for _, n in found)))

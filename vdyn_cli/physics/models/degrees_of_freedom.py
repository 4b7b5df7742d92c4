"""The degrees of freedom of the full vehicle, counted as they are built."""

from __future__ import annotations

from collections.abc import Mapping

from vdyn_cli.physics.models.vehicle import Driven, Torque
from vdyn_cli.physics.models.vehicle_axle import Differential


def degrees_of_freedom(
    driven: Driven = "front", torque: Torque = "axle", differential: Differential = "open"
) -> Mapping[str, int]:
    """How many coordinates describe the vehicle's position, by what they describe.

    Parameters
    ----------
    driven, torque, differential : as of ``models.vehicle``.

    Notes
    -----
    A front-driven car has 16 with an open differential (the carrier turns at the mean of the two inner ends, so that
    it adds none), 15 with a locked one. SAE 2017-01-1574 counts 18, with a second twist in each half-shaft: a mass
    within the stepped bar. Held at its ends such a bar turns at 2.0 kHz (right) and 3.8 kHz (left) about itself, and
    with a joint of 0.003 kg m^2 in its middle at 0.7 kHz; integration steps of 1 ms cannot follow that, and it holds
    less than 2e-3 of the wheel's inertia. Up to 40 Hz, where the driveline's modes lie, the sections in series,
    1/k = sum 1/ki, are then exact to 0.4 %.
    Slip, contact and friction have states of first order besides, which are no degrees of freedom.
    """
    axles = 2 if driven == "both" else 1
    inner = 1 if torque == "axle" and differential == "locked" else 2
    return {
        "body: forward, sideways, up; roll, pitch, yaw": 6,
        "height of each wheel (suspension travel)": 4,
        "spin of each wheel": 4,
        "half-shafts' inner ends, which twist them" + (" (together)" if inner == 1 else ""): inner * axles,
    }

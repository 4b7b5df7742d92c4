"""The degrees of freedom of the full vehicle."""

from __future__ import annotations

from collections.abc import Mapping

from vdyn_cli.physics.models.vehicle import Driven, Torque
from vdyn_cli.physics.models.vehicle_axle import Differential


def degrees_of_freedom(
    driven: Driven = "front", torque: Torque = "axle", differential: Differential = "open"
) -> Mapping[str, int]:
    """Number of coordinates of the vehicle's position, by what they describe.

    Parameters
    ----------
    driven, torque, differential : as of ``models.vehicle``.

    Notes
    -----
    A front-driven car has 16 with an open differential (the carrier turns at the mean of the two inner ends, so that
    it adds none), 15 with a locked one. SAE 2017-01-1574 counts 18, with a second twist in each half-shaft: a mass
    within the stepped bar. With fixed ends such a bar oscillates at 2.0 kHz (right) and 3.8 kHz (left), and with a
    joint of 0.003 kg m^2 in its middle at 0.7 kHz; integration steps of 1 ms cannot resolve that, and its inertia is
    below 2e-3 of the wheel's. Up to 40 Hz, the range of the driveline's modes, the stiffness of the sections in series,
    1/k = sum 1/ki, is accurate to 0.4 %.
    Slip, contact and friction add states of first order, which are not degrees of freedom.
    """
    axles = 2 if driven == "both" else 1
    inner = 1 if torque == "axle" and differential == "locked" else 2
    return {
        "body: forward, sideways, up; roll, pitch, yaw": 6,
        "height of each wheel (suspension travel)": 4,
        "spin of each wheel": 4,
        "half-shafts' inner ends, which twist them" + (" (together)" if inner == 1 else ""): inner * axles,
    }

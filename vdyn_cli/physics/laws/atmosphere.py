"""Air density from temperature, pressure and humidity."""

from __future__ import annotations

import math

GAS_CONSTANT_DRY = 287.055  # J/(kg K), dry air
GAS_CONSTANT_VAPOR = 461.495  # J/(kg K), water vapor


def air_density(temperature: float, pressure: float, humidity: float = 0.0) -> float:
    """Density of moist air as a mixture of ideal gases.

    rho = (p - e)/(Rd T) + e/(Rv T), e = humidity * es(T), es after Magnus.

    Parameters
    ----------
    temperature : K, above 203.
    pressure : Pa.
    humidity : relative, 0 to 1.

    Returns
    -------
    kg/m^3, within 0.1 % for weather at the ground.

    Notes
    -----
    Magnus form with the coefficients of WMO-No. 8 (es = 611.2 Pa exp(17.62 t/(243.12 + t)), t in degC).
    """
    celsius = temperature - 273.15
    vapor = humidity * 611.2 * math.exp(17.62 * celsius / (243.12 + celsius))
    return (pressure - vapor) / (GAS_CONSTANT_DRY * temperature) + vapor / (GAS_CONSTANT_VAPOR * temperature)
